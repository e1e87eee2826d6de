//! Torsional stiffness of edges on a GPU.

use std::ops::Range;

use bytemuck::bytes_of;
use wgpu::{BufferUsages, ComputePassDescriptor};

use super::device::Device;
use crate::backend::packed::PackedEdges;
use crate::backend::{BackendError, EdgeStiffness};
use crate::kernels::edge_stiffness::Params;

/// Torsional stiffness of each edge, without unit. A mesh larger than one binding is computed in
/// chunks of edges, each with the tets around its edges.
pub(super) fn stiffness(device: &Device, input: &EdgeStiffness) -> Result<Vec<f64>, BackendError> {
    device.rows_fit(&input.edge_tets.row_start, 1, "edge")?;
    let packed = PackedEdges::<f32>::new(input);
    let whole = 0..input.edge_vector.len();
    let mut stiffness = Vec::with_capacity(whole.len());
    if bytes(input.edge_tets.entries.len(), input.tet_edges.len(), whole.len(), whole.len()) <= device.max_chunk {
        let mesh = Chunk {
            edge_start: &input.edge_tets.row_start,
            edge_tets: &input.edge_tets.entries,
            tet_edges: input.tet_edges,
            edge_vector: &packed.edge_vector,
            n_edges: whole.len(),
        };
        stiffness.extend(compute(device, &mesh)?);
    } else {
        let mut numbering = Numbering::new(input);
        for range in plan(device, input)? {
            let (edge_start, edge_tets, tet_edges, edge_vector) = numbering.extract(input, &packed, range.clone());
            let chunk = Chunk {
                edge_start: &edge_start,
                edge_tets: &edge_tets,
                tet_edges: &tet_edges,
                edge_vector: &edge_vector,
                n_edges: range.len(),
            };
            stiffness.extend(compute(device, &chunk)?);
        }
    }
    Ok(stiffness.into_iter().map(f64::from).collect())
}

/// Some edges, the tets around them, and the edges of these tets. The chunk's own edges come first.
struct Chunk<'a> {
    edge_start: &'a [u32],
    edge_tets: &'a [u32],
    tet_edges: &'a [[u32; 6]],
    edge_vector: &'a [[f32; 4]],
    n_edges: usize,
}

fn compute(device: &Device, chunk: &Chunk) -> Result<Vec<f32>, BackendError> {
    if chunk.n_edges == 0 {
        return Ok(Vec::new());
    }
    device.guarded(|| {
        let params = Params { n_edges: chunk.n_edges as u32 };
        let size = 4 * chunk.n_edges as u64;
        let of_params = device.buffer("parameters", 16, BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        device.write(&of_params, bytes_of(&params));
        let result = device.buffer("stiffness", size, BufferUsages::STORAGE | BufferUsages::COPY_SRC);
        let staging = device.buffer("staging", size, BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        let buffers = [
            ("params", &of_params),
            ("edge_start", &device.filled("edge_start", chunk.edge_start)),
            ("edge_tets", &device.filled("edge_tets", chunk.edge_tets)),
            ("tet_edges", &device.filled("tet_edges", chunk.tet_edges)),
            ("edge_vector", &device.filled("edge_vector", chunk.edge_vector)),
            ("stiffness", &result),
        ];
        let group = device.bind(&device.pipelines.edge_stiffness, &buffers);
        let mut encoder = device.encoder();
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        pass.set_pipeline(&device.pipelines.edge_stiffness.pipeline);
        pass.set_bind_group(0, &group, &[0]);
        let (x, y) = device.workgroups(chunk.n_edges, &device.pipelines.edge_stiffness);
        pass.dispatch_workgroups(x, y, 1);
        drop(pass);
        device.read(encoder, &result, &staging, chunk.n_edges)
    })
}

/// Bytes of a chunk's largest array.
fn bytes(n_entries: usize, n_tets: usize, n_vectors: usize, n_edges: usize) -> u64 {
    (4 * n_entries).max(24 * n_tets).max(16 * n_vectors).max(4 * (n_edges + 1)) as u64
}

/// Ranges of edges whose arrays fit one binding.
fn plan(device: &Device, input: &EdgeStiffness) -> Result<Vec<Range<usize>>, BackendError> {
    let mut plan: Vec<Range<usize>> = Vec::new();
    let mut seen_by = vec![usize::MAX; input.tet_edges.len()];
    let (mut n_entries, mut n_tets) = (0, 0);
    for edge in 0..input.edge_vector.len() {
        let tets = input.edge_tets.row(edge);
        let mut chunk = plan.len().wrapping_sub(1);
        let new = |seen_by: &[usize], chunk| tets.iter().filter(|&&entry| seen_by[entry as usize / 6] != chunk).count();
        // A tet brings at most five edges besides the edge at which it was found.
        let size = |n_entries: usize, n_tets: usize, n_edges| bytes(n_entries, n_tets, n_edges + 5 * n_tets, n_edges);
        let of_chunk = plan.last().map_or(0, Range::len);
        let extended = size(n_entries + tets.len(), n_tets + new(&seen_by, chunk), of_chunk + 1);
        if plan.is_empty() || extended > device.max_chunk {
            device.fits(size(tets.len(), tets.len(), 1), device.max_chunk)?;
            plan.push(edge..edge);
            chunk = plan.len() - 1;
            (n_entries, n_tets) = (0, 0);
        }
        plan[chunk].end = edge + 1;
        n_entries += tets.len();
        n_tets += new(&seen_by, chunk);
        for &entry in tets {
            seen_by[entry as usize / 6] = chunk;
        }
    }
    Ok(plan)
}

/// A chunk's arrays: edge starts, entries, edges of the tets, edge vectors.
type Arrays = (Vec<u32>, Vec<u32>, Vec<[u32; 6]>, Vec<[f32; 4]>);

/// Numbers of the tets and edges within a chunk, or `NONE`. The arrays are kept between chunks, so
/// the cost of a chunk is proportional to its own size.
struct Numbering {
    tet: Vec<u32>,
    edge: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Numbering {
    fn new(input: &EdgeStiffness) -> Self {
        Self { tet: vec![NONE; input.tet_edges.len()], edge: vec![NONE; input.edge_vector.len()] }
    }

    fn extract(&mut self, input: &EdgeStiffness, packed: &PackedEdges<f32>, range: Range<usize>) -> Arrays {
        let mut edges: Vec<usize> = range.clone().collect();
        for (local, &edge) in edges.iter().enumerate() {
            self.edge[edge] = local as u32;
        }
        let mut edge_start = vec![0];
        let mut edge_tets = Vec::new();
        let mut tets = Vec::new();
        let mut tet_edges = Vec::new();
        for edge in range {
            for &entry in input.edge_tets.row(edge) {
                let tet = entry as usize / 6;
                if self.tet[tet] == NONE {
                    self.tet[tet] = tets.len() as u32;
                    tets.push(tet);
                    tet_edges.push(input.tet_edges[tet].map(|of_tet| {
                        let number = &mut self.edge[of_tet as usize / 2];
                        if *number == NONE {
                            *number = edges.len() as u32;
                            edges.push(of_tet as usize / 2);
                        }
                        *number * 2 + of_tet % 2
                    }));
                }
                edge_tets.push(self.tet[tet] * 6 + entry % 6);
            }
            edge_start.push(edge_tets.len() as u32);
        }
        let edge_vector = edges.iter().map(|&edge| packed.edge_vector[edge]).collect();
        tets.iter().for_each(|&tet| self.tet[tet] = NONE);
        edges.iter().for_each(|&edge| self.edge[edge] = NONE);
        (edge_start, edge_tets, tet_edges, edge_vector)
    }
}
