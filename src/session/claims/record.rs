//! [`Record`]: the contents of a claim's file, and [`Holder`]: the process that made it.

use std::fs;
use std::path::Path;
use std::sync::LazyLock;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use crate::formats::host;
use crate::report::{RunReport, Sums};
use crate::session::Line;

/// The contents of a claim's file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Record {
    /// The design.
    pub(super) design: String,
    /// Checksums of the design's files.
    pub(super) sums: Sums,
    /// What became of the design.
    #[serde(flatten)]
    pub(super) state: State,
    /// The process that made the claim.
    pub(super) holder: Holder,
    /// Number of the claim among those of the process.
    pub(super) serial: u64,
    /// The moment of the claim by the holder's clock, in s since 1970. For people: no decision
    /// depends on it, because clocks of several hosts differ.
    pub(super) time: u64,
    /// The claim expires after so many seconds in which its holder did not renew it.
    pub(super) expires: u64,
    /// How many holders before this one ended with the design in their hands.
    #[serde(default)]
    pub(super) ended: u32,
}

/// What became of a claimed design.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "state", rename_all = "lowercase")]
pub(super) enum State {
    /// The holder works on the design.
    Held,
    /// The holder has given the design back.
    Released,
    /// The design is done.
    Done(Done),
}

/// The result of a design.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Done {
    /// The exit code that `idmesh run` would have.
    pub exit: u8,
    /// Whether the moved mesh is valid.
    pub valid: bool,
    /// Checksums of the files that were written.
    pub outputs: Sums,
}

impl From<&RunReport> for Done {
    fn from(report: &RunReport) -> Self {
        let outputs = report.checksums.as_ref().map(|checksums| checksums.outputs.clone());
        Self { exit: report.exit, valid: report.valid, outputs: outputs.unwrap_or_default() }
    }
}

impl From<&Line> for Done {
    fn from(line: &Line) -> Self {
        let outputs = line.checksums.as_ref().map(|checksums| checksums.outputs.clone());
        Self { exit: line.exit.unwrap_or_default(), valid: line.valid, outputs: outputs.unwrap_or_default() }
    }
}

/// A process.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Holder {
    /// Name of the computer.
    pub(super) host: String,
    /// Identity of the computer since its last start. Empty where the system gives none.
    boot: String,
    /// The set of processes in which the number holds. Empty where the system gives none.
    namespace: String,
    /// Number of the process.
    pub(super) process: u32,
    /// The moment at which the process started, in ticks since the computer's start. Tells a
    /// process from a later one with the same number.
    started: String,
}

/// This process.
static THIS: LazyLock<Holder> = LazyLock::new(|| {
    let namespace = fs::read_link("/proc/self/ns/pid").unwrap_or_default();
    let process = std::process::id();
    Holder {
        host: host().to_owned(),
        boot: fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default().trim().to_owned(),
        namespace: namespace.to_string_lossy().into_owned(),
        process,
        started: stat(process).map(|(_, started)| started).unwrap_or_default(),
    }
});

impl Holder {
    /// This process.
    pub(super) fn this() -> &'static Self {
        &THIS
    }

    /// Whether the process is known to have ended. Processes of other computers, of other
    /// containers and of systems without `/proc` are not known to have ended.
    pub(super) fn has_ended(&self) -> bool {
        let this = Self::this();
        let is_known = !this.boot.is_empty() && !this.namespace.is_empty() && !this.started.is_empty();
        let of_here = self.boot == this.boot && self.namespace == this.namespace;
        // Some systems hide the processes of other users, and with them the first of all.
        if !is_known || !of_here || !Path::new("/proc/1").exists() {
            return false;
        }
        match stat(self.process) {
            // A process that nobody has waited for is still listed after its end.
            Some((state, started)) => started != self.started || ["Z", "X"].contains(&state.as_str()),
            None => true,
        }
    }
}

/// State and moment of the start of a process; `None` if there is no such process.
fn stat(process: u32) -> Option<(String, String)> {
    let text = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The name of the program, in parentheses, may hold anything.
    let mut fields = text.rsplit_once(')')?.1.split_whitespace();
    let state = fields.next()?.to_owned();
    Some((state, fields.nth(18)?.to_owned()))
}

/// Seconds since 1970 by the clock of this computer.
pub(super) fn now() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs())
}

#[cfg(test)]
mod tests {
    /// A process is alive, ended but not waited for, or gone. A number that another process has
    /// taken over, another start of the computer and another container are told apart.
    #[test]
    #[cfg(target_os = "linux")]
    fn a_process_that_has_ended_is_known() {
        use std::process::{Command, Stdio};

        use super::*;

        let of = |process: u32| Holder {
            process,
            started: stat(process).map(|(_, started)| started).unwrap_or_default(),
            ..Holder::this().clone()
        };
        assert!(!Holder::this().has_ended());
        let mut child = Command::new("cat").stdin(Stdio::piped()).spawn().unwrap();
        let holder = of(child.id());
        assert!(!holder.has_ended());
        let other = |boot: &str, namespace: &str, started: &str| Holder {
            boot: holder.boot.clone() + boot,
            namespace: holder.namespace.clone() + namespace,
            started: holder.started.clone() + started,
            ..holder.clone()
        };
        assert!(other("", "", "1").has_ended());
        child.kill().unwrap();
        // The end of the process is seen at the end of its pipe; its record may take a moment more.
        while stat(child.id()).is_some_and(|(state, _)| state != "Z") {
            std::thread::yield_now();
        }
        assert!(holder.has_ended());
        child.wait().unwrap();
        assert!(holder.has_ended());
        assert!(!other("1", "", "").has_ended() && !other("", "1", "").has_ended());
    }
}
