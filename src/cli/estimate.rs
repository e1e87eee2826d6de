//! [`Estimate`]: how much of a run is done, and how long the rest takes.
//!
//! The steps of a run take about the same shares of its time on meshes of every size, and the time
//! until now shows how long that is on this machine. On a path of steps, whose number nobody knows
//! before, the part of the path that is done counts. In relaxations of many sweeps the digits that
//! are gained count.

/// Names of steps, with the share of a run that is done as each begins.
///
/// Measured on half aircraft of 97 694 and 921 093 tets, with `idmesh -v run` on two threads; the
/// two differ by up to 0.1.
const STEPS: [(&str, f64); 14] = [
    ("reading", 0.0),
    ("starting the backend", 0.05),
    ("topology", 0.06),
    ("families", 0.23),
    ("profiles", 0.26),
    ("springs", 0.48),
    ("wing", SET_UP),
    ("trailing edge", 0.81),
    ("wingtip", 0.82),
    ("carenage", 0.82),
    ("planes", 0.83),
    ("volume", 0.83),
    ("writing the page", 0.94),
    ("writing", 0.91),
];

/// The share of a run that its set-up takes, with the reading of files.
pub(super) const SET_UP: f64 = 0.8;

/// Shares of a run between which a path of steps lies.
const PATH: (f64, f64) = (0.83, 0.91);

/// Before this share of a run is done, no time is told: reading may be slow for another reason.
const FIRST: f64 = 0.05;

/// The progress of one run. Times are in seconds since its beginning.
#[derive(Clone, Debug)]
pub(super) struct Estimate {
    /// The share of a run that the command does.
    whole: f64,
    /// The step in work: the share that was done as it began, the share as it ends, and the time at
    /// which it began.
    step: Option<(f64, f64, f64)>,
    path: Option<OnPath>,
}

/// A path of steps.
#[derive(Clone, Debug)]
struct OnPath {
    /// Time at which the first step began.
    since: f64,
    /// Where the step in work shall end, and the largest such place of a step before, in shares of
    /// the path.
    target: f64,
    reached: f64,
}

impl Estimate {
    /// - `whole`: the share of a run that the command does, such as [`SET_UP`]
    pub(super) fn new(whole: f64) -> Self {
        Self { whole, step: None, path: None }
    }

    /// Notes that a step begins.
    pub(super) fn begin(&mut self, name: &str, now: f64) {
        if let Some(percent) = name.strip_prefix("step to ").and_then(|rest| rest.strip_suffix(" %")) {
            let Ok(target) = percent.parse::<f64>().map(|percent| percent / 100.0) else { return };
            // A path follows a relaxation.
            let path = self.path.take().filter(|path| path.target > path.reached);
            let path = self.path.insert(path.unwrap_or(OnPath { since: now, target, reached: 0.0 }));
            if path.target < target {
                path.reached = path.target;
            }
            path.target = target;
            return;
        }
        if let Some(percent) = name.strip_prefix("volume ").and_then(|rest| rest.strip_suffix(" %")) {
            let (Ok(percent), Some((.., since))) = (percent.parse::<f64>(), self.step) else { return };
            self.path = Some(OnPath { since, target: percent / 100.0, reached: percent / 100.0 });
            return;
        }
        // The name of this step goes on with that of a file.
        let name = if name.starts_with("reading ") { "reading" } else { name };
        let Some(&(_, share)) = STEPS.iter().find(|(known, _)| *known == name) else { return };
        let next = STEPS.iter().map(|&(_, next)| next).filter(|&next| next > share).fold(1.0, f64::min);
        // Cases with several files have some steps several times.
        if self.step.is_none_or(|(before, ..)| before < share) {
            self.step = Some((share, next.min(self.whole), now));
        }
        if share > PATH.0 {
            self.path = None;
        }
    }

    /// The share of the work that is done, and the seconds that the rest takes. `None` while
    /// nothing is known.
    pub(super) fn at(&self, now: f64) -> Option<(f64, f64)> {
        if let Some(OnPath { since, reached, .. }) = self.path
            && reached > 0.0
        {
            let share = PATH.0 + (PATH.1 - PATH.0) * reached;
            return Some((share / self.whole, (now - since) * (1.0 - reached) / reached));
        }
        let (share, next, since) = self.step.filter(|&(share, ..)| share >= FIRST)?;
        let whole = since * self.whole / share;
        let takes = since * (next - share) / share;
        let of_step = (now - since) / takes.max(f64::MIN_POSITIVE);
        // A step that takes longer than expected makes the rest longer too.
        let late = (now - since - takes).max(0.0);
        let share = share + (next - share) * of_step.min(1.0);
        Some(((share / self.whole).min(1.0), (whole - now + late).max(0.0)))
    }

    /// What is done and what is left in words, such as `48 %, about 12 s left`. Empty while nothing
    /// is known.
    pub(super) fn in_words(&self, now: f64) -> String {
        let Some((share, left)) = self.at(now) else { return String::new() };
        let percent = format!(", {:.0} %", (100.0 * share).min(99.0));
        match left.round() as u64 {
            0 | 1 => percent,
            left if left < 100 => format!("{percent}, about {left} s left"),
            left => format!("{percent}, about {} min left", left.div_ceil(60)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run whose steps take exactly their shares of 100 s: the time left is right at every
    /// moment.
    #[test]
    fn a_run_as_measured_is_foretold() {
        let mut estimate = Estimate::new(1.0);
        let mut steps: Vec<(&str, f64)> = STEPS.to_vec();
        steps.sort_by(|a, b| a.1.total_cmp(&b.1));
        let mut begun = 0;
        for now in 0..100 {
            let now = f64::from(now);
            while begun < steps.len() && 100.0 * steps[begun].1 <= now {
                estimate.begin(steps[begun].0, 100.0 * steps[begun].1);
                begun += 1;
            }
            match estimate.at(now) {
                None => assert!(now < 5.0, "{now}"),
                Some((share, left)) => {
                    assert!(
                        (100.0 * share - now).abs() < 1e-9 && (left - (100.0 - now)).abs() < 1e-9,
                        "{now} {share} {left}"
                    );
                }
            }
        }
        assert_eq!(begun, steps.len());
        // On a machine that is ten times as slow.
        let mut slow = Estimate::new(1.0);
        slow.begin("springs", 480.0);
        assert_eq!(slow.in_words(480.0), ", 48 %, about 9 min left");
        assert_eq!(slow.in_words(640.0), ", 64 %, about 6 min left");
    }

    #[test]
    fn a_command_that_sets_up_alone_ends_there() {
        let mut estimate = Estimate::new(SET_UP);
        estimate.begin("reading wing.msh", 0.0);
        assert_eq!(estimate.in_words(3.0), "");
        estimate.begin("springs", 48.0);
        assert_eq!(estimate.in_words(48.0), ", 60 %, about 32 s left");
        // It takes longer than expected.
        assert_eq!(estimate.in_words(90.0), ", 99 %");
    }

    /// On a path the part that is done counts, and a step that failed is none.
    #[test]
    fn a_path_is_foretold_by_its_part_that_is_done() {
        let mut estimate = Estimate::new(1.0);
        estimate.begin("volume", 10.0);
        estimate.begin("step to 20 %", 12.0);
        // 40 % failed, 30 % did not.
        for (name, now) in [("step to 40 %", 14.0), ("step to 30 %", 16.0), ("step to 50 %", 18.0)] {
            estimate.begin(name, now);
        }
        let (share, left) = estimate.at(18.0).unwrap();
        assert!((share - (0.83 + 0.08 * 0.3)).abs() < 1e-12, "{share}");
        assert!((left - 6.0 * 0.7 / 0.3).abs() < 1e-12, "{left}");
        estimate.begin("writing", 40.0);
        assert!(estimate.at(40.0).unwrap().1 < 5.0);
    }

    /// A relaxation of many sweeps that has a fifth of its digits after 4 s takes 16 s more. A path
    /// that follows begins anew.
    #[test]
    fn sweeps_are_foretold_by_their_digits() {
        let mut estimate = Estimate::new(1.0);
        estimate.begin("volume", 10.0);
        estimate.begin("volume 20 %", 14.0);
        let (share, left) = estimate.at(14.0).unwrap();
        assert!((share - (0.83 + 0.08 * 0.2)).abs() < 1e-12 && (left - 16.0).abs() < 1e-12, "{share} {left}");
        estimate.begin("step to 20 %", 30.0);
        estimate.begin("step to 40 %", 32.0);
        let (_, left) = estimate.at(32.0).unwrap();
        assert!((left - 8.0).abs() < 1e-12, "{left}");
    }

    /// The names are those that a mover tells.
    #[test]
    fn other_steps_tell_nothing() {
        let mut estimate = Estimate::new(1.0);
        estimate.begin("cutting", 5.0);
        estimate.begin("step to x %", 6.0);
        assert_eq!(estimate.in_words(7.0), "");
    }
}
