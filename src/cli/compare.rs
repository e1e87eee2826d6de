//! `idmesh compare` compares the CPU with the GPU on one case, or one mesh file with another.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;

use super::console::Console;
use super::failure::{Exit, Failure};
use super::json::{check_json, text};
use super::{BackendChoice, JsonTarget, choose_backend, json_target, load, page_target, warn_of_file};
use crate::backend::{Backend, BackendInfo};
use crate::case::LoadedCase;
use crate::families::Role;
use crate::formats;
use crate::mesh;
use crate::mover::{Derivative, Design, Gradient, Mover, Outcome};
use crate::profile::Profile;
use crate::report::ComparisonPage;
use crate::session::{Session, SessionError, check_distinct, check_writable, write_texts};
use crate::text::figures::place;

/// Arguments of `idmesh compare`.
#[derive(Debug, clap::Args)]
#[command(long_about = "Compare CPU and GPU on a case, or two meshes vertex by vertex.

With one file, a case: runs it on the CPU and on the GPU and compares the moved vertices; the relative difference is the \
largest distance between the two positions of a vertex divided by the largest displacement on the CPU. Local \
optimisation is left out: it decides by thresholds, which would amplify the rounding that is to be seen here.

With two files, meshes: the relative difference is the largest distance between vertices of the same number divided by \
the diagonal of the first mesh's bounding box.

With --derivatives, a case has the products of CPU and GPU with fixed vectors compared too: the norm of the difference over \
the norm on the CPU, for forward and reverse.

Ends with exit code 1 if a relative difference exceeds the tolerance. A coordinate that is not a number is out of \
tolerance.")]
pub(super) struct Arguments {
    /// A case file, or two mesh files.
    #[arg(required = true, num_args = 1..=2, value_name = "CASE.toml | A B")]
    files: Vec<PathBuf>,
    /// Largest relative difference accepted.
    #[arg(long, value_name = "X", default_value = "1e-5", value_parser = tolerance)]
    tolerance: f64,
    /// Compare derivatives too: of the vertices by the design, forward and reverse.
    #[arg(long)]
    derivatives: bool,
    /// Write a page for browsers: distances by family, and where they are in the mesh.
    #[arg(long, value_name = "FILE.html", value_parser = page_target)]
    report: Option<PathBuf>,
    /// Write the result as JSON; `-` is standard output.
    #[arg(long, value_name = "FILE", value_parser = json_target)]
    json: Option<JsonTarget>,
}

fn tolerance(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value >= 0.0 => Ok(value),
        _ => Err("expected a number from 0 on, such as 1e-5".into()),
    }
}

/// The result of a comparison.
#[derive(Debug, Serialize)]
struct Comparison {
    vertices: usize,
    /// Largest distance between the two positions of a vertex, in the mesh's unit.
    max_difference: f64,
    /// `max_difference` over `reference`.
    relative_difference: f64,
    /// Largest displacement, or the diagonal of the bounding box, in the mesh's unit.
    reference: f64,
    worst_vertex: usize,
    /// Position of the vertex with the largest difference, in the first mesh.
    worst_position: [f64; 3],
    tolerance: f64,
    within_tolerance: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    derivatives: Option<Derivatives>,
    #[serde(skip_serializing_if = "Option::is_none")]
    seconds: Option<Timings>,
}

/// Differences of products on both backends, over the norm on the CPU.
#[derive(Clone, Copy, Debug, Serialize)]
struct Derivatives {
    forward: f64,
    reverse: f64,
    /// By how much forward and reverse are no transposes on either backend, over the norms of the
    /// seed and of the forward product.
    transposed: f64,
}

/// Time of an update on each backend, in s, with all stages and without files.
#[derive(Debug, Serialize)]
struct Timings {
    cpu: f64,
    gpu: f64,
}

impl Comparison {
    /// Compares two sets of positions.
    ///
    /// - `a`, `b` `[n_vertices]`: in the mesh's unit, not empty
    /// - `reference`: the length that differences are relative to, in the mesh's unit
    /// - `tolerance`: the largest relative difference accepted
    fn of(a: &[DVec3], b: &[DVec3], reference: f64, tolerance: f64) -> Self {
        // `total_cmp` ranks NaN above every number, so a vertex without a finite position is the
        // worst one.
        let differences = a.iter().zip(b).map(|(a, b)| a.distance(*b).abs()).enumerate();
        let (worst_vertex, max_difference) = differences.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0));
        let relative_difference = if max_difference == 0.0 { 0.0 } else { max_difference / reference };
        Self {
            vertices: a.len(),
            max_difference,
            relative_difference,
            reference,
            worst_vertex,
            worst_position: a.get(worst_vertex).copied().unwrap_or(DVec3::NAN).to_array(),
            tolerance,
            within_tolerance: relative_difference <= tolerance,
            derivatives: None,
            seconds: None,
        }
    }

    fn text(&self) -> String {
        let mut text = format!(
            "max difference       {:e}\nrelative difference  {:e}\nworst vertex         {} at {}\n",
            self.max_difference,
            self.relative_difference,
            self.worst_vertex,
            place(DVec3::from_array(self.worst_position))
        );
        if let Some(Derivatives { forward, reverse, transposed }) = self.derivatives {
            text += &format!(
                "forward              {forward:e}\nreverse              {reverse:e}\ntransposed           {transposed:e}\n"
            );
        }
        if let Some(Timings { cpu, gpu }) = self.seconds {
            text += &format!("update on the CPU    {cpu:.3} s\nupdate on the GPU    {gpu:.3} s\n");
        }
        text
    }
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    check(arguments, console)?;
    let (comparison, page) = match arguments.files.as_slice() {
        [a, b] => meshes([a, b], arguments, console)?,
        [case, ..] => backends(case, arguments, console)?,
        [] => return Err(Failure::bad_input("nothing to compare")),
    };
    let json = arguments.json.as_ref().map(|_| text(&comparison)).transpose()?;
    let file = match &arguments.json {
        Some(JsonTarget::File(path)) => Some(path.as_path()),
        _ => None,
    };
    let texts = [(file, &json), (arguments.report.as_deref(), &page)];
    // Standard output first: where it is full, no file is written.
    match &json {
        Some(json) if arguments.json == Some(JsonTarget::StandardOutput) => console.json(json)?,
        _ => console.data(&comparison.text())?,
    }
    write_texts(texts.into_iter().filter_map(|(path, text)| path.zip(text.as_deref())))?;
    arguments.report.iter().for_each(|path| console.note(format_args!("wrote {}", path.display())));
    if comparison.within_tolerance {
        return Ok(());
    }
    let of_derivatives = comparison.derivatives.map(|of| [("forward", of.forward), ("reverse", of.reverse)]);
    let worst = [("positions", comparison.relative_difference)].into_iter().chain(of_derivatives.into_iter().flatten());
    let (what, difference) = worst.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).unwrap_or_default();
    Err(Failure::new(
        Exit::Failed,
        format!(
            "out of tolerance: the relative difference of {what} is {difference:e}, expected at most {:e}",
            comparison.tolerance
        ),
    ))
}

/// Checks that the outputs can be written, and that none is an input.
fn check(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    let json = match &arguments.json {
        Some(JsonTarget::File(path)) => Some(path.as_path()),
        _ => None,
    };
    check_outputs(&arguments.files, arguments, json)?;
    if arguments.derivatives && arguments.files.len() > 1 {
        return Err(Failure::bad_input("--derivatives compares those of a case, and two meshes have none"));
    }
    check_json(arguments.json.as_ref(), console)?;
    Ok(arguments.report.as_deref().map_or(Ok(()), check_writable)?)
}

/// Checks that no output is one of these inputs.
fn check_outputs(inputs: &[PathBuf], arguments: &Arguments, json: Option<&Path>) -> Result<(), Failure> {
    Ok(check_distinct(inputs, &json.into_iter().chain(arguments.report.as_deref()).collect::<Vec<_>>())?)
}

/// The comparison of two mesh files, and its page if one is asked for.
fn meshes(
    paths: [&PathBuf; 2],
    arguments: &Arguments,
    console: &Console,
) -> Result<(Comparison, Option<String>), Failure> {
    let [a, b] = paths;
    let mut read = Vec::new();
    for path in paths {
        console.step(&format!("reading {}", path.display()));
        let file = formats::read_mixed(path)?;
        warn_of_file(path, &file, console);
        mesh::check_size(file.mesh.vertices.iter().copied())
            .map_err(|error| Failure::bad_input(error.to_string()).in_file(path))?;
        read.push(file);
    }
    let [first, second] = [0, 1].map(|file: usize| read[file].mesh.vertices.as_slice());
    if first.len() != second.len() {
        let message = format!(
            "{} has {} vertices and {} has {}: there is nothing to compare vertex by vertex",
            a.display(),
            first.len(),
            b.display(),
            second.len()
        );
        return Err(Failure::new(Exit::Failed, message));
    }
    let corner = first.first().copied().unwrap_or_default();
    let (low, high) = first.iter().fold((corner, corner), |(low, high), &at| (low.min(at), high.max(at)));
    let comparison = Comparison::of(first, second, low.distance(high), arguments.tolerance);
    let names = paths.map(|path| path.file_name().unwrap_or_default().to_string_lossy().into_owned());
    let page = ComparisonPage {
        name: format!("{} and {}", a.display(), b.display()),
        names,
        mesh: read[0].cells(),
        positions: [first, second],
        outcomes: None,
        bodies: Vec::new(),
        reference: (comparison.reference, "the diagonal of the first mesh's bounding box"),
        relative: comparison.relative_difference,
        tolerance: arguments.tolerance,
        settings: vec![("first mesh", a.display().to_string()), ("second mesh", b.display().to_string())],
    };
    let page = arguments.report.as_deref().map(|path| html(page, path)).transpose()?;
    Ok((comparison, page))
}

/// The text of a page that is to be a file.
fn html(page: ComparisonPage, path: &Path) -> Result<String, Failure> {
    page.html().map_err(|error| Failure::bad_input(format!("cannot make the page: {error}")).in_file(path))
}

/// The comparison of the backends on a case, and its page if one is asked for.
fn backends(case: &Path, arguments: &Arguments, console: &Console) -> Result<(Comparison, Option<String>), Failure> {
    let mut case = load(case, console)?;
    check_outputs(
        &case.inputs,
        arguments,
        match &arguments.json {
            Some(JsonTarget::File(path)) => Some(path),
            _ => None,
        },
    )?;
    if case.case.settings.quality.take().is_some() {
        console.note("local optimisation is left out of the comparison");
    }
    // The GPU runs first, because without a GPU there is no reason to wait for the CPU.
    let derivatives = arguments.derivatives;
    let (on_gpu, gpu_seconds, gpu_info, gpu_products) = update(&case, BackendChoice::Gpu, derivatives, console)?;
    if on_gpu.device_work.is_some_and(|work| work.dispatches == 0) {
        console
            .note("the GPU had nothing to do: small networks are relaxed on the CPU (IDMESH_GPU_VERTICES sets which)");
    }
    let (on_cpu, cpu_seconds, cpu_info, cpu_products) = update(&case, BackendChoice::Cpu, derivatives, console)?;
    let (cpu, gpu) = (on_cpu.even_if_invalid(), on_gpu.even_if_invalid());
    let largest = cpu.displacement().iter().map(|displacement| displacement.length()).max_by(f64::total_cmp);
    let mut comparison = Comparison::of(cpu.vertices(), gpu.vertices(), largest.unwrap_or(0.0), arguments.tolerance);
    comparison.derivatives = cpu_products.zip(gpu_products).map(|(cpu, gpu)| Derivatives::of(&cpu, &gpu));
    let differences = comparison.derivatives.map(|of| [of.forward, of.reverse]);
    // NaN is out of tolerance.
    comparison.within_tolerance &= differences.into_iter().flatten().all(|of| of <= arguments.tolerance);
    let roles = case.file.mesh.families.iter().zip(case.roles());
    let is_body =
        |role: &Role| matches!(role, Role::Wing | Role::TrailingEdge | Role::Wingtip { .. } | Role::Prescribed);
    let device = |info: &BackendInfo, seconds: f64| format!("{}, {}: {seconds:.3} s", info.adapter, info.driver);
    let page = ComparisonPage {
        name: case.case.path.display().to_string(),
        names: ["CPU", "GPU"].map(str::to_owned),
        mesh: case.file.cells(),
        positions: [cpu.vertices(), gpu.vertices()],
        outcomes: Some([&on_cpu, &on_gpu]),
        bodies: roles.filter(|(_, role)| is_body(role)).map(|(name, _)| name.as_str()).collect(),
        reference: (comparison.reference, "the largest displacement"),
        relative: comparison.relative_difference,
        tolerance: arguments.tolerance,
        settings: vec![
            ("CPU", device(&cpu_info, cpu_seconds)),
            ("GPU", device(&gpu_info, gpu_seconds)),
            ("local optimisation", "off, as in every comparison".to_owned()),
        ],
    };
    let page = arguments.report.as_deref().map(|path| html(page, path)).transpose()?;
    Ok((Comparison { seconds: Some(Timings { cpu: cpu_seconds, gpu: gpu_seconds }), ..comparison }, page))
}

/// Products of an outcome with fixed vectors.
struct ProductPair {
    /// Change of each vertex `[n_vertices]`.
    forward: Vec<DVec3>,
    /// Derivative by each number of the design, in one list.
    reverse: Vec<DVec3>,
    /// By how much one is not the transpose of the other, over the norms of the seed and `forward`.
    transposed: f64,
}

impl Derivatives {
    fn of(cpu: &ProductPair, gpu: &ProductPair) -> Self {
        let apart = |a: &[DVec3], b: &[DVec3]| {
            let difference: Vec<DVec3> = a.iter().zip(b).map(|(a, b)| *a - *b).collect();
            if difference.iter().all(|by| *by == DVec3::ZERO) { 0.0 } else { norm(&difference) / norm(a) }
        };
        Self {
            forward: apart(&cpu.forward, &gpu.forward),
            reverse: apart(&cpu.reverse, &gpu.reverse),
            transposed: cpu.transposed.max(gpu.transposed),
        }
    }
}

fn norm(vectors: &[DVec3]) -> f64 {
    vectors.iter().map(|vector| vector.length_squared()).sum::<f64>().sqrt()
}

/// Numbers between -1 and 1 without a pattern that a mesh has.
fn fixed(n: usize) -> Vec<DVec3> {
    let number = |k: usize| (12.9898 * (k + 1) as f64).sin();
    (0..n).map(|row| DVec3::new(number(3 * row), number(3 * row + 1), number(3 * row + 2))).collect()
}

/// The products of an outcome with fixed vectors.
fn products(mover: &mut Mover, design: &Design, outcome: &Outcome) -> Result<ProductPair, SessionError> {
    let seed = fixed(outcome.even_if_invalid().vertices().len());
    let Gradient { profiles, prescribed, .. } = mover.reverse(outcome, &seed, Derivative::Exact)?;
    let mut direction = Design::default();
    let mut reverse = Vec::new();
    for (wing, of_wing) in profiles {
        for (own, by_points) in design.profiles.get(&wing).into_iter().flatten().zip(of_wing) {
            let along = Profile { number: own.number, points: fixed(by_points.len()) };
            direction.profiles.entry(wing.clone()).or_default().push(along);
            reverse.extend(by_points);
        }
    }
    for (family, by_vertices) in prescribed {
        direction.prescribed.insert(family, fixed(by_vertices.len()));
        reverse.extend(by_vertices);
    }
    let along = direction.profiles.values().flatten().flat_map(|profile| &profile.points);
    let along: Vec<DVec3> = along.chain(direction.prescribed.values().flatten()).copied().collect();
    let forward = mover.forward(outcome, &direction, Derivative::Exact)?;
    let dot = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
    let difference = (dot(&seed, &forward) - dot(&along, &reverse)).abs();
    let transposed = if difference == 0.0 { 0.0 } else { difference / (norm(&seed) * norm(&forward)) };
    Ok(ProductPair { forward, reverse, transposed })
}

/// An outcome, the time of the update in s, the backend, and the products if they are wanted.
type Updated = (Outcome, f64, BackendInfo, Option<ProductPair>);

fn update(case: &LoadedCase, choice: BackendChoice, derivatives: bool, console: &Console) -> Result<Updated, Failure> {
    let backend: Arc<dyn Backend> = choose_backend(choice, console)?.into();
    let info = backend.info();
    let (kind, tell) = (info.kind.to_owned(), console.progress());
    let mut session = Session::new(case, backend, move |stage| tell(&format!("{kind}: {stage}")))?;
    let (outcome, seconds) = session.update(&case.design)?;
    console.detail(format_args!("{} ({}): {seconds:.3} s", info.kind, info.adapter));
    if !outcome.converged {
        console.warn(format_args!("the {} did not converge within max_sweeps", info.kind));
    }
    let products = derivatives.then(|| products(session.mover(), &case.design, &outcome)).transpose()?;
    Ok((outcome, seconds, info, products))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_vertex_is_found() {
        let a = vec![DVec3::ZERO; 30];
        let mut b = a.clone();
        assert!(Comparison::of(&a, &b, 1.0, 0.0).within_tolerance);
        b[17].z = 1e-4;
        let found = Comparison::of(&a, &b, 2.0, 1e-5);
        assert_eq!((found.worst_vertex, found.max_difference, found.relative_difference), (17, 1e-4, 5e-5));
        assert!(!found.within_tolerance);
        assert!(Comparison::of(&a, &b, 2.0, 1e-4).within_tolerance);
    }

    /// NaN compares false with everything. A comparison with NaN must fail all the same.
    #[test]
    fn nan_is_out_of_tolerance() {
        let a = vec![DVec3::ZERO; 3];
        for sign in [1.0, -1.0] {
            let b = vec![DVec3::ZERO, DVec3::new(0.0, sign * f64::NAN, 0.0), DVec3::splat(1e300)];
            let found = Comparison::of(&a, &b, 1.0, f64::MAX);
            assert_eq!(found.worst_vertex, 1);
            assert!(!found.within_tolerance);
        }
    }

    /// A design that moves nothing on the CPU allows no motion on the GPU.
    #[test]
    fn nothing_to_divide_by() {
        let a = vec![DVec3::ZERO; 2];
        assert!(Comparison::of(&a, &a, 0.0, 1e-5).within_tolerance);
        assert!(!Comparison::of(&a, &[DVec3::ZERO, DVec3::X], 0.0, 1e-5).within_tolerance);
    }
}
