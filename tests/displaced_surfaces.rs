//! Displacements as other programs write them: displaced surface meshes, and tables.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use glam::DVec3;
use idmesh::case::{Case, LoadedCase};
use idmesh::formats;
use idmesh::mesh::TetMesh;

/// The displacement of the golden files, see `make_surfaces.py`.
fn displacement(at: DVec3) -> DVec3 {
    DVec3::new(0.02 * at.z, 0.01 * at.x * at.y, 0.05 * at.y - 0.03 * at.x * at.x)
}

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn small() -> TetMesh {
    formats::read(&data("small.msh.gz")).unwrap().mesh
}

/// The vertices of a family of a mesh, ascending, and its triangles.
fn family(mesh: &TetMesh, name: &str) -> (Vec<u32>, Vec<[u32; 3]>) {
    let triangles = mesh.triangles_of(&[mesh.family(name).unwrap()]);
    let vertices: BTreeSet<u32> = triangles.iter().flatten().copied().collect();
    (vertices.into_iter().collect(), triangles)
}

/// Loads a case in which a family is prescribed by a file, and others are fixed.
fn load(mesh: &Path, of: &TetMesh, name: &str, file: &Path) -> Result<LoadedCase, String> {
    let folder = tempfile::tempdir().unwrap();
    let mut case = format!("mesh = {:?}\n[output]\nmesh = \"moved.vtu\"\n", mesh.to_str().unwrap());
    for family in &of.families {
        let role = if family == name {
            format!("role = \"prescribed\"\ndisplacement = {:?}", file.to_str().unwrap())
        } else {
            "role = \"fixed\"".into()
        };
        case += &format!("[family.\"{family}\"]\n{role}\n");
    }
    let path = folder.path().join("case.toml");
    fs::write(&path, case).unwrap();
    Case::load(&path).map_err(|error| error.to_string())
}

/// The displacement of the wingtip of the small mesh by a golden file.
fn of_golden(name: &str) -> Result<Vec<DVec3>, String> {
    let file = data("surfaces").join(name);
    let case = load(&data("small.msh.gz"), &small(), "wingtip", &file)?;
    Ok(case.design.prescribed["wingtip"].clone())
}

/// Each file gives every vertex the displacement in closed form, to the digits of the file.
#[test]
fn surfaces_and_tables_of_other_programs() {
    let mesh = small();
    let (vertices, _) = family(&mesh, "wingtip");
    let (double, single, digits) = (1e-14, 1e-6, 1e-5);
    for (name, exact) in [
        ("vtk.ascii.vtp", double),
        ("vtk.inline.vtp", double),
        ("vtk.raw.big.vtp", double),
        ("vtk.raw.zlib.vtp", double),
        ("vtk.base64.lz4.vtp", double),
        ("vtk.ascii.stl", digits),
        ("vtk.binary.stl", single),
        ("pyvista.at-rest.vtp", double),
        ("pyvista.warped.vtp", double),
        ("pyvista.original.vtp", double),
        ("pyvista.original.vtu", double),
        ("pyvista.apart.vtp", single),
        ("pyvista.apart.bare.vtp", single),
        ("pyvista.threshold.vtp", double),
        ("meshio.vtu", double),
        ("meshio.ascii.vtu", 1e-10),
        ("meshio.at-rest.vtu", double),
        ("meshio.ascii.stl", double),
        ("meshio.binary.stl", single),
        ("meshio.msh", double),
        ("meshio.v22.msh", double),
        ("gmsh.v41.ascii.msh", 1e-13),
        ("gmsh.v41.binary.msh", double),
        ("gmsh.v22.binary.msh", double),
        ("gmsh.binary.stl", single),
        ("pandas.index.csv", double),
        ("pandas.semicolon.csv", double),
        ("pandas.tab.tsv", double),
        ("pandas.blank.dat", double),
        ("numpy.dat", double),
        ("numpy.units.txt", double),
        ("vtk.csv", digits),
    ] {
        let found = of_golden(name).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(found.len(), vertices.len());
        for (&vertex, found) in vertices.iter().zip(found) {
            let expected = displacement(mesh.vertices[vertex as usize]);
            let off = found.distance(expected);
            assert!(off <= exact, "{name}: vertex {vertex} moves by {found} and not {expected}, off by {off:e}");
        }
    }
    let error = of_golden("vtk.shuffled.vtp").unwrap_err();
    assert!(error.contains("neither the points of the surface nor its triangles stand in the order"), "{error}");
    let names: BTreeSet<String> =
        fs::read_dir(data("surfaces")).unwrap().map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
    assert_eq!(names.len(), 33, "{names:?}");
}

/// Every golden file, packed with gzip, gives the same.
#[test]
fn packed_surfaces_are_read() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["vtk.raw.zlib.vtp", "vtk.binary.stl", "meshio.msh"] {
        let bytes = fs::read(data("surfaces").join(name)).unwrap();
        let path = folder.path().join(format!("{name}.gz"));
        let mut packed = flate2::write::GzEncoder::new(fs::File::create(&path).unwrap(), flate2::Compression::fast());
        std::io::Write::write_all(&mut packed, &bytes).unwrap();
        packed.finish().unwrap();
        let case = load(&data("small.msh.gz"), &small(), "wingtip", &path).unwrap();
        assert_eq!(case.design.prescribed["wingtip"], of_golden(name).unwrap(), "{name}");
    }
}

/// A surface as VTP text.
#[derive(Clone)]
struct Surface {
    points: Vec<DVec3>,
    polygons: Vec<Vec<u32>>,
    vectors: Vec<(&'static str, Vec<DVec3>)>,
    scalars: Vec<(&'static str, Vec<f64>)>,
    single: bool,
    strips: usize,
}

impl Surface {
    /// The wingtip of the small mesh, displaced.
    fn wingtip(mesh: &TetMesh) -> Self {
        Self::of(mesh, "wingtip", displacement)
    }

    fn of(mesh: &TetMesh, name: &str, displacement: impl Fn(DVec3) -> DVec3) -> Self {
        let (vertices, triangles) = family(mesh, name);
        let number = |vertex: u32| vertices.binary_search(&vertex).unwrap() as u32;
        let points = vertices.iter().map(|&vertex| mesh.vertices[vertex as usize]);
        Self {
            points: points.map(|at| at + displacement(at)).collect(),
            polygons: triangles.iter().map(|corners| corners.map(number).to_vec()).collect(),
            vectors: Vec::new(),
            scalars: Vec::new(),
            single: false,
            strips: 0,
        }
    }

    /// The same points in the order of `first`.
    fn reordered(&self, first: &[usize]) -> Self {
        let mut place = vec![0; first.len()];
        first.iter().enumerate().for_each(|(new, &old)| place[old] = new as u32);
        let polygons = self.polygons.iter().map(|polygon| polygon.iter().map(|&at| place[at as usize]).collect());
        Self {
            points: first.iter().map(|&old| self.points[old]).collect(),
            polygons: polygons.collect(),
            ..self.clone()
        }
    }

    fn write(&self, path: &Path) {
        let kind = if self.single { "Float32" } else { "Float64" };
        let array = |name: &str, values: &[DVec3]| {
            let number = |value: f64| if self.single { f64::from(value as f32) } else { value };
            let values: String =
                values.iter().map(|at| format!("{:e} {:e} {:e}\n", number(at.x), number(at.y), number(at.z))).collect();
            format!(
                "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"3\" format=\"ascii\">\n{values}</DataArray>\n"
            )
        };
        let numbers = |name: &str, values: &mut dyn Iterator<Item = usize>| {
            let values: String = values.map(|value| format!("{value} ")).collect();
            format!("<DataArray type=\"Int64\" Name=\"{name}\" format=\"ascii\">{values}</DataArray>\n")
        };
        let ends = self.polygons.iter().scan(0, |end, polygon| {
            *end += polygon.len();
            Some(*end)
        });
        let scalars = self.scalars.iter().map(|(name, values)| {
            let values: String = values.iter().map(|value| format!("{value:e} ")).collect();
            format!("<DataArray type=\"Float64\" Name=\"{name}\" format=\"ascii\">{values}</DataArray>\n")
        });
        let fields: String = self.vectors.iter().map(|(name, values)| array(name, values)).chain(scalars).collect();
        let corners = numbers("connectivity", &mut self.polygons.iter().flatten().map(|&at| at as usize));
        let text = format!(
            "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\"><PolyData>\n\
             <Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"{}\" NumberOfPolys=\"{}\">\n\
             <PointData>{fields}</PointData><Points>{}</Points><Polys>{corners}{}</Polys>\n</Piece></PolyData></VTKFile>\n",
            self.points.len(),
            self.strips,
            self.polygons.len(),
            array("Points", &self.points),
            numbers("offsets", &mut ends.into_iter()),
        );
        fs::write(path, text).unwrap();
    }

    /// The displacement of a family by this surface.
    fn gives(&self, mesh_path: &Path, mesh: &TetMesh, family: &str) -> Result<Vec<DVec3>, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("d.vtp");
        self.write(&path);
        let shown = |error: String| error.replace(&folder.path().display().to_string(), "");
        load(mesh_path, mesh, family, &path).map(|case| case.design.prescribed[family].clone()).map_err(shown)
    }

    fn of_wingtip(&self, mesh: &TetMesh) -> Result<Vec<DVec3>, String> {
        self.gives(&data("small.msh.gz"), mesh, "wingtip")
    }
}

/// What does not prove which point is which vertex is refused.
#[test]
fn surfaces_that_do_not_fit_are_refused() {
    let mesh = small();
    let good = Surface::wingtip(&mesh);
    assert!(good.of_wingtip(&mesh).is_ok());
    let refused = |change: &dyn Fn(&mut Surface), words: &[&str]| {
        let mut surface = good.clone();
        change(&mut surface);
        let error = surface.of_wingtip(&mesh).unwrap_err();
        assert!(words.iter().all(|word| error.contains(word)) && error.contains("d.vtp"), "{error}");
    };
    // Points alone, and other polygons.
    refused(&|surface| surface.polygons.clear(), &["no triangles"]);
    refused(&|surface| surface.polygons[3].push(9), &["1 polygons that are no triangles"]);
    refused(&|surface| surface.strips = 2, &["2 triangle strips"]);
    // A triangle less, a triangle twice, and a flipped edge.
    refused(&|surface| drop(surface.polygons.pop()), &["32 points at 38 triangles", "`wingtip` has 32 at 39"]);
    refused(&|surface| surface.polygons[5] = surface.polygons[6].clone(), &["its triangles join others"]);
    let flip = |surface: &mut Surface| {
        let [a, b, c] = surface.polygons[0][..] else { panic!() };
        let other = (1..surface.polygons.len()).find_map(|index| {
            let polygon = &surface.polygons[index];
            let has = |at: u32| polygon.contains(&at);
            (has(a) && has(b)).then(|| (index, *polygon.iter().find(|&&at| at != a && at != b).unwrap()))
        });
        let Some((index, d)) = other else {
            surface.polygons.rotate_left(1);
            return;
        };
        (surface.polygons[0], surface.polygons[index]) = (vec![a, d, c], vec![d, b, c]);
    };
    let mut flipped = good.clone();
    while flipped.polygons.iter().collect::<BTreeSet<_>>() == good.polygons.iter().collect() {
        flip(&mut flipped);
    }
    let error = flipped.of_wingtip(&mesh).unwrap_err();
    // The tip is a strip, so the flipped one is its mirror image, in another order.
    assert!(error.contains("stand in the order of the family"), "{error}");
    // Another unit of length.
    refused(&|surface| surface.points.iter_mut().for_each(|at| *at *= 1e3), &["e3 times as large"]);
    refused(&|surface| surface.points.iter_mut().for_each(|at| *at *= 0.39), &["times as large"]);
    // A name that nothing is known of, and points that stay where they are.
    let at_rest = Surface::of(&mesh, "wingtip", |_| DVec3::ZERO);
    let moves: Vec<DVec3> = at_rest.points.iter().map(|&at| displacement(at)).collect();
    let of = |name| Surface { vectors: vec![(name, moves.clone())], ..at_rest.clone() }.of_wingtip(&mesh);
    assert!(of("U").unwrap_err().contains("the array `U`"));
    assert_eq!(of("displacement"), Ok(moves.clone()));
    assert_eq!(of("Normals"), Ok(vec![DVec3::ZERO; moves.len()]));
    // The same as three arrays of one component each.
    let three = |names: [&'static str; 3]| {
        let scalars = [0, 1, 2].map(|axis| (names[axis], moves.iter().map(|by| by[axis]).collect()));
        Surface { scalars: scalars.to_vec(), ..at_rest.clone() }.of_wingtip(&mesh)
    };
    assert!(three(["ux", "uy", "uz"]).unwrap_err().contains("the arrays `ux`, `uy`, `uz` at the points may be"));
    assert_eq!(three(["Displ_x", "Displ_y", "Displ_z"]), Ok(moves.clone()));
    // Of a moved surface other arrays may be left.
    let moved = Surface { vectors: vec![("U", moves.clone())], ..good.clone() };
    assert!(moved.of_wingtip(&mesh).is_ok());
    // Arrays that contradict the points or each other.
    let half: Vec<DVec3> = moves.iter().map(|by| 0.5 * by).collect();
    let with = |vectors: &[(&'static str, &[DVec3])]| {
        let vectors = vectors.iter().map(|&(name, values)| (name, values.to_vec())).collect();
        Surface { vectors, ..good.clone() }.of_wingtip(&mesh)
    };
    assert!(with(&[("displacement", &half)]).unwrap_err().contains("no vertex of the family"));
    let before = &at_rest.points[..];
    assert!(with(&[("original", before), ("displacement", &half)]).unwrap_err().contains("neither at its original"));
    assert_eq!(with(&[("original", before), ("displacement", &moves)]), Ok(moves.clone()));
    assert!(with(&[("displacement", &moves), ("Displacements", &moves)]).unwrap_err().contains("both are dx"));
    let nan = [&moves[1..], &[DVec3::NAN]].concat();
    assert!(
        with(&[("displacement", &nan)]).unwrap_err().contains("point 31: the array `displacement:0` is not finite")
    );
    // The points of another family.
    let wing = Surface::of(&mesh, "trailing_edge", |_| DVec3::ZERO);
    assert!(wing.of_wingtip(&mesh).unwrap_err().contains("at 90 triangles, the family `wingtip` has 32 at 39"));
}

/// What single precision does not tell apart has not moved.
#[test]
fn single_precision_moves_nothing_by_its_rounding() {
    let mesh = small();
    let lift = |at: DVec3| if at.x > 2.0 { DVec3::new(0.0, 0.25, 0.0) } else { DVec3::ZERO };
    let surface = Surface { single: true, ..Surface::of(&mesh, "wingtip", lift) };
    let found = surface.of_wingtip(&mesh).unwrap();
    let (vertices, _) = family(&mesh, "wingtip");
    for (&vertex, found) in vertices.iter().zip(found) {
        let at = mesh.vertices[vertex as usize];
        let expected = lift(at);
        assert!(found.distance(expected) < 1e-6);
        assert!(expected != DVec3::ZERO || found == DVec3::ZERO, "vertex {vertex} moves by {found}");
        assert!((found.x, found.z) == (0.0, 0.0), "vertex {vertex} moves by {found}");
    }
}

/// A block of `n` x `m` cubes of six tets, with its bottom in one family and its top, `n` x `m`
/// squares cut in the same direction, in another.
fn block(n: usize, m: usize) -> TetMesh {
    let at = |i: usize, j: usize, k: usize| ((k * (m + 1) + j) * (n + 1) + i) as u32;
    let mut mesh = TetMesh { families: vec!["top".into(), "bottom".into(), "sides".into()], ..TetMesh::default() };
    for (k, j, i) in (0..2).flat_map(|k| (0..=m).flat_map(move |j| (0..=n).map(move |i| (k, j, i)))) {
        mesh.vertices.push(DVec3::new(i as f64, j as f64, k as f64));
    }
    for (i, j) in (0..n).flat_map(|i| (0..m).map(move |j| (i, j))) {
        let corner = |bits: usize| at(i + (bits & 1), j + (bits >> 1 & 1), bits >> 2);
        for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
            mesh.tets.push([0, a, b, 7].map(corner));
        }
        let mut face = |corners: [usize; 3], family: u16| {
            mesh.triangles.push(corners.map(corner));
            mesh.triangle_family.push(idmesh::mesh::FamilyId(family));
        };
        face([4, 5, 7], 0);
        face([4, 7, 6], 0);
        face([0, 3, 1], 1);
        face([0, 2, 3], 1);
        for (is_side, corners) in [
            (i == 0, [[0, 4, 6], [0, 6, 2]]),
            (i + 1 == n, [[1, 3, 7], [1, 7, 5]]),
            (j == 0, [[0, 1, 5], [0, 5, 4]]),
            (j + 1 == m, [[2, 6, 7], [2, 7, 3]]),
        ] {
            corners.into_iter().filter(|_| is_side).for_each(|corners| face(corners, 2));
        }
    }
    mesh
}

/// A regular surface fits in several ways: half a turn takes its triangles to its triangles.
#[test]
fn regular_surfaces_need_their_order() {
    let mesh = block(4, 3);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("block.vtu");
    formats::MeshFile::from_mesh(mesh.clone()).write(&path, &mesh.vertices, &formats::Fields::default()).unwrap();
    let lift = |at: DVec3| DVec3::new(0.0, 0.0, 0.1 + 0.02 * at.x * at.y);
    let surface = Surface::of(&mesh, "top", lift);
    let n = surface.points.len();
    let expected: Vec<DVec3> = surface.points.iter().map(|at| lift(DVec3::new(at.x, at.y, 1.0))).collect();
    let gives = |surface: &Surface| surface.gives(&path, &mesh, "top");
    let close = |found: Vec<DVec3>| found.iter().zip(&expected).all(|(a, b)| a.distance(*b) < 1e-14);
    // In order, and with the triangles in order.
    assert!(close(gives(&surface).unwrap()));
    let others_first: Vec<usize> = (7..n).chain(0..7).collect();
    assert!(close(gives(&surface.reordered(&others_first)).unwrap()));
    // Points and triangles in orders that contradict each other, or in none: the points of the
    // other half stand first, and the triangles too.
    let backwards: Vec<usize> = (0..n).rev().collect();
    let error = gives(&surface.reordered(&backwards)).unwrap_err();
    assert!(error.contains("fits the family in two ways"), "{error}");
    let mut disordered = surface.reordered(&backwards);
    disordered.polygons.reverse();
    let error = gives(&disordered).unwrap_err();
    assert!(error.contains("fits the family in two ways") && error.contains("`original`"), "{error}");
    // The order of the points is half a turn: the least motion is another way.
    let turned = Surface { points: surface.reordered(&backwards).points, ..surface.clone() };
    let error = gives(&turned).unwrap_err();
    assert!(error.contains("fits the family in two ways"), "{error}");
    // The bottom has the same triangles, and its points are nearer.
    let bottom = Surface::of(&mesh, "bottom", lift);
    let error = gives(&bottom).unwrap_err();
    assert!(error.contains("the family `top`") && error.contains("the family `bottom`, which is nearer"), "{error}");
    // With the original positions every order is understood.
    let mut original = disordered.clone();
    original.vectors = vec![("original", disordered.points.iter().map(|at| DVec3::new(at.x, at.y, 1.0)).collect())];
    assert!(close(gives(&original).unwrap()));
    // A displacement that moves the family onto itself: either way may be meant.
    let half_turn: Vec<DVec3> =
        surface.points.iter().map(|at| DVec3::new(2.0 * at.x - 4.0, 2.0 * at.y - 3.0, 0.0)).collect();
    let at_rest = Surface { vectors: vec![("displacement", half_turn)], ..Surface::of(&mesh, "top", |_| DVec3::ZERO) };
    let error = gives(&at_rest).unwrap_err();
    assert!(error.contains("moved already by the array `displacement`"), "{error}");
}

/// Far from the origin single precision is coarser than the tolerance of a match.
#[test]
fn single_precision_is_matched_to_its_rounding() {
    let mut mesh = block(3, 2);
    mesh.vertices.iter_mut().for_each(|at| *at += DVec3::splat(1e5 + 1.0 / 3.0));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("block.vtu");
    formats::MeshFile::from_mesh(mesh.clone()).write(&path, &mesh.vertices, &formats::Fields::default()).unwrap();
    let lift = |at: DVec3| DVec3::new(0.0, 0.0, 0.125 * (at.x - 1e5).floor());
    let at_rest = Surface::of(&mesh, "top", |_| DVec3::ZERO);
    assert!(at_rest.points.iter().any(|at| (f64::from(at.x as f32) - at.x).abs() > 2e-3), "finer than the tolerance");
    let moves: Vec<DVec3> = at_rest.points.iter().map(|&at| lift(at)).collect();
    let surface = Surface { vectors: vec![("displacement", moves.clone())], single: true, ..at_rest };
    assert_eq!(surface.gives(&path, &mesh, "top"), Ok(moves));
}

/// Fails if the mark that editors put before a text is a letter of STL.
#[test]
fn a_byte_order_mark_before_an_stl_text_is_passed_over() {
    let plain = fs::read(data("surfaces").join("meshio.ascii.stl")).unwrap();
    let marked = ["\u{feff}".as_bytes(), &plain].concat();
    let [plain, marked] = [plain, marked].map(|text| formats::surface_of(Path::new("a.stl"), &text).unwrap());
    assert_eq!(plain, marked);
}

/// Broken STL files, at their places.
#[test]
fn broken_stl_files() {
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    let error = |text: &str| formats::surface_of(Path::new("s.stl"), text.as_bytes()).unwrap_err().to_string();
    let good = format!("solid a b\n{facet}endsolid a b\nSOLID\n\n{}ENDSOLID\n", facet.to_uppercase());
    let surface = formats::surface_of(Path::new("s.stl"), good.as_bytes()).unwrap();
    assert_eq!((surface.points.len(), surface.triangles), (3, vec![[0, 1, 2], [0, 1, 2]]));
    // The sum of -0 and 0 is 0: both are one coordinate.
    let beside = facet.replace("vertex 0 0 0", "vertex -0 0 -0").replace("vertex 0 1 0", "vertex 0 -1 0");
    let two = format!("solid\n{facet}{beside}endsolid\n");
    assert_eq!(formats::surface_of(Path::new("s.stl"), two.as_bytes()).unwrap().points.len(), 4);
    assert!(error(&format!("solid\n{facet}")).starts_with("s.stl:8: the file ends where 'endsolid'"));
    assert!(error(&format!("solid\n{}", facet.replace("vertex 1 0 0", "vertex 1 0"))).starts_with("s.stl:5: "));
    assert!(
        error(&format!("solid\n{}", facet.replace("vertex 1 0 0", "vertex 1 0 nan")))
            .starts_with("s.stl:5: vertex 1 has")
    );
    assert!(
        error(&format!("solid\n{}", facet.replace("vertex 1 0 0\n", ""))).starts_with("s.stl:7: expected a vertex")
    );
    assert!(
        error(&format!("solid\n{}", facet.replace("endloop", "vertex 1 1 1")))
            .starts_with("s.stl:7: expected 'endfacet'")
    );
    assert!(error(&format!("solid\n{facet}x\n")).starts_with("s.stl:9: expected 'facet' or 'endsolid'"));
    assert!(error(&format!("solid\n{facet}endsolid\nx")).starts_with("s.stl:10: expected 'solid'"));
    assert!(error("facet").contains("expected 'solid', or 0 triangles"));
    assert!(error("").contains("empty"));
    // A binary file that is cut short or goes on.
    let bytes = fs::read(data("surfaces/vtk.binary.stl")).unwrap();
    let of = |bytes: &[u8]| formats::surface_of(Path::new("s.stl"), bytes).map_err(|error| error.to_string());
    assert_eq!(of(&bytes).unwrap().triangles.len(), 39);
    for bytes in [&bytes[..bytes.len() - 1], &[&bytes[..], b"x"].concat(), &bytes[..84]] {
        assert!(of(bytes).unwrap_err().contains("39 triangles of 50 bytes after 84 bytes"));
    }
    let mut infinite = bytes.clone();
    infinite[84 + 50 + 12..][..4].copy_from_slice(&f32::INFINITY.to_le_bytes());
    assert!(of(&infinite).unwrap_err().starts_with("s.stl: byte 134: vertex 3"), "{}", of(&infinite).unwrap_err());
    // A binary file may begin like a text.
    let mut solid = bytes.clone();
    solid[..5].copy_from_slice(b"solid");
    assert_eq!(of(&solid), of(&bytes));
}

/// Formats that idmesh does not read as surfaces, and files without a surface.
#[test]
fn other_formats_are_refused() {
    let error = |name: &str, text: &str| formats::surface_of(Path::new(name), text.as_bytes()).unwrap_err().to_string();
    for name in ["s.vtk", "s.ply", "s.OBJ"] {
        assert!(error(name, "x").contains("save it as .vtp, .vtu, .stl or .msh"));
    }
    let data = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n0\n$EndElements\n$NodeData\n$EndNodeData\n";
    assert!(error("s.msh", data).contains("$NodeData"));
    assert!(formats::is_surface(Path::new("a.b.STL.gz")) && !formats::is_surface(Path::new("a.csv")));
    assert!(!formats::is_surface(Path::new("stl")) && !formats::is_surface(Path::new("a.su2")));
}

/// Where families meet, a surface has the rounding of its file, and a table beside it is exact: the
/// common vertices go where the table says. More than the rounding is an error.
#[test]
fn the_rounding_of_a_surface_is_no_conflict() {
    let mesh = small();
    let (wing, _) = family(&mesh, "wing");
    let (tip, _) = family(&mesh, "wingtip");
    let shared: Vec<usize> = (0..tip.len()).filter(|&place| wing.contains(&tip[place])).collect();
    assert!(!shared.is_empty() && shared.len() < tip.len());
    let folder = tempfile::tempdir().unwrap();
    let loaded = |by: DVec3, surface: &Surface| {
        let row = |vertex: &u32| {
            let at = mesh.vertices[*vertex as usize];
            format!("{:e},{:e},{:e},{:e},{:e},{:e}\n", at.x, at.y, at.z, by.x, by.y, by.z)
        };
        fs::write(folder.path().join("wing.csv"), wing.iter().map(row).collect::<String>()).unwrap();
        surface.write(&folder.path().join("tip.vtp"));
        let mut case = format!("mesh = {:?}\n[output]\nmesh = \"moved.vtu\"\n", data("small.msh.gz").to_str().unwrap());
        for family in &mesh.families {
            case += &match family.as_str() {
                "wing" => "[family.wing]\nrole = \"prescribed\"\ndisplacement = \"wing.csv\"\n".to_owned(),
                "wingtip" => "[family.wingtip]\nrole = \"prescribed\"\ndisplacement = \"tip.vtp\"\n".to_owned(),
                other => format!("[family.\"{other}\"]\nrole = \"fixed\"\n"),
            };
        }
        let path = folder.path().join("case.toml");
        fs::write(&path, case).unwrap();
        Case::load(&path).map(|case| case.design.prescribed.clone()).map_err(|error| error.to_string())
    };
    let twelve = |at: DVec3| DVec3::from_array(at.to_array().map(|value| format!("{value:.11e}").parse().unwrap()));
    for (by, single) in [(DVec3::ZERO, false), (DVec3::Z * 0.01, true)] {
        let mut surface = Surface { single, ..Surface::of(&mesh, "wingtip", |_| by) };
        if !single {
            surface.points.iter_mut().for_each(|at| *at = twelve(*at));
        }
        let prescribed = loaded(by, &surface).unwrap();
        assert!(shared.iter().all(|&place| prescribed["wingtip"][place] == by), "{single}");
        assert!(prescribed["wing"].iter().all(|&moved| moved == by), "{single}");
        // Within single precision, and more than the rounding.
        let off = if single { 1e-4 } else { 1e-9 };
        surface.points[shared[0]].x += off;
        let error = loaded(by, &surface).unwrap_err();
        assert!(error.contains("displacements differ by"), "{error}");
    }
}
