//! [`Mover::update_many`]: one mesh to several designs, whose springs are read together.

use std::{ops::ControlFlow, time::Instant};

use super::{Design, MoveError, Mover, Outcome, Start, in_work::InWork};
use crate::{backend::MOST_TOGETHER, stage::SetUp};

impl Mover {
    /// Moves the undeformed mesh to several designs. Each has the outcome that [`Mover::update`]
    /// gives it, to the bit; a design that fails changes no other. Returns the outcomes in the
    /// order of the designs.
    ///
    /// On the CPU, multigrid cycles over the volume's springs serve four designs at once, which
    /// takes less time than one design after another. One design follows the other on a GPU, in a
    /// volume with few vertices, which sweeps relax, and after [`Mover::start_from`] with
    /// [`Start::LastDesign`]. Surfaces, paths of steps and local optimisation belong to one design
    /// each. In [`Outcome::stages`] and [`Outcome::stage_seconds`] a design has its share of the
    /// time of its group.
    ///
    /// The designs of a group take some 400 bytes a vertex each, with their outcomes.
    pub fn update_many(&mut self, designs: &[&Design]) -> Vec<Result<Outcome, MoveError>> {
        let is_alone = self.backend.work().is_some() || self.stages.volume.start() != Start::Undeformed;
        let groups = designs.chunks(if is_alone { 1 } else { MOST_TOGETHER });
        groups.flat_map(|group| self.update_group(group)).collect()
    }

    /// - `designs`: at most [`MOST_TOGETHER`]
    fn update_group(&mut self, designs: &[&Design]) -> Vec<Result<Outcome, MoveError>> {
        if let [design] = designs {
            return vec![self.update(design)];
        }
        let tell = |_: &str| ControlFlow::Continue(());
        let begin = |design: &&Design| {
            let mut work = self.move_surfaces(design, None, &tell)?;
            self.stages.exchange(&mut work.made);
            work.pause();
            Ok(work)
        };
        let begun: Vec<Result<InWork, MoveError>> = designs.iter().map(begin).collect();
        let n_begun = begun.iter().flatten().count();
        let jump = Instant::now();
        let Self { ordered: mesh, cells, surface, families, stages, progress, .. } = self;
        let (backend, method, stopping) = (self.backend.as_ref(), self.method, self.stopping);
        let set_up = SetUp { mesh, cells, surface, families, backend, method, stopping };
        let surfaces = begun.iter().flatten().map(|work| &work.displacement);
        // If the backend fails, each design goes on alone and meets the error.
        let jumps = stages.volume.jumps(&set_up, surfaces, progress).unwrap_or_default();
        let share = jump.elapsed() / n_begun.max(1) as u32;
        let mut jumps = jumps.into_iter();
        let end = |(design, begun): (&&Design, Result<InWork, MoveError>)| {
            let mut work = begun?;
            self.stages.exchange(&mut work.made);
            work.go_on(share);
            work.jump = jumps.next();
            self.move_inside(design, work, None, &tell)
        };
        designs.iter().zip(begun).map(end).collect()
    }
}
