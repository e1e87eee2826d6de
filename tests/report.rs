//! The run report: names other programs rely on, the stage table, the histogram.

#[path = "common/schema.rs"]
mod schema;

use std::collections::BTreeMap;

use glam::DVec3;
use idmesh::backend::DeviceWork;
use idmesh::mesh::{FamilyId, TetMesh};
use idmesh::mover::{
    FamilyReport, MovedSection, ProfileReport, Solver, StageName, StageQuality, StageRelaxation, StageSeconds,
};
use idmesh::profile::ProfileMatch;
use idmesh::quality::Statistics;
use idmesh::relaxation::Relaxation;
use idmesh::report::{
    Backend, Checks, Checksums, FamilySize, Kind, Measured, Mesh, OpenFoam, Outline, Repaired, ReportError, RunReport,
    Seconds, Series, Smoothing, SolverQualities, SolverQuality, Su2, WorstCell, histogram_svg, kind_table,
    solver_table, stage_remark, stage_table,
};
use idmesh::volume::{Path, StepVerdict, TriedStep};
use schema::assert_report;

fn stages() -> Vec<StageQuality> {
    // The paper's Table 1.
    let row = |name, beta_min, beta_max, beta_mean, inverted, seconds| StageQuality {
        name,
        beta_min,
        beta_max,
        beta_mean,
        inverted,
        seconds,
    };
    vec![
        row(StageName::Original, 0.008182, 0.109553, 0.0361731, 0, 0.0),
        row(StageName::Deformed, -0.073921, 0.107143, 0.0236085, 17160, 0.25),
        row(StageName::Corrected, -0.073921, 0.107143, 0.0223170, 18441, 1.5),
        row(StageName::Final, 0.004392, 0.107143, 0.0361874, 0, 12.0),
    ]
}

fn solver_quality() -> SolverQuality {
    let openfoam = OpenFoam {
        non_orthogonality_max: 69.5,
        non_orthogonality_mean: 20.25,
        severely_non_orthogonal_faces: 0,
        skewness_max: 1.25,
        aspect_ratio_max: 17.5,
        wrong_face_pyramids: 0,
        volume_min: 1e-6,
        volume_max: 0.5,
    };
    let su2 = Su2 {
        orthogonality_min: 31.5,
        orthogonality_max: 89.5,
        aspect_ratio_min: 1.5,
        aspect_ratio_max: 250.0,
        volume_ratio_min: 1.25,
        volume_ratio_max: 40.0,
        dual_volume_min: 1e-5,
        dual_volume_max: 0.75,
    };
    SolverQuality { openfoam, su2 }
}

fn report() -> RunReport {
    let families = BTreeMap::from([
        ("carenage".into(), FamilyReport { max_distance_to_original_surface: Some(1e-9), ..Default::default() }),
        ("symmetry".into(), FamilyReport { max_distance_to_plane: Some(0.0), ..Default::default() }),
        ("wing".into(), FamilyReport { folded_triangles: 2, pierced_triangles: 1, ..Default::default() }),
    ]);
    let step = TriedStep {
        from: 0.25,
        to: 0.5,
        verdict: StepVerdict::NotConverged,
        inverted: 9,
        inverted_optimised: Some(0),
        worst: Some(0.125),
    };
    RunReport {
        idmesh: "0.1.0".into(),
        case: "case.toml".into(),
        design: Some("a/1".into()),
        backend: Backend {
            kind: "gpu".into(),
            adapter: "llvmpipe".into(),
            driver: "Mesa".into(),
            arithmetic: "f64".into(),
        },
        mesh: Mesh {
            vertices: 22402,
            tets: 96693,
            families: BTreeMap::from([("wing".into(), FamilySize { vertices: 10, triangles: 16, quadrilaterals: 0 })]),
            ..Mesh::default()
        },
        valid: false,
        converged: Some(true),
        exit: 5,
        error: Some(ReportError {
            kind: "inverted".into(),
            count: Some(2),
            place: None,
            message: "2 of 96693 tets are inverted".into(),
            hint: None,
            faults: Vec::new(),
        }),
        checks: Some(Checks {
            inverted_tets: 2,
            folded_triangles: 2,
            self_intersecting_triangles: 1,
            max_distance_off_surface: Some(1e-9),
            max_distance_to_new_profiles: Some(2e-3),
            ..Checks::default()
        }),
        repaired: Some(Repaired { inverted_tets: 18439, optimised_vertices: 345 }),
        stages: Some(stages()),
        cells: Some(BTreeMap::from([(
            "prisms",
            Kind { count: 7, inverted: 2, jacobian_min: -0.5, jacobian_mean: 0.75, shape_min: Some(-0.25) },
        )])),
        cells_original: Some(BTreeMap::from([(
            "prisms",
            Kind { count: 7, inverted: 0, jacobian_min: 0.5, jacobian_mean: 0.875, shape_min: None },
        )])),
        solver_quality: Some(SolverQualities {
            limits: BTreeMap::from([("skewness", 4.0)]),
            original: solver_quality(),
            moved: solver_quality(),
        }),
        worst_cells: Some(vec![WorstCell {
            kind: "prism",
            index: 3,
            at: [1.0, 2.0, 0.5],
            family: Some("wing".into()),
            touches: true,
            measure: "scaled-jacobian",
            value: -0.5,
            original: 0.75,
        }]),
        families: Some(families),
        profiles: Some(BTreeMap::from([(
            "wing".into(),
            ProfileReport {
                max_distance_to_new_profiles: Some(2e-3),
                max_miss_of_vertices: None,
                compared_with_flat_cuts: false,
                matches: BTreeMap::from([(7, ProfileMatch::Measure)]),
                not_measured: Some("why".into()),
                shared_curves: Vec::new(),
            },
        )])),
        sections: Some(BTreeMap::from([(
            "wing".into(),
            vec![MovedSection { profile: 7, max_distance_to_new_profile: 2e-3, points: vec![DVec3::ONE] }],
        )])),
        outlines: Some(BTreeMap::from([(
            "wing".into(),
            vec![Outline { profile: 7, change: 0.5, old: vec![[0.0, 0.5]], new: vec![[1.0, 2.0]] }],
        )])),
        solver: Some(Solver { method: "chebyshev".into(), sweeps: 700, relative_residual: 1e-5 }),
        relaxations: Some(vec![StageRelaxation {
            stage: "volume",
            relaxation: Relaxation {
                of: "rotation",
                method: "chebyshev",
                converged: true,
                sweeps: 32,
                changes: vec![(16, 0.5), (32, 0.125)],
                residuals: vec![(0, 1.0), (32, 0.25)],
            },
        }]),
        device_work: Some(DeviceWork {
            bytes_up: 1,
            bytes_down: 2,
            submissions: 3,
            reads: 4,
            dispatches: 5,
            copies: 6,
            clears: 7,
        }),
        stage_seconds: Some(vec![
            StageSeconds::new("planes", 0.5, 0.0, None),
            StageSeconds::new("volume", 2.0, 1.5, Some(1.25)),
        ]),
        path: Some(Path { steps: 3, given_up: 1, reached: 1.0, tried: vec![step] }),
        smoothing: Some(Smoothing { sweeps: 12, moved: 345 }),
        warnings: vec!["mind the gap".into()],
        checksums: Some(Checksums { case: BTreeMap::from([("case.toml".into(), None)]), ..Checksums::default() }),
        seconds: Some(Seconds { read: 0.5, setup: 1.0, update: 13.75, write: 0.25, total: 15.5 }),
        reasons: BTreeMap::new(),
    }
    .with_reasons()
}

#[test]
fn json_has_the_promised_names() {
    let found: serde_json::Value = serde_json::to_value(report()).unwrap();
    let solvers = serde_json::json!({
        "openfoam": {
            "non_orthogonality_max": 69.5, "non_orthogonality_mean": 20.25, "severely_non_orthogonal_faces": 0,
            "skewness_max": 1.25, "aspect_ratio_max": 17.5, "wrong_face_pyramids": 0, "volume_min": 1e-6, "volume_max": 0.5
        },
        "su2": {
            "orthogonality_min": 31.5, "orthogonality_max": 89.5, "aspect_ratio_min": 1.5, "aspect_ratio_max": 250.0,
            "volume_ratio_min": 1.25, "volume_ratio_max": 40.0, "dual_volume_min": 1e-5, "dual_volume_max": 0.75
        }
    });
    let expected = serde_json::json!({
        "idmesh": "0.1.0", "case": "case.toml", "design": "a/1",
        "backend": { "kind": "gpu", "adapter": "llvmpipe", "driver": "Mesa", "arithmetic": "f64" },
        "mesh": { "vertices": 22402, "tets": 96693, "families": { "wing": { "vertices": 10, "triangles": 16 } } },
        "stages": [
            { "name": "original", "beta_min": 0.008182, "beta_max": 0.109553, "beta_mean": 0.0361731, "inverted": 0, "seconds": 0.0 },
            { "name": "deformed", "beta_min": -0.073921, "beta_max": 0.107143, "beta_mean": 0.0236085, "inverted": 17160, "seconds": 0.25 },
            { "name": "corrected", "beta_min": -0.073921, "beta_max": 0.107143, "beta_mean": 0.022317, "inverted": 18441, "seconds": 1.5 },
            { "name": "final", "beta_min": 0.004392, "beta_max": 0.107143, "beta_mean": 0.0361874, "inverted": 0, "seconds": 12.0 }
        ],
        "cells": { "prisms": { "count": 7, "inverted": 2, "jacobian_min": -0.5, "jacobian_mean": 0.75, "shape_min": -0.25 } },
        "cells_original": { "prisms": { "count": 7, "inverted": 0, "jacobian_min": 0.5, "jacobian_mean": 0.875 } },
        "families": { "carenage": { "max_distance_to_original_surface": 1e-9 }, "symmetry": { "max_distance_to_plane": 0.0 },
                      "wing": { "folded_triangles": 2, "pierced_triangles": 1 } },
        "profiles": { "wing": { "max_distance_to_new_profiles": 2e-3, "max_miss_of_vertices": null, "not_measured": "why",
                                  "match": { "7": "measure" } } },
        "solver_quality": { "limits": { "skewness": 4.0 }, "original": solvers, "moved": solvers },
        "worst_cells": [
            { "kind": "prism", "index": 3, "at": [1.0, 2.0, 0.5], "family": "wing", "touches": true,
              "measure": "scaled-jacobian", "value": -0.5, "original": 0.75 }
        ],
        "sections": { "wing": [{ "profile": 7, "max_distance_to_new_profile": 2e-3 }] },
        "outlines": { "wing": [{ "profile": 7, "change": 0.5, "old": [[0.0, 0.5]], "new": [[1.0, 2.0]] }] },
        "relaxations": [
            { "stage": "volume", "of": "rotation", "method": "chebyshev", "converged": true, "sweeps": 32,
              "changes": [[16, 0.5], [32, 0.125]], "residuals": [[0, 1.0], [32, 0.25]] }
        ],
        "solver": { "method": "chebyshev", "sweeps": 700, "relative_residual": 1e-5 },
        "path": {
            "steps": 3, "given_up": 1, "reached": 1.0,
            "tried": [{ "from": 0.25, "to": 0.5, "verdict": "not-converged", "inverted": 9, "inverted_optimised": 0, "worst": 0.125 }]
        },
        "valid": false, "converged": true, "exit": 5,
        "error": { "kind": "inverted", "count": 2, "place": null, "message": "2 of 96693 tets are inverted", "hint": null, "faults": [] },
        "checks": {
            "inverted_tets": 2, "self_intersecting_triangles": 1, "folded_triangles": 2, "vertices_off_surface": 0,
            "max_distance_off_surface": 1e-9, "parted_partners": 0, "held_back_vertices": 0,
            "max_distance_to_new_profiles": 2e-3, "max_miss_of_vertices": null
        },
        "repaired": { "inverted_tets": 18439, "optimised_vertices": 345 },
        "device_work": {
            "bytes_up": 1, "bytes_down": 2, "submissions": 3, "reads": 4, "dispatches": 5, "copies": 6, "clears": 7
        },
        "stage_seconds": [
            { "stage": "planes", "seconds": 0.5, "waiting": 0.0 },
            { "stage": "volume", "seconds": 2.0, "waiting": 1.5, "kernels": 1.25 }
        ],
        "warnings": ["mind the gap"],
        "checksums": { "case": { "case.toml": null }, "mesh": {}, "inputs": {}, "design": {}, "outputs": {} },
        "reasons": {
            "/error/place": "the fault has no place", "/error/hint": "nothing is known to help",
            "/checks/max_miss_of_vertices": "why", "/profiles/wing/max_miss_of_vertices": "why",
            "/checksums/case/case.toml": "the file is missing, or cannot be read twice"
        },
        "smoothing": { "sweeps": 12, "moved": 345 },
        "seconds": { "read": 0.5, "setup": 1.0, "update": 13.75, "write": 0.25, "total": 15.5 }
    });
    assert_eq!(found, expected);
    assert_report(&found);
}

/// The check of a report against its schema finds a key too few, a key too many, a wrong type, a
/// value out of range and a missing reason.
#[test]
#[expect(clippy::type_complexity, reason = "a table of changes")]
fn a_report_that_breaks_its_schema_is_found() {
    let changes: [(&str, fn(&mut serde_json::Value)); 6] = [
        ("required", |report| drop(report.as_object_mut().unwrap().remove("checks"))),
        ("additionalProperties", |report| report["checks"]["more"] = 1.into()),
        ("type", |report| report["mesh"]["tets"] = "many".into()),
        ("enum", |report| report["stages"][0]["name"] = "first".into()),
        ("minimum", |report| report["families"]["symmetry"]["max_distance_to_plane"] = (-1.0).into()),
        ("null are", |report| report["converged"] = serde_json::Value::Null),
    ];
    for (words, change) in changes {
        let mut report = serde_json::to_value(report()).unwrap();
        change(&mut report);
        let panic = std::panic::catch_unwind(|| assert_report(&report)).unwrap_err();
        let message = panic.downcast_ref::<String>().unwrap();
        assert!(message.contains(words), "\"{words}\" is not in {message}");
    }
}

#[test]
fn what_is_not_finite_becomes_null() {
    let mut broken = report();
    broken.solver.as_mut().unwrap().relative_residual = f64::NAN;
    let broken = serde_json::to_value(broken.with_reasons()).unwrap();
    assert!(broken["solver"]["relative_residual"].is_null());
    assert_eq!(broken["reasons"]["/solver/relative_residual"], "not a finite number");
    assert_report(&broken);
}

#[test]
fn table_is_the_papers() {
    let expected = "\
stage       beta min  beta max  beta mean  inverted  seconds
Original    0.008182  0.109553  0.0361731         0    0.000
Deformed   -0.073921  0.107143  0.0236085     17160    0.250
Corrected  -0.073921  0.107143  0.0223170     18441    1.500
Final       0.004392  0.107143  0.0361874         0   12.000
";
    assert_eq!(stage_table(&stages()), expected);
}

/// The line below the table says what its columns count; in a mesh of tets there is nothing to say.
#[test]
fn the_table_tells_which_cells_it_counts() {
    let mesh = |tets, prisms| Mesh { tets, prisms, ..Mesh::default() };
    assert_eq!(stage_remark(&mesh(5, 0)), "");
    assert_eq!(stage_remark(&mesh(5, 2)), "beta is that of the 5 tets; inverted counts all 7 cells\n");
    assert_eq!(stage_remark(&mesh(0, 2)), "no cell is a tet, so there is no beta; inverted counts all 2 cells\n");
}

/// Before and after stand one below the other. Small values keep their digits.
#[test]
fn kinds_are_shown_before_and_after() {
    let RunReport { cells, cells_original, .. } = report();
    let mut cells = cells.unwrap();
    let expected = "\
cells             count  inverted  jacobian min  jacobian mean  shape min
prisms, original      7         0        0.5000         0.8750
prisms, final         7         2       -0.5000         0.7500    -0.2500
";
    assert_eq!(kind_table(&cells, cells_original.as_ref()), expected);
    cells.get_mut("prisms").unwrap().jacobian_min = 1.25e-5;
    let alone = kind_table(&cells, None);
    assert!(alone.lines().nth(1).unwrap().split_whitespace().eq(["prisms", "7", "2", "1.250e-5", "0.7500", "-0.2500"]));
}

/// With limits only the measures that have one are shown.
#[test]
fn measures_of_solvers_are_shown_with_their_limits() {
    let (moved, limits) = (solver_quality(), BTreeMap::from([("skewness", 4.0), ("dual_volume_ratio", 20.5)]));
    let expected = "\
measure                    original   final  limit
OpenFOAM: skewness max        1.250   1.250      4
SU2: sub-volume ratio max    40.000  40.000   20.5
";
    assert_eq!(solver_table(&["original", "final"], &[&moved, &moved], &limits, true), expected);
    let all = solver_table(&["value"], &[&moved], &BTreeMap::new(), false);
    assert!(all.contains("OpenFOAM: wrong face pyramids"), "{all}");
    assert!(all.lines().all(|line| line.split_whitespace().last() != Some("limit")), "{all}");
}

/// A boundary layer's betas would all read 0.000007 with the paper's six decimals.
#[test]
fn table_keeps_digits_of_small_values() {
    let stage = StageQuality { beta_min: 6.604e-6, ..stages()[0] };
    assert!(stage_table(&[stage]).contains("6.604e-6"));
}

#[test]
fn statistics_of_known_values() {
    let statistics = Statistics::new(&[0.1, -0.05, 0.0, 0.05]);
    assert_eq!((statistics.min, statistics.max, statistics.inverted), (-0.05, 0.1, 2));
    assert!((statistics.mean - 0.025).abs() < 1e-17);
}

/// A NaN must show, wherever it stands.
#[test]
fn statistics_do_not_hide_nan() {
    for place in 0..3 {
        let mut beta = [0.1, 0.2, 0.3];
        beta[place] = f64::NAN;
        let statistics = Statistics::new(&beta);
        assert!(statistics.min.is_nan() && statistics.max.is_nan() && statistics.mean.is_nan());
        assert_eq!(statistics.inverted, 1);
    }
}

#[test]
fn mesh_counts_vertices_once_a_family() {
    let mesh = TetMesh {
        vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
        tets: vec![[0, 1, 2, 3]],
        triangles: vec![[0, 1, 2], [0, 1, 3], [1, 2, 3], [0, 2, 3]],
        triangle_family: [0, 1, 0, 1].map(FamilyId).to_vec(),
        families: vec!["wing".into(), "farfield".into(), "empty".into()],
    };
    let counted = Mesh::of(&mesh);
    assert_eq!((counted.vertices, counted.tets), (4, 1));
    assert_eq!(counted.families["wing"], FamilySize { vertices: 4, triangles: 2, quadrilaterals: 0 });
    assert_eq!(counted.families["farfield"], FamilySize { vertices: 4, triangles: 2, quadrilaterals: 0 });
    assert_eq!(counted.families["empty"], FamilySize::default());
}

/// Every opened element is closed, in order, and every attribute is quoted.
fn assert_well_formed(svg: &str) {
    let mut open = Vec::new();
    for piece in svg.split('<').skip(1) {
        let (tag, _) = piece.split_once('>').expect("a tag without end");
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "{tag}");
        } else if !tag.ends_with('/') {
            open.push(tag.split_whitespace().next().unwrap());
        }
    }
    assert!(open.is_empty(), "{open:?} never closed");
}

#[test]
fn histogram_is_svg_with_title_axes_and_legend() {
    let original: Vec<f64> = (0..1000).map(|i| 0.01 + 1e-4 * f64::from(i)).collect();
    let last: Vec<f64> = original.iter().map(|beta| beta - 0.03).collect();
    let series = [Series { name: "original", values: &original }, Series { name: "final <1>", values: &last }];
    let svg = histogram_svg(Measured::Beta, "wing & body", &series);
    assert_well_formed(&svg);
    for text in
        ["wing &amp; body", "original (1000 tets, mean 0.05995)", "final &lt;1&gt; (1000", "beta = V", "inverted"]
    {
        assert!(svg.contains(text), "{text} is missing");
    }
    assert_eq!(svg.matches("<path").count(), 2);
    assert_eq!(svg, histogram_svg(Measured::Beta, "wing & body", &series), "the same numbers give the same bytes");
}

/// The outline's highest point is where its largest bin is: bins of 10, 30 and 20 tets, axis to 30
/// in steps of 5.
#[test]
fn histogram_heights_are_counts() {
    let mut beta = vec![0.011; 10];
    beta.extend([0.0135; 30]);
    beta.extend([0.016; 20]);
    let svg = histogram_svg(Measured::Beta, "t", &[Series { name: "a", values: &beta }]);
    let path = svg.lines().find(|line| line.starts_with("<path")).unwrap();
    let heights: Vec<f64> = path
        .split(['M', 'V'])
        .skip(2)
        .map(|piece| piece.split([' ', '"']).next().unwrap().parse::<f64>().unwrap())
        .collect();
    let base = heights[0];
    let above: Vec<f64> = heights.iter().map(|height| base - height).filter(|&height| height > 0.0).collect();
    // Written to a tenth, so a difference of two is known to 0.1 and three times one to 0.3.
    assert_eq!(above.len(), 3, "{above:?}");
    assert!((above[0] * 3.0 - above[1]).abs() <= 0.4, "{above:?}");
    assert!((above[0] * 2.0 - above[2]).abs() <= 0.4, "{above:?}");
}

/// Bins of the scaled Jacobian are a fortieth wide, and 1 is in the last one. An empty series has
/// no mean.
#[test]
fn histogram_of_the_scaled_jacobian() {
    let series = [Series { name: "a", values: &[1.0, 1.0, 0.51, -0.01] }, Series { name: "b", values: &[] }];
    let svg = histogram_svg(Measured::ScaledJacobian, "t", &series);
    assert_well_formed(&svg);
    for text in ["scaled Jacobian of the worst corner", "cells per 0.025", "a (4 cells, mean 0.62500)", "b (0 cells)"] {
        assert!(svg.contains(text), "{text} is missing");
    }
    assert!(!svg.contains("NaN") && svg.contains(">1.0<") && !svg.contains("beta"));
    // One bin left of zero and 40 right of it; the last one is as high as its two cells.
    let path = svg.lines().find(|line| line.starts_with("<path")).unwrap();
    let heights: Vec<&str> = path.split(" V").skip(1).map(|step| step.split([' ', '"']).next().unwrap()).collect();
    assert_eq!(heights.len(), 42);
    assert!(heights[0] != heights[1] && heights[40] != heights[39], "{heights:?}");
}

#[test]
fn histogram_survives_odd_input() {
    assert_well_formed(&histogram_svg(Measured::Beta, "empty", &[]));
    assert_well_formed(&histogram_svg(Measured::Beta, "none", &[Series { name: "a", values: &[] }]));
    let wild = [f64::NAN, f64::INFINITY, -1e300, 1e300, 0.11785];
    assert_well_formed(&histogram_svg(Measured::Beta, "wild", &[Series { name: "a", values: &wild }]));
}
