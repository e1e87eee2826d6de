//! A box of tets with a stubby wing cut out of it: the smallest mesh with all the families of half
//! an aircraft but the fuselage, written as Gmsh 2.2 ascii.
//!
//! The wing is a block 0.75 long, 1.5 wide and 0.5 thick from the symmetry plane on: x in 1..1.75,
//! y in 0..1.5, z in -0.25..0.25. Its back is the trailing edge, its end the wingtip.

use std::collections::HashMap;
use std::fmt::Write;

/// Families, in the order of their tags.
pub const FAMILIES: [&str; 5] = ["wing", "trailing_edge", "wingtip", "symmetry", "farfield"];

/// Cells along x, y, z, their size, and the corner of the box.
const CELLS: [usize; 3] = [11, 8, 10];
const SIZE: [f64; 3] = [0.25, 0.375, 0.25];
const CORNER: [f64; 3] = [0.0, 0.0, -1.25];
/// Cells the wing takes: first and past the last.
const WING: [[usize; 2]; 3] = [[4, 7], [0, 4], [4, 6]];

/// The mesh, free to be spoilt by a test.
#[derive(Clone)]
pub struct WingBox {
    pub vertices: Vec<[f64; 3]>,
    /// Numbered from 0.
    pub tets: Vec<[usize; 4]>,
    /// Vertices and the family's index.
    pub triangles: Vec<([usize; 3], usize)>,
}

impl WingBox {
    pub fn new() -> Self {
        let mut mesh = Self { vertices: Vec::new(), tets: Vec::new(), triangles: Vec::new() };
        let mut number = HashMap::new();
        for cell in cells() {
            // Freudenthal's six tets: from the cell's lowest corner to its highest, one axis after
            // the other.
            for (order, even) in [
                ([0, 1, 2], true),
                ([1, 2, 0], true),
                ([2, 0, 1], true),
                ([0, 2, 1], false),
                ([2, 1, 0], false),
                ([1, 0, 2], false),
            ] {
                let mut corner = cell;
                let mut tet = [0; 4];
                for step in 0..4 {
                    tet[step] = *number.entry(corner).or_insert_with(|| {
                        mesh.vertices.push([0, 1, 2].map(|axis| CORNER[axis] + SIZE[axis] * corner[axis] as f64));
                        mesh.vertices.len() - 1
                    });
                    if step < 3 {
                        corner[order[step]] += 1;
                    }
                }
                if !even {
                    tet.swap(2, 3);
                }
                mesh.tets.push(tet);
            }
        }
        mesh.find_boundary();
        mesh
    }

    fn find_boundary(&mut self) {
        let mut seen: HashMap<[usize; 3], ([usize; 3], usize)> = HashMap::new();
        let mut order = Vec::new();
        for tet in &self.tets {
            for [a, b, c] in [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]] {
                let face = [tet[a], tet[b], tet[c]];
                let mut key = face;
                key.sort_unstable();
                order.push(key);
                seen.entry(key).or_insert((face, 0)).1 += 1;
            }
        }
        for key in order {
            if let (face, 1) = seen[&key] {
                self.triangles.push((face, self.family_at(face)));
            }
        }
    }

    fn family_at(&self, face: [usize; 3]) -> usize {
        let on = |axis: usize, cell: usize| {
            let place = CORNER[axis] + SIZE[axis] * cell as f64;
            face.iter().all(|&vertex| (self.vertices[vertex][axis] - place).abs() < 1e-9)
        };
        if on(1, 0) {
            3
        } else if on(0, 0) || on(0, CELLS[0]) || on(1, CELLS[1]) || on(2, 0) || on(2, CELLS[2]) {
            4
        } else if on(0, WING[0][1]) {
            1
        } else if on(1, WING[1][1]) {
            2
        } else {
            0
        }
    }

    /// The vertices of a family, ascending.
    pub fn family_vertices(&self, family: usize) -> Vec<usize> {
        let members = self.triangles.iter().filter(|(_, other)| *other == family);
        let mut vertices: Vec<_> = members.flat_map(|(face, _)| *face).collect();
        vertices.sort_unstable();
        vertices.dedup();
        vertices
    }

    /// The mesh as a Gmsh 2.2 ascii file.
    pub fn gmsh(&self) -> String {
        let mut text = String::from("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n");
        writeln!(text, "{}", FAMILIES.len() + 1).unwrap();
        for (index, name) in FAMILIES.iter().enumerate() {
            writeln!(text, "2 {} \"{name}\"", index + 1).unwrap();
        }
        writeln!(text, "3 {} \"fluid\"\n$EndPhysicalNames\n$Nodes\n{}", FAMILIES.len() + 1, self.vertices.len())
            .unwrap();
        for (index, [x, y, z]) in self.vertices.iter().enumerate() {
            writeln!(text, "{} {x} {y} {z}", index + 1).unwrap();
        }
        writeln!(text, "$EndNodes\n$Elements\n{}", self.triangles.len() + self.tets.len()).unwrap();
        for (index, ([a, b, c], family)) in self.triangles.iter().enumerate() {
            let tag = family + 1;
            writeln!(text, "{} 2 2 {tag} {tag} {} {} {}", index + 1, a + 1, b + 1, c + 1).unwrap();
        }
        for (index, [a, b, c, d]) in self.tets.iter().enumerate() {
            let (number, tag) = (index + 1 + self.triangles.len(), FAMILIES.len() + 1);
            writeln!(text, "{number} 4 2 {tag} {tag} {} {} {} {}", a + 1, b + 1, c + 1, d + 1).unwrap();
        }
        text + "$EndElements\n"
    }
}

fn cells() -> impl Iterator<Item = [usize; 3]> {
    let all = (0..CELLS[0]).flat_map(|x| (0..CELLS[1]).flat_map(move |y| (0..CELLS[2]).map(move |z| [x, y, z])));
    all.filter(|cell| !(0..3).all(|axis| (WING[axis][0]..WING[axis][1]).contains(&cell[axis])))
}

/// The wing's section at `y`, shifted by `dx`, `dz`, as rows of a profile file.
pub fn section(profile: i64, y: f64, dx: f64, dz: f64) -> String {
    let corners = [(1.75, -0.25), (1.375, -0.25), (1.0, -0.25), (1.0, 0.0), (1.0, 0.25), (1.375, 0.25), (1.75, 0.25)];
    corners.iter().map(|(x, z)| format!("{profile},{},{y},{}\n", x + dx, z + dz)).collect()
}
