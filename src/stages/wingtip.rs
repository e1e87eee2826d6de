//! Stage wingtip (paper 3.3): longitudinal springs along the edges and a conservative spring on every inner vertex.
//!
//! The paper gives a stiffness coefficient `c` in `[0, 1]`, "the greater, the more deformable", and no formula. Here
//! `u_i = c * sum_j k_ij u_j / sum_j k_ij`: at 1 the conservative springs are gone, at 0 the inside does not leave its
//! start. That start follows the best rigid motion of what is already moved around the tip, or stays where it was, as the
//! paper has it ([`TipStart`]).

use glam::DVec3;
use nalgebra::{Matrix3, SymmetricEigen};

use super::{Families, Motion, Owner, Role, TipStart, patch::Patch};
use crate::{
    backend::{Backend, BackendError, Constraint},
    mesh::{TetMesh, edges::triangle_edges, half_edge::Surface},
    relaxation::{Accuracy, Convergence, Method},
};

/// All wingtips of a mesh.
pub struct Wingtips {
    tips: Vec<Wingtip>,
}

struct Wingtip {
    start: TipStart,
    /// Vertices earlier stages have placed.
    placed: Vec<u32>,
    inside: Vec<u32>,
    network: Patch,
}

impl Wingtips {
    /// Sets the networks up.
    ///
    /// # Errors
    /// The backend failed.
    pub fn new(
        mesh: &TetMesh,
        surface: &Surface,
        families: &Families,
        backend: &dyn Backend,
        method: Method,
    ) -> Result<Self, BackendError> {
        let tips = families.placed_by(Owner::Wingtip).map(|family| {
            let Role::Wingtip { coefficient, start } = families.roles[family.index()] else {
                unreachable!("only wingtips are placed by the wingtip stage")
            };
            let (inside, placed): (Vec<u32>, Vec<u32>) = surface
                .vertices_of(family)
                .into_iter()
                .partition(|&vertex| families.owner[vertex as usize] == Owner::Wingtip);
            let triangles = surface.triangles_of(family).iter().map(|&triangle| surface.triangles[triangle as usize]);
            let constraint = |vertex: u32| {
                // A coefficient of 0 would take infinitely stiff springs: the vertex is held at its start instead.
                let free = families.owner[vertex as usize] == Owner::Wingtip && coefficient > 0.0;
                if free { families.plane_constraint(vertex) } else { Constraint::Held }
            };
            let edges = triangle_edges(triangles);
            let network =
                Patch::new(&mesh.vertices, &edges, constraint, 1.0 - coefficient.max(1e-12), backend, method)?;
            Ok(Wingtip { start, placed, inside, network })
        });
        Ok(Self { tips: tips.collect::<Result<_, BackendError>>()? })
    }

    /// Moves the insides of the wingtips after their boundaries.
    ///
    /// # Errors
    /// The backend failed.
    pub fn run(
        &mut self,
        mesh: &TetMesh,
        families: &Families,
        motion: &mut Motion,
        accuracy: &Accuracy,
    ) -> Result<Convergence, BackendError> {
        let mut convergence = Convergence::nothing_to_do();
        for tip in &mut self.tips {
            if tip.placed.iter().all(|&vertex| motion[vertex as usize] == DVec3::ZERO) {
                continue;
            }
            let pairs: Vec<(DVec3, DVec3)> = tip
                .placed
                .iter()
                .map(|&vertex| {
                    (mesh.vertices[vertex as usize], mesh.vertices[vertex as usize] + motion[vertex as usize])
                })
                .collect();
            let start = match tip.start {
                TipStart::Rigid => RigidMotion::fit(&pairs),
                TipStart::Original => RigidMotion::identity(),
            };
            // Relative to that start the conservative springs pull to zero.
            let carried = |vertex: u32| start.displacement(mesh.vertices[vertex as usize]);
            for &vertex in &tip.placed {
                motion[vertex as usize] -= carried(vertex);
            }
            convergence = convergence.and(tip.network.relax(motion, accuracy)?);
            for (&(from, to), &vertex) in pairs.iter().zip(&tip.placed) {
                motion[vertex as usize] = to - from;
            }
            for &vertex in &tip.inside {
                let at = mesh.vertices[vertex as usize];
                let moved = at + motion[vertex as usize] + carried(vertex);
                motion[vertex as usize] = families.settle(vertex, moved) - at;
            }
        }
        Ok(convergence)
    }
}

/// A rotation about a centre and a translation.
#[derive(Clone, Copy, Debug)]
struct RigidMotion {
    from: DVec3,
    to: DVec3,
    rotation: Matrix3<f64>,
}

impl RigidMotion {
    fn identity() -> Self {
        Self { from: DVec3::ZERO, to: DVec3::ZERO, rotation: Matrix3::identity() }
    }

    /// The motion that brings the first points closest to the second, in the least-squares sense: the quaternion of the
    /// largest eigenvalue of Horn's matrix (J. Opt. Soc. Am. A 4(4), 1987), which never reflects.
    fn fit(pairs: &[(DVec3, DVec3)]) -> Self {
        let n = pairs.len() as f64;
        let from = pairs.iter().map(|pair| pair.0).sum::<DVec3>() / n;
        let to = pairs.iter().map(|pair| pair.1).sum::<DVec3>() / n;
        let mut s = Matrix3::<f64>::zeros();
        for pair in pairs {
            let (a, b) = ((pair.0 - from).to_array(), (pair.1 - to).to_array());
            s += nalgebra::Vector3::from(a) * nalgebra::Vector3::from(b).transpose();
        }
        #[rustfmt::skip]
        let horn = nalgebra::Matrix4::new(
            s[(0, 0)] + s[(1, 1)] + s[(2, 2)], s[(1, 2)] - s[(2, 1)], s[(2, 0)] - s[(0, 2)], s[(0, 1)] - s[(1, 0)],
            s[(1, 2)] - s[(2, 1)], s[(0, 0)] - s[(1, 1)] - s[(2, 2)], s[(0, 1)] + s[(1, 0)], s[(2, 0)] + s[(0, 2)],
            s[(2, 0)] - s[(0, 2)], s[(0, 1)] + s[(1, 0)], s[(1, 1)] - s[(0, 0)] - s[(2, 2)], s[(1, 2)] + s[(2, 1)],
            s[(0, 1)] - s[(1, 0)], s[(2, 0)] + s[(0, 2)], s[(1, 2)] + s[(2, 1)], s[(2, 2)] - s[(0, 0)] - s[(1, 1)],
        );
        let eigen = SymmetricEigen::new(horn);
        let q = eigen.eigenvectors.column(eigen.eigenvalues.imax());
        let rotation = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]))
            .to_rotation_matrix();
        Self { from, to, rotation: rotation.into_inner() }
    }

    fn displacement(&self, at: DVec3) -> DVec3 {
        let turned = self.rotation * nalgebra::Vector3::from((at - self.from).to_array());
        self.to + DVec3::new(turned.x, turned.y, turned.z) - at
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rigid_motion_is_found_again() {
        let turn = glam::DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 2.5);
        let moved = |p: DVec3| turn * p + DVec3::new(3.0, -1.0, 0.25);
        let points: Vec<DVec3> = (0..7).map(|i| DVec3::new((i * i) as f64, (i % 3) as f64, 0.5 * i as f64)).collect();
        let motion = RigidMotion::fit(&points.iter().map(|&p| (p, moved(p))).collect::<Vec<_>>());
        for p in points {
            assert!((p + motion.displacement(p) - moved(p)).length() < 1e-13 * 40.0);
        }
    }
}
