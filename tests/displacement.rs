//! Files of prescribed displacements: what they hold, and which vertex each row is for.

use std::path::Path;

use glam::DVec3;
use idmesh::case::displacement::{self, DisplacementError};

fn rows(text: &str) -> Result<displacement::DisplacementTable, DisplacementError> {
    displacement::parse(text, Path::new("d.csv"))
}

#[test]
fn displacements_with_and_without_header() {
    let with = rows("x,y,z,dx,dy,dz\n1,2,3,0.5,0,-1e-3\n\n4,5,6,0,0,0\n").unwrap();
    let without = rows("1, 2, 3, 0.5, 0, -1e-3\r\n4,5,6,0,0,0").unwrap();
    assert_eq!(with.rows.len(), 2);
    let lines = [2, 4].map(displacement::RowPlace::Line);
    assert_eq!([with.rows[0].place, with.rows[1].place], lines);
    assert_eq!(with.rows[0].displacement, DVec3::new(0.5, 0.0, -1e-3));
    assert_eq!(
        without.rows.iter().map(|row| row.position).collect::<Vec<_>>(),
        [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 6.0)]
    );
}

/// Other separators, columns by their names, comments and Fortran's numbers give the same rows.
#[test]
fn displacements_as_others_write_them() {
    let plain = rows("1,2,3,0.5,0,-1e-3\n4,5,6,0,0.25,0\n").unwrap();
    let values = |table: &displacement::DisplacementTable| {
        table.rows.iter().map(|row| (row.position, row.displacement)).collect::<Vec<_>>()
    };
    for text in [
        "1 2 3 0.5 0 -1e-3\n  4\t5 6   0 0.25 0\n",
        "1\t2\t3\t0.5\t0\t-1e-3\n4\t5\t6\t0\t0.25\t0\n",
        "X; Y; Z; DX; DY; DZ\n1; 2; 3; 0.5; 0; -1e-3;\n4;5;6;0;0.25;0\n",
        "\"Points:0\",\"Points:1\",\"Points:2\",\"p\",\"Displacement:0\",\"Displacement:1\",\"Displacement:2\"\n\
         1,2,3,9,0.5,0,-1e-3\n4,5,6,,0,0.25,0\n",
        "dz dy dx z y x\n-1e-3 0 0.5 3 2 1\n0 0.25 0 6 5 4\n",
        // Units in brackets, which are not converted.
        "x [m],y [m],z [m],dx [m],dy [m],dz [m]\n1,2,3,0.5,0,-1e-3\n4,5,6,0,0.25,0\n",
        "# x (m) y (m) z (m) p (Pa) dx (m) dy (m) dz (m)\n1 2 3 9 0.5 0 -1e-3\n4 5 6 9 0 0.25 0\n",
        "\"x[mm]\";\"y[mm]\";\"z[mm]\";\"dx[mm]\";\"dy[mm]\";\"dz[mm]\"\n1;2;3;0.5;0;-1e-3\n4;5;6;0;0.25;0\n",
        // As numpy.savetxt writes a header.
        "# dz dy dx z y x\n-1e-3 0 0.5 3 2 1\n0 0.25 0 6 5 4\n",
        "# columns: x y z dx dy dz in m\n1 2 3 0.5 0 -1e-3\n4 5 6 0 0.25 0\n",
        "# of a flap, x and dx\n1 2 3 0.5 0 -1.0D-03 ! first\n% nothing\n4 5 6 0 2.5d-1 0.\n",
    ] {
        assert_eq!(values(&rows(text).unwrap_or_else(|error| panic!("{error}"))), values(&plain), "{text}");
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("d.csv");
    std::fs::write(&path, b"# d\xe9placement\n1,2,3,0.5,0,-1e-3\n4,5,6,0,0.25,0\n").unwrap();
    assert_eq!(values(&displacement::read(&path).unwrap()), values(&plain));
}

#[test]
fn bad_displacement_lines() {
    let error = |text: &str| rows(text).unwrap_err().to_string();
    let expected = "expected six numbers x,y,z,dx,dy,dz";
    assert_eq!(error("x,y,z,dx,dy,dz\n1,2,3,4,5\n"), format!("d.csv:2: 5 columns, {expected}"));
    assert_eq!(error("1,2,3,4,5,6,7\n"), format!("d.csv:1: 7 columns, {expected}"));
    assert_eq!(error("1,2,3,4,5,6\n1,2,3,4,5,six\n"), format!("d.csv:2: \"six\" is not a number, {expected}"));
    assert_eq!(error("1,2,3,nan,5,6\n"), format!("d.csv:1: \"nan\" is not finite, {expected}"));
    assert_eq!(error("1,2,3,4,5,1e999\n"), format!("d.csv:1: \"1e999\" is not finite, {expected}"));
    assert_eq!(error("a,b,c,dx,dy,dz\n"), format!("d.csv:1: no column x among 'a, b, c, dx, dy, dz', {expected}"));
    assert_eq!(error("x,y,z,dx,dy,dz,DX\n"), format!("d.csv:1: the columns 'dx' and 'DX' both are dx, {expected}"));
    let units = "d.csv:1: the columns 'x' in [m] and 'dx' in [mm]";
    assert_eq!(error("x [m],y [m],z [m],dx [mm],dy [mm],dz [mm]\n"), format!("{units}, {expected}"));
    assert_eq!(error("x,y,z,dx,dy,dz,p\n1,2,3,4,5,6\n"), format!("d.csv:2: 6 columns under a header of 7, {expected}"));
    let other_order = error("# dx dy dz x y z in m\n1 2 3 4 5 6\n");
    assert_eq!(other_order, format!("d.csv:2: 6 columns under a header of 8, {expected}"));
    assert_eq!(error("1,2,3,,5,6\n"), format!("d.csv:1: \"\" is not a number, {expected}"));
    let comma = "\"0,5\" is not a number: it has a decimal comma, expected a decimal point";
    assert_eq!(error("0,5;2;3;4;5;6\n"), format!("d.csv:1: {comma}, {expected}"));
    assert_eq!(error("1 2 3 4 5 6\nx y z dx dy dz\n"), format!("d.csv:2: \"x\" is not a number, {expected}"));
    assert_eq!(error("x,y,z,dx,dy,dz\n"), "d.csv: no displacements, expected rows x,y,z,dx,dy,dz");
}

/// A 40 x 40 grid of vertices, the family being every second one, its rows in reverse order and a
/// little off.
#[test]
fn displacements_find_their_vertices() {
    let vertices: Vec<DVec3> = (0..1600).map(|i| DVec3::new((i % 40) as f64, (i / 40) as f64, -3.0) * 1e-3).collect();
    let family: Vec<u32> = (0..1600).step_by(2).collect();
    let mut text = String::new();
    for &vertex in family.iter().rev() {
        let place = vertices[vertex as usize] + DVec3::new(4e-10, -4e-10, 4e-10);
        text += &format!("{},{},{},{vertex},0,0\n", place.x, place.y, place.z);
    }
    let matched = displacement::match_displacements(&rows(&text).unwrap(), &vertices, &family, 1e-9).unwrap();
    let expected: Vec<DVec3> = family.iter().map(|&vertex| DVec3::new(f64::from(vertex), 0.0, 0.0)).collect();
    assert_eq!(matched, expected);
    // A tolerance below the offset finds none.
    assert!(displacement::match_displacements(&rows(&text).unwrap(), &vertices, &family, 1e-10).is_err());
}

#[test]
fn displacements_that_do_not_fit_the_family() {
    let vertices = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let error = |text: &str| {
        displacement::match_displacements(&rows(text).unwrap(), &vertices, &[0, 1, 2], 1e-6).unwrap_err().to_string()
    };
    // Vertex 3 is no vertex of the family.
    assert_eq!(
        error("0,0,0,1,1,1\n0,0,1,1,1,1\n"),
        "d.csv:2: no vertex of the family at (0, 0, 1), the nearest is 1e0 away, expected one within 1e-6"
    );
    assert_eq!(
        error("0,0,0,1,1,1\n1,0,0,1,1,1\n0,1e-7,0,1,1,1\n"),
        "d.csv:3: a second row for the vertex at (0, 0.0000001, 0), the first is on line 1, expected one"
    );
    assert_eq!(
        error("0,0,0,1,1,1\n"),
        "d.csv: 2 of the family's 3 vertices have no row, the first is vertex 1 at (1, 0, 0)"
    );
}

/// What all rows have in common says why none fits: another unit, few digits, or numbers from 1.
#[test]
fn what_all_rows_have_in_common_is_told() {
    let vertices: Vec<DVec3> = (0..8).map(|i| DVec3::new(f64::from(i) / 3.0, f64::from(i % 3) / 7.0, 2.0)).collect();
    let family = [1, 2, 4, 6, 7];
    let error = |text: &str| {
        displacement::match_displacements(&rows(text).unwrap(), &vertices, &family, 1e-5).unwrap_err().to_string()
    };
    let table = |position: &dyn Fn(DVec3) -> String| -> String {
        family.iter().map(|&vertex| format!("{},0,0,1\n", position(vertices[vertex as usize]))).collect()
    };
    let times = |factor: f64| move |at: DVec3| format!("{},{},{}", factor * at.x, factor * at.y, factor * at.z);
    for (factor, back) in [(1e3, "0.001"), (1e-3, "1000"), (1.0 / 0.0254, "0.0254"), (0.3048, "3.280839895013123")] {
        let message = error(&table(&times(factor)));
        let expected = format!("with all coordinates times {back} every row fits: is the file in another unit");
        assert!(message.contains(&expected), "{message}");
    }
    let rounded = error(&table(&|at| format!("{:.3},{:.3},{:.3}", at.x, at.y, at.z)));
    assert!(rounded.contains("of a vertex of its own: are the positions rounded?"), "{rounded}");
    // Any other row has nothing in common, and so have too few rows.
    for text in [table(&times(7.0)), table(&times(1e3)).lines().take(2).collect::<Vec<_>>().join("\n")] {
        let message = error(&text);
        assert!(message.ends_with("expected one within 1e-5"), "{message}");
    }
    let numbered = |more: u32| -> String { family.iter().map(|vertex| format!("{} 0 0 1\n", vertex + more)).collect() };
    assert!(displacement::match_displacements(&rows(&numbered(0)).unwrap(), &vertices, &family, 1e-5).is_ok());
    let from_one = error(&numbered(1));
    assert!(from_one.contains("every number less one is a vertex of the family: does the file number them from 1?"));
    assert!(error(&numbered(2)).ends_with("numbered as in the mesh from 0 to 7"), "{}", error(&numbered(2)));
}

/// A table in the unit of another program is told with the factor to the mesh's unit, whichever two
/// of the usual units they are.
///
/// Fails if a factor of `UNITS` goes.
#[test]
fn the_usual_units_are_told() {
    // The lengths of the units in metres.
    let [metre, dm, cm, mm, micron, inch, foot] = [1.0, 0.1, 0.01, 0.001, 1e-6, 0.0254, 0.3048];
    let vertices = [DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.4, -0.5, 0.7), DVec3::new(-0.8, 1.1, 0.9)];
    let pairs =
        [(metre, dm), (metre, cm), (metre, mm), (metre, micron), (metre, inch), (metre, foot), (cm, mm), (cm, inch)];
    for (one, other) in pairs.into_iter().chain([(mm, inch), (mm, foot), (inch, foot)]) {
        for factor in [one / other, other / one] {
            let row = |at: &DVec3| format!("{:e},{:e},{:e},0,0,1\n", at.x / factor, at.y / factor, at.z / factor);
            let table = rows(&vertices.iter().map(row).collect::<String>()).unwrap();
            let error = displacement::match_displacements(&table, &vertices, &[0, 1, 2], 1e-5).unwrap_err().to_string();
            let told = error.split("with all coordinates times ").nth(1).and_then(|rest| rest.split(' ').next());
            let told: f64 = told.unwrap_or_else(|| panic!("{factor}: {error}")).parse().unwrap();
            assert!((told / factor - 1.0).abs() < 1e-12, "{factor}: {error}");
        }
    }
}

/// The positions of a surface that was moved by less than half its shortest edge may be rounded
/// ones. Those of a surface that was moved farther are not. The tolerance is 1e-3 of that edge.
///
/// Fails if `NEAREST` is 400 or 600.
#[test]
fn positions_are_rounded_by_half_an_edge_at_most() {
    let vertices: Vec<DVec3> = (0..6).map(|i| DVec3::X * f64::from(i)).collect();
    let error = |off: f64| {
        let text: String = vertices.iter().map(|at| format!("{},0,{off},0,0,1\n", at.x)).collect();
        let matched = displacement::match_displacements(&rows(&text).unwrap(), &vertices, &[0, 1, 2, 3, 4, 5], 1e-3);
        matched.unwrap_err().to_string()
    };
    assert!(error(0.45).contains("every row is within 4.5e-1 of a vertex of its own"), "{}", error(0.45));
    assert!(error(0.55).ends_with("expected one within 1e-3"), "{}", error(0.55));
}

#[test]
fn decimal_commas_are_told() {
    let error = |text: &str| rows(text).unwrap_err().to_string();
    let words = ": it has a decimal comma, expected a decimal point";
    let of_rows = error("0;-2;0,5;0;0;0\n");
    assert!(of_rows.contains(&format!("\"0,5\" is not a number{words}")), "{of_rows}");
    assert!(error("3;0,5;1;2\n").contains(words));
    assert!(!error("0;-2;0,5,5;0;0;0\n").contains(words));
}

/// Exact positions match with tolerance zero, also far from the origin.
#[test]
fn displacements_match_exactly() {
    let vertices = [DVec3::splat(1e6), DVec3::new(1e6, 1e6, 1e6 + 1e-9)];
    let text = "1e6,1e6,1000000.000000001,2,0,0\n1e6,1e6,1e6,1,0,0\n";
    let matched = displacement::match_displacements(&rows(text).unwrap(), &vertices, &[0, 1], 0.0).unwrap();
    assert_eq!(matched, [DVec3::X, 2.0 * DVec3::X]);
}

/// SU2's `surface_positions.dat`: the vertex, from 0, and its new position.
#[test]
fn new_positions_go_by_index() {
    let vertices = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE];
    let family = [4, 1, 2];
    let matched = |text: &str| {
        displacement::match_displacements(&rows(text).unwrap(), &vertices, &family, 1e-6).map_err(|e| e.to_string())
    };
    let expected = vec![DVec3::new(0.0, 0.0, 0.5), DVec3::ZERO, DVec3::new(-0.25, 0.0, 2.0)];
    for text in [
        "1\t1.000000000000000e+00\t0.0\t0.0\n2 -0.25 1 2\n4 1 1 1.5\n",
        "# index, new position\n4, 1, 1, 1.5D+00\n1, 1, 0, 0\n2, -2.5d-1, 1, 2\n",
    ] {
        assert_eq!(matched(text), Ok(expected.clone()), "{text}");
    }
    let error = |text: &str| matched(text).unwrap_err();
    // A table that counts from 1, or of another family.
    assert!(
        error("2 1 0 0\n3 -0.25 1 2\n5 1 1 1.5\n").starts_with(
            "d.csv:2: vertex 3 is none of the family, expected the vertices of the family, numbered as in the mesh from 0 to 4"
        )
    );
    assert!(error("99 1 0 0\n").starts_with("d.csv:1: vertex 99 is none of the family"));
    assert_eq!(
        error("1 1 0 0\n1 1 0 0\n"),
        "d.csv:2: a second row for the vertex at (1, 0, 0), the first is on line 1, expected one"
    );
    assert_eq!(
        error("1 1 0 0\n2 0 1 0\n"),
        "d.csv: 1 of the family's 3 vertices have no row, the first is vertex 4 at (1, 1, 1)"
    );
    let bad = |text: &str| rows(text).unwrap_err().to_string();
    let of_new = "in a row of an index and a new position, expected six numbers x,y,z,dx,dy,dz";
    assert_eq!(bad("1.5 1 0 0\n"), format!("d.csv:1: \"1.5\" is no index of a vertex, {of_new}"));
    assert_eq!(bad("-1 1 0 0\n"), format!("d.csv:1: \"-1\" is no index of a vertex, {of_new}"));
    assert_eq!(bad("1 1 nan 0\n"), format!("d.csv:1: \"nan\" is not a finite number, {of_new}"));
    let other = "d.csv:2: 6 columns in a table of an index and a new position with 4 columns";
    assert!(bad("1 1 0 0\n1 2 3 4 5 6\n").starts_with(other));
    // Under a header four numbers are no new position.
    assert!(bad("x,y,z,dx,dy,dz\n1,1,0,0\n").starts_with("d.csv:2: 4 columns"));
}

/// A header says which column is the index, in any order and among others. The index is no
/// coordinate, and the numbers of an extracted surface's own points are no indices.
///
/// Fails if the columns are taken in their order, and if `id` is an index.
#[test]
fn a_header_tells_the_index_from_the_coordinates() {
    let vertices = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let plain = "1 2 0 0\n3 0 0 5\n";
    let matched =
        |text: &str| displacement::match_displacements(&rows(text).unwrap(), &vertices, &[1, 3], 1e-6).unwrap();
    for text in [
        plain,
        "index x y z\n1 2 0 0\n3 0 0 5\n",
        "Vertex,X,Y,Z\n1,2,0,0\n3,0,0,5\n",
        "x,y,z,node,p\n2,0,0,1,9\n0,0,5,3,9\n",
        "\"PointID\",\"x\",\"y\",\"z\",\"Pressure\"\n3,0,0,5,1.5\n1,2,0,0,1.5\n",
        "z [m];y [m];x [m];GlobalIndex\n0;0;2;1\n5;0;0;3\n",
        "# x y z index\n2 0 0 1\n0 0 5 3\n",
        "# index x y z of the moved flap\n1 2 0 0\n3 0 0 5\n",
    ] {
        assert_eq!(matched(text), [DVec3::X, DVec3::new(0.0, 0.0, 4.0)], "{text}");
    }
    let of_rows = rows("index,x,y,z,dx,dy,dz\n7,1,0,0,0,0,0.5\n8,0,0,1,0,0.25,0\n").unwrap();
    let expected = [DVec3::new(0.0, 0.0, 0.5), DVec3::new(0.0, 0.25, 0.0)];
    assert_eq!(displacement::match_displacements(&of_rows, &vertices, &[1, 3], 1e-6).unwrap(), expected);
    let bad = |text: &str| rows(text).unwrap_err().to_string();
    assert!(bad("Point ID,x,y,z\n1,2,0,0\n").contains("no column dx among"), "{}", bad("id,x,y,z\n"));
    assert!(bad("id,x,y,z\n1,2,0,0\n").contains("no column dx among"));
    assert!(bad("index,node,x,y,z\n").contains("the columns 'index' and 'node' both are indices"));
    assert!(bad("index,x,y\n").contains("no column z among"));
    assert!(bad("index,x [m],y [mm],z [m]\n").contains("'x' in [m] and 'y' in [mm]"));
    assert!(bad("index,x,y,z\n1,2,0\n").starts_with("d.csv:2: 3 columns in a table of an index and a new position"));
    assert!(bad("index,x,y,z\n1.5,2,0,0\n").contains("\"1.5\" is no index of a vertex"));
    let counted_from_1 =
        displacement::match_displacements(&rows("index,x,y,z\n2,2,0,0\n4,0,0,5\n").unwrap(), &vertices, &[1, 3], 1e-6);
    assert!(counted_from_1.is_err());
}

/// Displacements beside an index under names of other programs, and names that are not understood.
///
/// Fails if columns that may be displacements go unread while nothing moves.
#[test]
fn displacements_beside_an_index_are_not_lost() {
    let vertices = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let matched = |header: &str, rows_: &str| {
        let table = rows(&format!("{header}\n{rows_}"))?;
        displacement::match_displacements(&table, &vertices, &[1, 3], 1e-6)
    };
    let of_displacements = "1,1,0,0,0,0,0.5\n3,0,0,1,0,0.25,0\n";
    for names in [
        "Displacement_x,Displacement_y,Displacement_z",
        "disp:0,disp:1,disp:2",
        "Displ X,Displ Y,Displ Z",
        "delta_x,delta_y,delta_z",
        "DELTAX,DELTAY,DELTAZ",
        "Mesh_Displacement_x,Mesh_Displacement_y,Mesh_Displacement_z",
    ] {
        let found = matched(&format!("PointID,x,y,z,{names}"), of_displacements).unwrap();
        assert_eq!(found, [DVec3::new(0.0, 0.0, 0.5), DVec3::new(0.0, 0.25, 0.0)], "{names}");
    }
    for names in ["ux,uy,uz", "U:0,U:1,U:2", "u,v,w", "xnew,ynew,znew", "u1,u2,u3"] {
        let of_comment = matched(&format!("# index,x,y,z,{names}"), of_displacements);
        for found in [matched(&format!("index,x,y,z,{names}"), of_displacements), of_comment] {
            let error = found.unwrap_err().to_string();
            let quoted = names.split(',').map(|name| format!("'{name}'")).collect::<Vec<_>>().join(", ");
            assert!(error.contains(&format!("the columns {quoted} may be displacements or new positions")), "{error}");
            assert!(error.contains("call displacements dx,dy,dz"), "{error}");
        }
        // Nothing is lost where the new positions move, or the columns hold nothing.
        let moved = matched(&format!("index,x,y,z,{names}"), "1,1,0,0.5,9,9,9\n3,0,0,1,9,9,9\n").unwrap();
        assert_eq!(moved, [DVec3::new(0.0, 0.0, 0.5), DVec3::ZERO], "{names}");
        assert!(matched(&format!("index,x,y,z,{names}"), "1,1,0,0,0,0,0\n3,0,0,1,0,0,0\n").is_ok(), "{names}");
    }
    // Positions of few digits move by their rounding alone.
    let thirds: Vec<DVec3> = vertices.iter().map(|at| *at / 3.0).collect();
    let rounded = rows("index,x,y,z,ux,uy,uz\n1,0.3333,0,0,0,0,0.5\n3,0,0,0.3333,0,0.25,0\n").unwrap();
    let error = displacement::match_displacements(&rounded, &thirds, &[1, 3], 1e-5).unwrap_err().to_string();
    assert!(error.contains("the columns 'ux', 'uy', 'uz' may be"), "{error}");
    let moved = rows("index,x,y,z,ux,uy,uz\n1,0.3353,0,0,0,0,0.5\n3,0,0,0.3333,0,0.25,0\n").unwrap();
    assert!(displacement::match_displacements(&moved, &thirds, &[1, 3], 1e-5).is_ok());
    // What a flow solver writes beside positions that did not move is no displacement.
    for names in ["Pressure,Temperature,Mach", "nx,ny,nz", "Momentum_x,Momentum_y,Momentum_z"] {
        let found = matched(&format!("PointID,x,y,z,{names}"), "1,1,0,0,9,9,9\n3,0,0,1,9,9,9\n").unwrap();
        assert_eq!(found, [DVec3::ZERO; 2], "{names}");
    }
}
