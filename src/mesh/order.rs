//! Renumbers a mesh for speed: neighbours get close numbers, and vertices with equally many
//! neighbours stand together.
//!
//! The numbers in files are random for a processor's caches. [`Order::new`] follows Hilbert's curve
//! through the mesh. So some hundred vertices that follow one another fill a ball, and most of
//! their neighbours are among them: a device keeps what they need in fast memory. The curve needs
//! the places of the vertices, but neither the unit of length, nor where the mesh stands and how it
//! is turned, nor a mirror changes the order. [`Order::breadth_first`] depends on the cells alone:
//! a mesh has the same order before and after a motion.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::{HybridMesh, OtherCells, TetMesh, csr::Csr, hilbert, in_pieces, joined};

/// Vertices per block of a breadth-first order. Within a block the vertices are sorted by their
/// number of neighbours.
///
/// Where rows of a network are as long as the row before, a processor predicts their ends, and the
/// lanes of a GPU end together. An update takes a tenth less time. After the sorting scope of
/// Kreutzer et al. (SIAM J. Sci. Comput. 36, 2014, C401-C423).
const ALIKE: usize = 1024;

/// [`ALIKE`] along Hilbert's curve: the rows of a GPU's workgroup, which stay together. Sorted
/// across workgroups, they would need twice as many vertices of others.
const WORKGROUP: usize = 256;

/// The places of a mesh's vertices and cells in an order made for speed.
#[derive(Debug)]
pub struct Order {
    /// Index in the mesh of each vertex of the ordered mesh `[n_vertices]`.
    vertices: Vec<u32>,
    /// Index in the ordered mesh of each vertex of the mesh `[n_vertices]`.
    places: Vec<u32>,
    /// Index in the mesh of each tet of the ordered mesh `[n_tets]`.
    tets: Vec<u32>,
    /// Index in the mesh of each pyramid, prism and hexahedron of the ordered mesh, kind by kind.
    others: [Vec<u32>; 3],
}

impl Order {
    /// Orders a mesh along Hilbert's curve. A cell stands with the first of its vertices.
    ///
    /// The vertices that springs move are the rows of a network. In the end each 256 of them are
    /// sorted by the length of their rows, and the held vertices between them come first.
    ///
    /// - `is_held` `[n_vertices]`: whether no spring of the volume moves a vertex
    ///
    /// # Panics
    /// `is_held` does not belong to the mesh.
    pub fn new<'a>(mesh: impl Into<HybridMesh<'a>>, is_held: &[bool]) -> Self {
        let mesh = mesh.into();
        assert_eq!(is_held.len(), mesh.vertices().len(), "each vertex is held or not");
        let around = cells_around(mesh);
        let cells = cells_of_cube(mesh.vertices()).into_par_iter().enumerate();
        let mut on_curve: Vec<(u64, u32)> =
            cells.map(|(vertex, cell)| (hilbert::place(cell, hilbert::BITS), vertex as u32)).collect();
        // Vertices in one cell of the cube keep the order of the mesh.
        on_curve.par_sort_unstable();
        let mut vertices: Vec<u32> = on_curve.par_iter().map(|&(_, vertex)| vertex).collect();
        drop(on_curve);
        let length = row_lengths(mesh, &around, is_held);
        let mut blocks = Vec::with_capacity(vertices.len() / WORKGROUP + 1);
        let (mut rest, mut end, mut n_rows) = (&mut vertices[..], 0, 0);
        while end < rest.len() {
            n_rows += usize::from(length[rest[end] as usize] > 0);
            end += 1;
            if n_rows == WORKGROUP {
                let (block, others) = rest.split_at_mut(end);
                blocks.push(block);
                (rest, end, n_rows) = (others, 0, 0);
            }
        }
        blocks.push(rest);
        blocks.into_par_iter().for_each(|block| block.sort_by_key(|&vertex| length[vertex as usize]));
        Self::of_vertices_first(mesh, &around, vertices)
    }

    /// Each cell stands with the first of its vertices `[n_vertices]`.
    fn of_vertices_first(mesh: HybridMesh, around: &Csr, vertices: Vec<u32>) -> Self {
        let mut places = vec![0; vertices.len()];
        vertices.iter().zip(0..).for_each(|(&vertex, place)| places[vertex as usize] = place);
        let is_first = |place: usize, corners: &[u32]| corners.iter().all(|&at| places[at as usize] >= place as u32);
        let pieces = in_pieces(vertices.len(), |piece| {
            let mut cells: [Vec<u32>; 4] = Default::default();
            for place in piece {
                for &cell in around.row(vertices[place] as usize) {
                    if let Some(tet) = mesh.mesh.tets.get(cell as usize) {
                        if is_first(place, tet) {
                            cells[0].push(cell);
                        }
                    } else {
                        let name = mesh.name(cell as usize);
                        if is_first(place, mesh.cell(name)) {
                            cells[name.kind as usize].push(name.index as u32);
                        }
                    }
                }
            }
            cells
        });
        let mut of_kinds: [Vec<Vec<u32>>; 4] = Default::default();
        for piece in pieces {
            of_kinds.iter_mut().zip(piece).for_each(|(of_kind, of_piece)| of_kind.push(of_piece));
        }
        let [tets, others @ ..] = of_kinds.map(|of_kind| joined(&of_kind));
        Self { vertices, places, tets, others }
    }

    /// Orders a mesh breadth first: the cells around a vertex, then the other vertices of these
    /// cells.
    ///
    /// Each connected part begins with its first vertex. A vertex that no cell uses is a part of
    /// its own. In the end the vertices of each block of 1024 are sorted by the number of cells
    /// around them.
    pub fn breadth_first<'a>(mesh: impl Into<HybridMesh<'a>>) -> Self {
        let mesh = mesh.into();
        let around = cells_around(mesh);
        let Self { mut vertices, mut places, tets, others } = breadth_first(mesh, &around);
        // In a mesh of tets, an inner vertex with n tets around it has n / 2 + 2 neighbours
        // (Euler).
        vertices.chunks_mut(ALIKE).for_each(|block| block.sort_by_key(|&vertex| around.row(vertex as usize).len()));
        vertices.iter().zip(0..).for_each(|(&vertex, place)| places[vertex as usize] = place);
        Self { vertices, places, tets, others }
    }

    /// The mesh in this order. Families and triangles keep their order.
    pub fn of(&self, mesh: &TetMesh) -> TetMesh {
        TetMesh {
            vertices: self.vertices.iter().map(|&vertex| mesh.vertices[vertex as usize]).collect(),
            tets: self.tets.iter().map(|&tet| mesh.tets[tet as usize].map(|vertex| self.place(vertex))).collect(),
            triangles: mesh.triangles.iter().map(|triangle| triangle.map(|vertex| self.place(vertex))).collect(),
            triangle_family: mesh.triangle_family.clone(),
            families: mesh.families.clone(),
        }
    }

    /// The other cells in this order. Quadrilaterals keep their order.
    pub fn of_others(&self, others: &OtherCells) -> OtherCells {
        fn ordered<const N: usize>(cells: &[[u32; N]], order: &[u32], place: impl Fn(u32) -> u32) -> Vec<[u32; N]> {
            order.iter().map(|&cell| cells[cell as usize].map(&place)).collect()
        }
        let place = |vertex: u32| self.place(vertex);
        let [pyramids, prisms, hexahedra] = &self.others;
        OtherCells {
            pyramids: ordered(&others.pyramids, pyramids, place),
            prisms: ordered(&others.prisms, prisms, place),
            hexahedra: ordered(&others.hexahedra, hexahedra, place),
            quadrilaterals: others.quadrilaterals.iter().map(|face| face.map(place)).collect(),
            quadrilateral_family: others.quadrilateral_family.clone(),
        }
    }

    /// Index in the ordered mesh of a vertex of the mesh.
    pub fn place(&self, vertex: u32) -> u32 {
        self.places[vertex as usize]
    }

    /// Index in the mesh of a vertex of the ordered mesh.
    pub fn vertex(&self, place: u32) -> u32 {
        self.vertices[place as usize]
    }

    /// Number in the mesh of a cell of the ordered mesh. Cells are numbered as
    /// [`HybridMesh::name`] counts them.
    pub fn cell(&self, place: u32) -> u32 {
        let [pyramids, prisms, hexahedra] = &self.others;
        let mut first = 0;
        for of_kind in [&self.tets, pyramids, prisms, hexahedra] {
            if let Some(&index) = of_kind.get((place - first) as usize) {
                return first + index;
            }
            first += of_kind.len() as u32;
        }
        place
    }

    /// Brings values of the ordered vertices `[n_vertices]` into the order of the mesh.
    pub fn of_vertices<T: Copy>(&self, ordered: &[T]) -> Vec<T> {
        self.places.iter().map(|&place| ordered[place as usize]).collect()
    }

    /// Brings values of the mesh's vertices `[n_vertices]` into this order.
    pub fn to_vertices<T: Copy>(&self, values: &[T]) -> Vec<T> {
        self.vertices.iter().map(|&vertex| values[vertex as usize]).collect()
    }

    /// Brings values of the ordered tets `[n_tets]` into the order of the mesh.
    pub fn of_tets(&self, ordered: &[f64]) -> Vec<f64> {
        let mut values = vec![0.0; ordered.len()];
        self.tets.iter().zip(ordered).for_each(|(&tet, &value)| values[tet as usize] = value);
        values
    }
}

/// The order of [`Order::breadth_first`] before its blocks are sorted.
fn breadth_first(mesh: HybridMesh, around: &Csr) -> Order {
    let n_vertices = mesh.vertices().len();
    let mut vertices = Vec::with_capacity(n_vertices);
    let mut places = vec![u32::MAX; n_vertices];
    let n_tets = mesh.mesh.tets.len();
    let mut tets = Vec::with_capacity(n_tets);
    let mut others: [Vec<u32>; 3] = Default::default();
    let mut seen = vec![false; mesh.n_cells()];
    for first in 0..n_vertices as u32 {
        let mut next = vertices.len();
        let mut visit = |vertex: u32, vertices: &mut Vec<u32>| {
            let place = &mut places[vertex as usize];
            if *place == u32::MAX {
                *place = vertices.len() as u32;
                vertices.push(vertex);
            }
        };
        visit(first, &mut vertices);
        while let Some(&vertex) = vertices.get(next) {
            for &cell in around.row(vertex as usize) {
                if std::mem::replace(&mut seen[cell as usize], true) {
                    continue;
                }
                if let Some(tet) = mesh.mesh.tets.get(cell as usize) {
                    tets.push(cell);
                    tet.iter().for_each(|&corner| visit(corner, &mut vertices));
                } else {
                    let name = mesh.name(cell as usize);
                    others[name.kind as usize - 1].push(name.index as u32);
                    mesh.cell(name).iter().for_each(|&corner| visit(corner, &mut vertices));
                }
            }
            next += 1;
        }
    }
    Order { vertices, places, tets, others }
}

/// Number of neighbours of each vertex that are not held `[n_vertices]`; 0 for a vertex that is
/// held or in no cell. With other cells than tets a number that grows with it.
fn row_lengths(mesh: HybridMesh, around: &Csr, is_held: &[bool]) -> Vec<u32> {
    // In a mesh of tets, an inner vertex with n tets around it has n / 2 + 2 neighbours (Euler).
    let neighbours = |(vertex, &is_held): (usize, &bool)| match around.row(vertex).len() as u32 {
        0 => 0,
        n_cells => {
            if is_held {
                0
            } else {
                n_cells / 2 + 2
            }
        }
    };
    let mut length: Vec<u32> = is_held.par_iter().enumerate().map(neighbours).collect();
    let beside_held = in_pieces(is_held.len(), |vertices| {
        let (mut all, mut of_vertex) = (Vec::new(), Vec::<u32>::new());
        for vertex in vertices.filter(|&vertex| is_held[vertex]) {
            of_vertex.clear();
            for &cell in around.row(vertex) {
                let tet = mesh.mesh.tets.get(cell as usize).map(|tet| &tet[..]);
                let corners = tet.unwrap_or_else(|| mesh.cell(mesh.name(cell as usize)));
                of_vertex.extend(corners.iter().filter(|&&corner| !is_held[corner as usize]));
            }
            of_vertex.sort_unstable();
            of_vertex.dedup();
            all.extend_from_slice(&of_vertex);
        }
        all
    });
    for vertex in beside_held.into_iter().flatten() {
        let length = &mut length[vertex as usize];
        *length = length.saturating_sub(1).max(1);
    }
    length
}

/// The cell of a cube around the mesh in which each vertex lies `[n_vertices]`, as
/// [`hilbert::place`] counts cells.
///
/// The cube stands as the mesh stands: its axes lead from the first vertex to others. And the faces
/// of its cells are at no simple fraction of the mesh, so rounding does not decide where vertices
/// of a regular mesh lie. So a mesh that is turned or mirrored, or in another unit, has the same
/// cells.
fn cells_of_cube(points: &[DVec3]) -> Vec<[u32; 3]> {
    let Some(&origin) = points.first() else { return Vec::new() };
    let direction = |from_axis: &(dyn Fn(DVec3) -> DVec3 + Sync)| {
        let away = |point: &DVec3| from_axis(*point - origin);
        let furthest = points.par_iter().map(|point| away(point).length()).reduce(|| 0.0, f64::max);
        points.iter().map(away).find(|away| away.length() > FAR * furthest).and_then(DVec3::try_normalize)
    };
    let x = direction(&|away| away).unwrap_or(DVec3::X);
    let y = direction(&|away| away.reject_from_normalized(x)).unwrap_or_else(|| x.any_orthonormal_vector());
    let across = x.cross(y);
    let z = direction(&|away| across * away.dot(across)).unwrap_or(across);
    let axes = DMat3::from_cols(x, y, z).transpose();
    let placed: Vec<DVec3> = points.par_iter().map(|point| axes * (*point - origin)).collect();
    let none = || [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let bounds = |[low, high]: [DVec3; 2], place: &DVec3| [low.min(*place), high.max(*place)];
    let both = |a: [DVec3; 2], b: [DVec3; 2]| [a[0].min(b[0]), a[1].max(b[1])];
    let [low, high] = placed.par_iter().fold(none, bounds).reduce(none, both);
    let scale = f64::from(1u32 << hilbert::BITS) * (1.0 - BESIDE) / (high - low).max_element();
    let first = 0.3 * BESIDE * f64::from(1u32 << hilbert::BITS);
    // Coordinates that are not finite, and a mesh that is a point, give a cell too.
    placed.par_iter().map(|place| ((*place - low) * scale + first).to_array().map(|along| along as u32)).collect()
}

/// An axis of [`cells_of_cube`] leads to the first vertex that is further away than this share of
/// the furthest.
const FAR: f64 = 0.768_394_1;

/// Share of the cube of [`cells_of_cube`] beside the mesh. More of it is on one side, so that the
/// middle of the mesh lies in a cell too.
const BESIDE: f64 = 0.012_345_678_9;

/// The cells around each vertex, ascending: `n_vertices` rows. A degenerate cell names a vertex
/// twice, and stands in its row once.
pub(crate) fn cells_around(mesh: HybridMesh) -> Csr {
    let n_vertices = mesh.vertices().len();
    let is_degenerate = |tet: &[u32; 4]| (1..4).any(|place| tet[..place].contains(&tet[place]));
    if mesh.others.n_cells() == 0 && !mesh.mesh.tets.iter().any(is_degenerate) {
        let mut around = Csr::of_rows(n_vertices, mesh.mesh.tets.as_flattened());
        around.entries.iter_mut().for_each(|corner| *corner /= 4);
        return around;
    }
    let corners = mesh.cells().zip(0..).flat_map(|(cell, number)| {
        let is_first = |&(place, vertex): &(usize, &u32)| !cell[..place].contains(vertex);
        cell.iter().enumerate().filter(is_first).map(move |(_, &vertex)| (vertex, number)).collect::<Vec<_>>()
    });
    let pairs: Vec<(u32, u32)> = corners.collect();
    Csr::from_pairs(n_vertices, pairs.into_iter())
}
