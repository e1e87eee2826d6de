//! The convergence of the relaxations, one small chart for each unknown of each stage.

use super::super::svg::Svg;
use super::chart::{Axis, Chart};
use crate::mover::StageRelaxation;

/// The relaxations of one unknown of one stage.
pub(super) struct Group<'a> {
    /// The stage and the unknown, in words.
    pub name: String,
    pub relaxations: Vec<&'a StageRelaxation>,
}

impl<'a> Group<'a> {
    /// The groups, in the order of the stages.
    pub fn all(relaxations: &'a [StageRelaxation]) -> Vec<Self> {
        let mut groups: Vec<Self> = Vec::new();
        for one in relaxations {
            let name = match one.relaxation.of {
                "rotation" => format!("{}, rotations", one.stage),
                _ => one.stage.to_owned(),
            };
            match groups.iter_mut().find(|group| group.name == name) {
                Some(group) => group.relaxations.push(one),
                None => groups.push(Self { name, relaxations: vec![one] }),
            }
        }
        groups
    }

    /// What the chart shows, in words.
    pub fn words(&self) -> String {
        let sweeps: usize = self.relaxations.iter().map(|one| one.relaxation.sweeps).sum();
        let is_cycle = self.relaxations.iter().all(|one| one.relaxation.method == "multigrid");
        let unit = if is_cycle { "cycles" } else { "sweeps" };
        let method = self.relaxations.first().map_or("", |one| one.relaxation.method);
        let failed = self.relaxations.iter().filter(|one| !one.relaxation.converged).count();
        let failed = if failed > 0 { format!(", {failed} not converged") } else { String::new() };
        match self.relaxations.len() {
            1 => format!("{method}, {sweeps} {unit}{failed}"),
            n => format!("{n} relaxations, {method}, {sweeps} {unit}{failed}"),
        }
    }

    /// The largest change of a vertex by each batch of sweeps.
    pub fn chart(&self) -> Svg {
        let points = || self.relaxations.iter().flat_map(|one| &one.relaxation.changes);
        let changes = || points().map(|point| point.1).filter(|change| *change > 0.0 && change.is_finite());
        let (least, most) = (changes().fold(f64::INFINITY, f64::min), changes().fold(0.0, f64::max));
        let y = if most > 0.0 { Axis::powers(least, most) } else { Axis::powers(1e-4, 1.0) };
        let sweeps = points().map(|point| point.0).max().unwrap_or(1) as f64;
        let x = Axis::linear(0.0, sweeps);
        let title = format!("Convergence: {}", self.name);
        let mut chart = Chart::new([220.0, 150.0], &title, x, y, ["sweeps", "change, shortest edges"]);
        for one in &self.relaxations {
            chart.curve("line new", one.relaxation.changes.iter().map(|&(sweeps, change)| [sweeps as f64, change]));
        }
        chart.svg
    }
}
