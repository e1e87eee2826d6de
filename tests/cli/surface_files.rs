//! The files of moved surfaces (`.vtp`, `.stl`, `.glb`) and of sections (`.svg`): read back by
//! small parsers of their own and compared with the moved mesh.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use glam::{DQuat, DVec3};
use idmesh::formats::{MeshFile, read_mixed};
use serde_json::Value;

use crate::fixture::*;

const ALL: &str = "surface = [\"moved.vtp\", \"moved.stl\", \"moved.glb\"]\nsections = \"sections.svg\"\n";

/// The corners of a face.
type Face = Vec<DVec3>;

/// The faces of each family of a mesh at some places, sorted.
fn faces(mesh: &MeshFile, at: &[DVec3]) -> BTreeMap<String, Vec<Face>> {
    let cells = mesh.cells();
    let mut faces: BTreeMap<String, Vec<Face>> = BTreeMap::new();
    for face in 0..cells.n_faces() as u32 {
        let family = &mesh.mesh.families[cells.family_of(face).unwrap().index()];
        let corners = cells.face_vertices(face).iter().map(|&vertex| at[vertex as usize]).collect();
        faces.entry(family.clone()).or_default().push(corners);
    }
    faces.values_mut().for_each(|faces| sort(faces));
    faces
}

fn sort(faces: &mut [Face]) {
    let key = |face: &Face| face.iter().flat_map(|at| at.to_array()).collect::<Vec<f64>>();
    faces.sort_by(|a, b| key(a).iter().map(|x| x.to_bits()).cmp(key(b).iter().map(|x| x.to_bits())));
}

/// A `.vtp` file with raw appended arrays, as this test needs it.
struct PolyData {
    text: String,
    bytes: Vec<u8>,
    /// Where the arrays begin.
    start: usize,
}

impl PolyData {
    fn read(path: &Path) -> Self {
        let bytes = fs::read(path).unwrap();
        let mark = b"<AppendedData encoding=\"raw\">\n_";
        let start = bytes.windows(mark.len()).position(|window| window == mark).unwrap() + mark.len();
        let text = String::from_utf8(bytes[..start].to_vec()).unwrap();
        assert!(text.contains("type=\"PolyData\"") && text.contains("header_type=\"UInt64\""), "{text}");
        Self { text, bytes, start }
    }

    /// The entries of an array, by its name.
    fn array<const N: usize>(&self, name: &str, kind: &str) -> Vec<[u8; N]> {
        let tag = format!("<DataArray type=\"{kind}\" Name=\"{name}\" ");
        let (_, rest) = self.text.split_once(&tag).unwrap_or_else(|| panic!("{tag} is not in {}", self.text));
        let offset = rest.split_once("offset=\"").unwrap().1.split_once('"').unwrap().0;
        let at = self.start + offset.parse::<usize>().unwrap();
        let length = u64::from_le_bytes(self.bytes[at..at + 8].try_into().unwrap()) as usize;
        let (entries, rest) = self.bytes[at + 8..at + 8 + length].as_chunks::<N>();
        assert!(rest.is_empty());
        entries.to_vec()
    }

    fn integers(&self, name: &str) -> Vec<usize> {
        self.array::<8>(name, "Int64").into_iter().map(|bytes| i64::from_le_bytes(bytes) as usize).collect()
    }

    fn vectors(&self, name: &str) -> Vec<DVec3> {
        let numbers: Vec<f64> = self.array::<8>(name, "Float64").into_iter().map(f64::from_le_bytes).collect();
        numbers.as_chunks::<3>().0.iter().map(|&vector| DVec3::from(vector)).collect()
    }

    /// The names of the families: letters as numbers, a zero after each name.
    fn names(&self) -> Vec<String> {
        let field = self.text.split_once("Name=\"families\"").unwrap().1.split_once('>').unwrap().1;
        let codes = field.split_once('<').unwrap().0.split(' ').map(|code| code.parse::<u8>().unwrap());
        let codes: Vec<u8> = codes.collect();
        let names = codes.strip_suffix(&[0]).unwrap().split(|&code| code == 0);
        names.map(|name| String::from_utf8(name.to_vec()).unwrap()).collect()
    }

    /// The polygons of each family, sorted.
    fn faces(&self) -> BTreeMap<String, Vec<Face>> {
        let (points, corners, names) = (self.vectors("Points"), self.integers("connectivity"), self.names());
        let mut faces: BTreeMap<String, Vec<Face>> = BTreeMap::new();
        let mut start = 0;
        let of_family = self.array::<4>("family", "Int32").into_iter().map(i32::from_le_bytes);
        for (end, family) in self.integers("offsets").into_iter().zip(of_family) {
            let face = corners[start..end].iter().map(|&corner| points[corner]).collect();
            faces.entry(names[family as usize - 1].clone()).or_default().push(face);
            start = end;
        }
        assert_eq!(start, corners.len());
        faces.values_mut().for_each(|faces| sort(faces));
        faces
    }
}

/// The triangles of each solid of an STL file, sorted.
fn solids(text: &str) -> BTreeMap<String, Vec<Face>> {
    let mut solids: BTreeMap<String, Vec<Face>> = BTreeMap::new();
    let mut name = String::new();
    let mut open: Face = Vec::new();
    for line in text.lines() {
        let words: Vec<&str> = line.split(' ').collect();
        match words[..] {
            ["solid", solid] => name = solid.to_owned(),
            ["endsolid", solid] => assert_eq!(name, solid),
            ["facet", "normal", ..] => {
                let normal =
                    DVec3::from_slice(&words[2..].iter().map(|word| word.parse().unwrap()).collect::<Vec<f64>>());
                assert!((normal.length() - 1.0).abs() < 1e-9, "{line}");
            }
            ["vertex", x, y, z] => open.push(DVec3::from([x, y, z].map(|word| word.parse::<f64>().unwrap()))),
            ["endfacet"] => {
                assert_eq!(open.len(), 3);
                solids.entry(name.clone()).or_default().push(std::mem::take(&mut open));
            }
            _ => assert!(["outer loop", "endloop"].contains(&line), "{line}"),
        }
    }
    solids.values_mut().for_each(|faces| sort(faces));
    solids
}

/// Checks that a JSON object has these keys and no others.
#[track_caller]
fn keys(object: &Value, needed: &[&str], allowed: &[&str]) {
    let found: Vec<&str> = object.as_object().unwrap().keys().map(String::as_str).collect();
    assert!(needed.iter().all(|key| found.contains(key)), "{needed:?} in {object}");
    assert!(found.iter().all(|key| needed.contains(key) || allowed.contains(key)), "{found:?}");
}

/// A glTF 2.0 file, read as strictly as the specification asks of a client.
struct Gltf {
    json: Value,
    binary: Vec<u8>,
}

impl Gltf {
    fn read(path: &Path) -> Self {
        let bytes = fs::read(path).unwrap();
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
        let of_json = word(12);
        assert_eq!((&bytes[16..20], of_json % 4), (&b"JSON"[..], 0));
        let json: Value = serde_json::from_slice(&bytes[20..20 + of_json]).unwrap();
        let at = 20 + of_json;
        assert_eq!((&bytes[at + 4..at + 8], word(at) % 4, at + 8 + word(at)), (&b"BIN\0"[..], 0, bytes.len()));
        let binary = bytes[at + 8..].to_vec();
        let gltf = Self { json, binary };
        gltf.check();
        gltf
    }

    fn list(&self, key: &str) -> &[Value] {
        self.json[key].as_array().unwrap()
    }

    fn check(&self) {
        let known = ["meshes", "materials", "accessors", "bufferViews", "buffers", "animations"];
        keys(&self.json, &["asset", "scene", "scenes", "nodes"], &known);
        assert_eq!(self.json["asset"]["version"], "2.0");
        let [buffer] = self.list("buffers") else { panic!("several buffers") };
        let length = buffer["byteLength"].as_u64().unwrap() as usize;
        assert!(length <= self.binary.len() && self.binary.len() < length + 4);
        for view in self.list("bufferViews") {
            keys(view, &["buffer", "byteOffset", "byteLength"], &["target"]);
            let (from, of_view) = (view["byteOffset"].as_u64().unwrap(), view["byteLength"].as_u64().unwrap());
            assert!(from % 4 == 0 && of_view > 0 && (from + of_view) as usize <= length, "{view}");
        }
        for accessor in self.list("accessors") {
            keys(accessor, &["bufferView", "componentType", "count", "type"], &["min", "max"]);
            let components = if accessor["type"] == "VEC3" { 3 } else { 1 };
            let view = &self.list("bufferViews")[accessor["bufferView"].as_u64().unwrap() as usize];
            assert_eq!(4 * components * accessor["count"].as_u64().unwrap(), view["byteLength"].as_u64().unwrap());
        }
        // Each node has at most one parent.
        let children = self.list("nodes").iter().flat_map(|node| node["children"].as_array().into_iter().flatten());
        let mut children: Vec<u64> = children.map(|child| child.as_u64().unwrap()).collect();
        let n_children = children.len();
        children.dedup();
        assert_eq!(children.len(), n_children);
    }

    fn bytes(&self, accessor: &Value) -> (&Value, &[[u8; 4]]) {
        let accessor = &self.list("accessors")[accessor.as_u64().unwrap() as usize];
        let view = &self.list("bufferViews")[accessor["bufferView"].as_u64().unwrap() as usize];
        let from = view["byteOffset"].as_u64().unwrap() as usize;
        let length = view["byteLength"].as_u64().unwrap() as usize;
        (accessor, self.binary[from..from + length].as_chunks::<4>().0)
    }

    fn floats(&self, accessor: &Value) -> Vec<f32> {
        let (accessor, bytes) = self.bytes(accessor);
        assert_eq!(accessor["componentType"], 5126);
        bytes.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect()
    }

    /// Vectors, whose bounds are those that the file gives, to the bit.
    fn vectors(&self, accessor: &Value) -> Vec<DVec3> {
        let (described, _) = self.bytes(accessor);
        assert_eq!(described["type"], "VEC3");
        let vectors: Vec<DVec3> =
            self.floats(accessor).as_chunks::<3>().0.iter().map(|&at| DVec3::from(at.map(f64::from))).collect();
        for (key, of) in [("min", DVec3::min as fn(DVec3, DVec3) -> DVec3), ("max", DVec3::max)] {
            let found = vectors.iter().copied().reduce(of).unwrap();
            // The bounds are numbers in single precision.
            let told: Vec<f32> =
                described[key].as_array().unwrap().iter().map(|x| x.as_f64().unwrap() as f32).collect();
            assert_eq!(found.as_vec3().to_array()[..], told, "{key}");
        }
        vectors
    }

    /// The triangles of each family at a share of the motion, in the mesh's coordinates.
    fn faces(&self, share: f64) -> BTreeMap<String, Vec<Face>> {
        let root = &self.list("nodes")[self.json["scenes"][0]["nodes"][0].as_u64().unwrap() as usize];
        let numbers = |key: &str| -> Vec<f64> {
            root[key].as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
        };
        let (turn, shift) = (DQuat::from_slice(&numbers("rotation")), DVec3::from_slice(&numbers("translation")));
        // What is up in an aircraft's coordinates is up in glTF's.
        assert!((turn * DVec3::Z - DVec3::Y).length() < 1e-12 && (turn.length() - 1.0).abs() < 1e-12);
        let place = |at: DVec3| {
            let at = turn * at + shift;
            DVec3::new(at.x, -at.z, at.y)
        };
        let mut faces = BTreeMap::new();
        for child in root["children"].as_array().unwrap() {
            let node = &self.list("nodes")[child.as_u64().unwrap() as usize];
            let mesh = &self.list("meshes")[node["mesh"].as_u64().unwrap() as usize];
            keys(mesh, &["name", "primitives"], &["weights", "extras"]);
            let [primitive] = mesh["primitives"].as_array().unwrap().as_slice() else { panic!("{mesh}") };
            keys(primitive, &["attributes", "indices", "material"], &["targets"]);
            assert!((primitive["material"].as_u64().unwrap() as usize) < self.list("materials").len());
            let old = self.vectors(&primitive["attributes"]["POSITION"]);
            let ways = match &primitive["targets"] {
                Value::Null => vec![DVec3::ZERO; old.len()],
                targets => {
                    assert_eq!(mesh["weights"], serde_json::json!([1.0]));
                    self.vectors(&targets[0]["POSITION"])
                }
            };
            assert_eq!(ways.len(), old.len());
            let (described, bytes) = self.bytes(&primitive["indices"]);
            assert_eq!((&described["componentType"], &described["type"]), (&5125.into(), &"SCALAR".into()));
            let corners: Vec<usize> = bytes.iter().map(|&bytes| u32::from_le_bytes(bytes) as usize).collect();
            let at: Vec<DVec3> = corners.iter().map(|&corner| place(old[corner] + share * ways[corner])).collect();
            let triangles = at.as_chunks::<3>().0.iter().map(|triangle| triangle.to_vec()).collect();
            assert_eq!(node["name"], mesh["name"]);
            assert!(faces.insert(node["name"].as_str().unwrap().to_owned(), triangles).is_none());
        }
        faces
    }
}

/// Fails if a file has other places than the mesh, another family for a face, or a face too few.
#[test]
fn the_surfaces_are_those_of_the_moved_mesh() {
    let fixture = Fixture::new();
    fixture.case("mesh = \"moved.msh\"\n", &format!("mesh = \"moved.msh\"\n{ALL}"));
    let output = fixture.run();
    assert_good(&output);
    for name in ["moved.vtp", "moved.stl", "moved.glb", "sections.svg"] {
        assert!(stderr(&output).contains(&format!("wrote {name}\n")), "{}", stderr(&output));
    }
    let [old, moved] = ["box.msh", "moved.msh"].map(|name| read_mixed(&fixture.path(name)).unwrap());
    let expected = faces(&moved, &moved.mesh.vertices);
    assert_eq!(expected.len(), 5);

    let poly_data = PolyData::read(&fixture.path("moved.vtp"));
    assert_eq!(poly_data.faces(), expected);
    let vertices = poly_data.integers("vertex");
    for ((vertex, at), way) in vertices.iter().zip(poly_data.vectors("Points")).zip(poly_data.vectors("displacement")) {
        assert_eq!(at, moved.mesh.vertices[*vertex]);
        assert!((way - (at - old.mesh.vertices[*vertex])).length() < 1e-12, "{vertex}");
    }
    assert!(poly_data.text.contains(&format!("NumberOfPoints=\"{}\"", vertices.len())));

    assert_eq!(solids(&fixture.read("moved.stl")), expected);

    // In single precision, in the order of the mesh.
    let gltf = Gltf::read(&fixture.path("moved.glb"));
    for (mesh, share) in [(&old, 0.0), (&moved, 1.0)] {
        let found = gltf.faces(share);
        assert!(found.keys().eq(expected.keys()), "{found:?}");
        for (family, faces) in found {
            let index = mesh.mesh.families.iter().position(|name| *name == family).unwrap();
            let of_family = mesh.mesh.triangles.iter().zip(&mesh.mesh.triangle_family);
            let of_family: Vec<&[u32; 3]> =
                of_family.filter(|(_, own)| own.index() == index).map(|(triangle, _)| triangle).collect();
            assert_eq!(faces.len(), of_family.len());
            let corners = of_family.into_iter().flatten().map(|&vertex| mesh.mesh.vertices[vertex as usize]);
            let furthest = faces.iter().flatten().zip(corners).map(|(at, expected)| at.distance(expected));
            let furthest = furthest.fold(0.0, f64::max);
            assert!(furthest < 1e-5, "{family}: {furthest}");
        }
    }
    // From the old mesh to the new one and back, for every family.
    let [animation] = gltf.list("animations") else { panic!("no animation") };
    let sampler = &animation["samplers"][0];
    assert_eq!(gltf.floats(&sampler["output"]), [0.0, 1.0, 0.0]);
    let times = gltf.floats(&sampler["input"]);
    let described = &gltf.list("accessors")[sampler["input"].as_u64().unwrap() as usize];
    assert_eq!(
        (&described["min"][0], &described["max"][0]),
        (&f64::from(times[0]).into(), &f64::from(times[2]).into())
    );
    assert_eq!(animation["channels"].as_array().unwrap().len(), 5);

    let sections = fixture.read("sections.svg");
    assert_eq!(sections.matches("<polyline").count(), 6);
    assert!(sections.contains("wing, profile 1: got is up to ") && sections.contains("Sections, old, asked and got<"));
}

/// Quadrilaterals stay in `.vtp` and are divided elsewhere; `convert` writes surfaces too.
///
/// Fails if a quadrilateral is left out, or if an unmoved mesh has a displacement.
#[test]
fn quadrilaterals_stay_where_they_can() {
    let fixture = Fixture::new();
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/hybrid/small.msh.gz");
    let mesh = read_mixed(&source).unwrap();
    for name in ["a.vtp", "a.STL", "a.glb"] {
        let output = fixture.idmesh(&["convert", source.to_str().unwrap(), name]);
        assert_good(&output);
        assert!(stderr(&output).contains("the surfaces alone"), "{}", stderr(&output));
    }
    let expected = faces(&mesh, &mesh.mesh.vertices);
    assert!(expected.values().flatten().any(|face| face.len() == 4));
    let poly_data = PolyData::read(&fixture.path("a.vtp"));
    assert_eq!(poly_data.faces(), expected);
    assert!(!poly_data.text.contains("displacement"));
    let area = |faces: &[Face]| -> f64 {
        let of = |[a, b, c]: [DVec3; 3]| 0.5 * (b - a).cross(c - a).length();
        faces
            .iter()
            .map(|face| {
                of([face[0], face[1], face[2]]) + if face.len() == 4 { of([face[0], face[2], face[3]]) } else { 0.0 }
            })
            .sum()
    };
    let gltf = Gltf::read(&fixture.path("a.glb"));
    assert!(gltf.json["animations"].is_null());
    for found in [solids(&fixture.read("a.STL")), gltf.faces(1.0)] {
        for (family, faces) in &found {
            let count: usize = expected[family].iter().map(|face| face.len() - 2).sum();
            assert_eq!(faces.len(), count, "{family}");
            // The two ways to divide a warped quadrilateral differ a little.
            let (found, expected) = (area(faces), area(&expected[family]));
            assert!((found - expected).abs() < 1e-3 * expected, "{family}: {found} {expected}");
        }
        assert_eq!(found.len(), expected.len());
    }
    fixture.refuses_command(&["convert", "box.msh", "box.msh"], 3, &["box.msh"]);
    fixture.refuses_command(&["convert", "box.msh", "nowhere/a.glb"], 3, &["nowhere"]);
}

/// A surface that may not be used has no good name, and a good one of an earlier run goes.
///
/// Fails if the surfaces of an invalid mesh look like those of a valid one.
#[test]
fn an_invalid_surface_has_no_good_name() {
    let fixture = Fixture::new();
    fixture.case("mesh = \"moved.msh\"\n", &format!("mesh = \"moved.msh\"\n{ALL}"));
    assert_good(&fixture.run());
    fixture.write("new.csv", &profiles(&[(0, 0.3, 3.0), (1, 1.2, 3.0)]));
    assert_eq!(fixture.run().status.code(), Some(5));
    for extension in ["vtp", "stl", "glb"] {
        assert!(!fixture.path(&format!("moved.{extension}")).exists(), "{extension}");
        assert!(fixture.path(&format!("moved.invalid.{extension}")).is_file(), "{extension}");
    }
    assert!(fixture.read("sections.svg").contains("of a mesh that is not valid"));
    // A case that cannot be run takes all of them away.
    let good = fixture.read("case.toml");
    fixture.write("case.toml", &good.replace("role = \"wing\"", "role = \"wimg\""));
    assert_eq!(fixture.run().status.code(), Some(3));
    assert_eq!(fixture.files(), ["box.msh", "case.toml", "new.csv"]);
}

/// Each design of a batch has its own, beside its histogram.
#[test]
fn designs_have_surfaces_and_sections() {
    let fixture = Fixture::with_designs(2);
    fixture.case("mesh = \"moved.msh\"\n", &format!("mesh = \"moved.msh\"\nhistogram = \"beta.svg\"\n{ALL}"));
    let batch = ["batch", "case.toml", "--backend", "cpu", "--designs", "designs", "--out", "moved"];
    assert_good(&fixture.idmesh(&batch));
    let all = ["0.glb", "0.msh", "0.sections.svg", "0.stl", "0.svg", "0.vtp"];
    for name in all.iter().flat_map(|name| [(*name).to_owned(), name.replacen('0', "1", 1)]) {
        assert!(fixture.path("moved").join(&name).is_file(), "{name}");
    }
}

/// Names are checked before anything is computed.
#[test]
fn names_of_surfaces_are_checked() {
    let fixture = Fixture::new();
    for (key, words) in [
        ("surface = \"moved.obj\"", "expected a name ending in .vtp, .stl or .glb"),
        ("surface = [\"a.vtp\", \"a.vtp\"]", "is listed twice"),
        ("surface = 3", "surface"),
        ("sections = \"sections.png\"", "expected a name ending in .svg"),
        ("surface = \"nowhere/a.vtp\"", "nowhere"),
        ("sections = \"a.svg\"\nhistogram = \"a.svg\"", "a.svg"),
    ] {
        fixture.case("mesh = \"moved.msh\"\n", &format!("mesh = \"moved.msh\"\n{key}\n"));
        fixture.refuses(3, &[words]);
    }
}
