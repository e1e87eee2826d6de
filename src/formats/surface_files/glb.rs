//! glTF 2.0 in one binary file (`.glb`): a node and a mesh for each family, with its name. The
//! original positions are the mesh, and the displacement is a morph target, which is fully on; an
//! animation leads from the original mesh to the moved one and back.
//!
//! Positions are in single precision from the middle of the surfaces, to which the root node moves
//! them. The root also turns z, an aircraft's way up, into y, which is up in glTF.
//!
//! Source: The Khronos Group, *glTF 2.0 Specification*, revision 2.0.1.

use std::io::{self, Write};

use glam::DVec3;
use serde_json::{Value, json};

use super::{SurfaceFile, Used};
use crate::formats::out::Out;

/// `FLOAT` and `UNSIGNED_INT` of an accessor.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;

/// `ARRAY_BUFFER` and `ELEMENT_ARRAY_BUFFER` of a view.
const OF_VERTICES: u32 = 34962;
const OF_ELEMENTS: u32 = 34963;

/// The colours of the families in turn, linear (red, green, blue).
const COLOURS: [[f64; 3]; 6] = [
    [0.25, 0.45, 0.75],
    [0.80, 0.45, 0.15],
    [0.30, 0.60, 0.40],
    [0.70, 0.40, 0.60],
    [0.55, 0.55, 0.55],
    [0.75, 0.70, 0.25],
];

/// The times of the animation in seconds, and the share of the motion at each.
const TIMES: [(f32, f32); 3] = [(0.0, 0.0), (2.0, 1.0), (4.0, 0.0)];

/// The binary part in the making, with the parts of the JSON that describe it.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    /// Adds numbers of four bytes each. Returns the number of their accessor.
    fn add(
        &mut self,
        numbers: impl Iterator<Item = [u8; 4]>,
        target: Option<u32>,
        (kind, component, count): (&str, u32, usize),
        ends: Option<[Value; 2]>,
    ) -> usize {
        let from = self.bytes.len();
        self.bytes.extend(numbers.flatten());
        let mut view = json!({ "buffer": 0, "byteOffset": from, "byteLength": self.bytes.len() - from });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        let mut accessor =
            json!({ "bufferView": self.views.len(), "componentType": component, "count": count, "type": kind });
        if let Some([low, high]) = ends {
            accessor["min"] = low;
            accessor["max"] = high;
        }
        self.views.push(view);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds vectors in single precision.
    fn vectors(&mut self, vectors: &[DVec3]) -> io::Result<usize> {
        let vectors: Vec<[f32; 3]> = vectors.iter().map(|vector| vector.as_vec3().to_array()).collect();
        if vectors.iter().flatten().any(|number| !number.is_finite()) {
            return Err(io::Error::other("a position is too large for single precision"));
        }
        let ends = [f32::min, f32::max].map(|of| {
            let end = vectors.iter().copied().reduce(|a, b| std::array::from_fn(|axis| of(a[axis], b[axis])));
            json!(end.unwrap_or_default())
        });
        let bytes = vectors.iter().flatten().map(|number| number.to_le_bytes());
        Ok(self.add(bytes, Some(OF_VERTICES), ("VEC3", FLOAT, vectors.len()), Some(ends)))
    }
}

/// Writes the surfaces.
pub(super) fn create(out: &mut Out, surface: &SurfaceFile) -> io::Result<()> {
    let families = surface.families();
    let undeformed = surface.mesh.vertices();
    let all = || families.iter().flat_map(|(_, _, faces)| faces.iter().copied().flatten());
    let first = all().next().map_or(DVec3::ZERO, |&vertex| undeformed[vertex as usize]);
    let (low, high) = all().fold((first, first), |(low, high), &vertex| {
        let at = undeformed[vertex as usize];
        (low.min(at), high.max(at))
    });
    let centre = 0.5 * (low + high);
    let mut buffer = Buffer::default();
    let (mut meshes, mut nodes, mut materials) = (Vec::new(), Vec::new(), Vec::new());
    for (family, name, faces) in &families {
        let used = Used::new(faces.iter().copied(), undeformed.len());
        let places: Vec<DVec3> = used.pick(undeformed).iter().map(|at| *at - centre).collect();
        let position = buffer.vectors(&places)?;
        let triangles = surface.triangles(faces);
        let corners = triangles.iter().flatten().map(|&vertex| used.number(vertex).to_le_bytes());
        let kind = ("SCALAR", UNSIGNED_INT, 3 * triangles.len());
        let indices = buffer.add(corners, Some(OF_ELEMENTS), kind, None);
        let mut primitive =
            json!({ "attributes": { "POSITION": position }, "indices": indices, "material": materials.len() });
        let mut mesh = json!({ "name": name });
        if let Some(displacement) = surface.displacement {
            primitive["targets"] = json!([{ "POSITION": buffer.vectors(&used.pick(displacement))? }]);
            mesh["weights"] = json!([1.0]);
            mesh["extras"] = json!({ "targetNames": ["displacement"] });
        }
        mesh["primitives"] = json!([primitive]);
        nodes.push(json!({ "name": name, "mesh": meshes.len() }));
        meshes.push(mesh);
        let [r, g, b] = COLOURS[family.index() % COLOURS.len()];
        materials.push(json!({
            "name": name,
            "doubleSided": true,
            "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.6 },
        }));
    }
    // (x, y, z) becomes (x, z, -y).
    let mut root = json!({
        "name": "idmesh",
        "rotation": [-std::f64::consts::FRAC_1_SQRT_2, 0.0, 0.0, std::f64::consts::FRAC_1_SQRT_2],
        "translation": [centre.x, centre.z, -centre.y],
    });
    let animations = surface.displacement.map(|_| animation(&mut buffer, nodes.len()));
    let n_families = nodes.len();
    if n_families > 0 {
        root["children"] = json!((0..n_families).collect::<Vec<_>>());
    }
    nodes.push(root);
    let mut document = json!({
        "asset": { "version": "2.0", "generator": format!("idmesh {}", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "nodes": [n_families] }],
        "nodes": nodes,
    });
    if n_families > 0 {
        document["meshes"] = json!(meshes);
        document["materials"] = json!(materials);
        document["accessors"] = json!(buffer.accessors);
        document["bufferViews"] = json!(buffer.views);
        document["buffers"] = json!([{ "byteLength": buffer.bytes.len() }]);
        if let Some(animation) = animations {
            document["animations"] = json!([animation]);
        }
    }
    write(out, &document, buffer.bytes)
}

/// The animation of the motion there and back, of the first nodes.
fn animation(buffer: &mut Buffer, n_nodes: usize) -> Value {
    let [start, end] = [TIMES[0].0, TIMES[TIMES.len() - 1].0];
    let times = TIMES.iter().map(|(time, _)| time.to_le_bytes());
    let input = buffer.add(times, None, ("SCALAR", FLOAT, TIMES.len()), Some([json!([start]), json!([end])]));
    let shares = TIMES.iter().map(|(_, share)| share.to_le_bytes());
    let output = buffer.add(shares, None, ("SCALAR", FLOAT, TIMES.len()), None);
    let channel = |node: usize| json!({ "sampler": 0, "target": { "node": node, "path": "weights" } });
    json!({
        "name": "motion",
        "samplers": [{ "input": input, "output": output, "interpolation": "LINEAR" }],
        "channels": (0..n_nodes).map(channel).collect::<Vec<_>>(),
    })
}

/// Writes the header and the two chunks, each filled up to four bytes.
fn write(out: &mut Out, document: &Value, mut binary: Vec<u8>) -> io::Result<()> {
    let mut text = serde_json::to_vec(document)?;
    text.resize(text.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let of_binary = if binary.is_empty() { 0 } else { 8 + binary.len() };
    let length = u32::try_from(12 + 8 + text.len() + of_binary);
    let length =
        length.map_err(|_| io::Error::other("the surfaces are too large for a .glb file, which holds 4 GB"))?;
    out.write_all(b"glTF")?;
    out.write_all(&2u32.to_le_bytes())?;
    out.write_all(&length.to_le_bytes())?;
    let chunks = [(b"JSON", &text), (b"BIN\0", &binary)];
    for (kind, bytes) in chunks.into_iter().filter(|(_, bytes)| !bytes.is_empty()) {
        out.write_all(&(bytes.len() as u32).to_le_bytes())?;
        out.write_all(kind)?;
        out.write_all(bytes)?;
    }
    Ok(())
}
