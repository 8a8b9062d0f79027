// SPDX-License-Identifier: Apache-2.0
//! Location of a processor: its representation, parser and checks.
use crate::refuse::refuse;
use model::refusal::{Class, Refusals};
use rtp::Bounds;
use serde::Deserialize;
use std::time::Duration;

/// Location of a processor.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Location {
    /// In threads of this process.
    #[default]
    Thread,
    /// In its own process on this host.
    Process,
    /// In the process with this name on this host, which is shared by all processors that name it.
    Shared(String),
    /// On a host that has joined the system.
    Host(String),
}

/// A processor as requested.
pub(crate) struct Processor {
    pub core: Option<usize>,
    pub supervisor: bool,
    /// True if the processor was explicitly declared to be the supervisor; false if it is the supervisor because it was created first.
    pub asked: bool,
    pub location: Location,
}

/// Process of a processor, as passed in a call.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum InProcess {
    /// True for its own process, false for this process.
    Own(bool),
    /// Process with this name.
    Named(String),
}

impl Default for InProcess {
    fn default() -> Self {
        InProcess::Own(false)
    }
}

/// Maximum times for which a remote processor and its supervisor may hang, ns, if set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Patience {
    /// Maximum time without a heartbeat, after which the process is killed and counts as lost. If it is this process, its devices are
    /// made safe instead and it survives.
    pub lost_after_ns: Option<u64>,
    /// Maximum time without a message from the supervisor, after which the supervisor counts as lost; also the time for which processors
    /// that continue without a supervisor wait for the next one.
    pub patience_ns: Option<u64>,
}

/// Minimum for the time without a heartbeat. A heartbeat is sent every 20 ms, so a limit of only a few beats would measure the scheduler.
const LOST_AFTER_MIN: Duration = Duration::from_millis(100);
/// Minimum for the time without a message. A supervisor reports every half second that it is alive.
const PATIENCE_MIN: Duration = Duration::from_secs(2);
const BOUND_MAX: Duration = Duration::from_secs(24 * 3600);

impl Patience {
    /// Converts the times to bounds for processor `name`.
    ///
    /// # Errors
    /// `PlacementError` if the location does not support one of the times. `OutOfRange` if a time is too short or too long.
    pub(crate) fn bounds(&self, name: &str, location: &Location) -> Result<Bounds, Refusals> {
        let misplaced = |word: &str, why: &str, remedy: &str| refuse(Class::PlacementError, format!("processor '{name}' has {word}=, but {why}"), remedy);
        match location {
            Location::Thread if self.patience_ns.is_some() => {
                return Err(misplaced("patience", "it runs in threads of the supervisor's own process", "add process=True, or leave it out"));
            }
            Location::Host(_) if self.lost_after_ns.is_some() => {
                return Err(misplaced("lost_after", "it runs on another host, where no guard watches it", "leave it out: the link to a silent host is closed"));
            }
            _ => {}
        }
        let within = |word: &str, given: Option<u64>, min: Duration| match given.map(Duration::from_nanos) {
            Some(given) if given < min || given > BOUND_MAX => Err(refuse(
                Class::OutOfRange,
                format!("{word} of processor '{name}' must be {} s to {} s, not {} s", min.as_secs_f64(), BOUND_MAX.as_secs(), given.as_secs_f64()),
                "",
            )),
            given => Ok(given),
        };
        let lost_after = within("lost_after", self.lost_after_ns, LOST_AFTER_MIN)?;
        let patience = within("patience", self.patience_ns, PATIENCE_MIN)?;
        let Bounds { patience: without, silence, .. } = Bounds::default();
        Ok(Bounds { lost_after, patience: patience.unwrap_or(without), silence: patience.unwrap_or(silence) })
    }
}

impl Location {
    /// Returns the location that a call specifies for processor `name`.
    ///
    /// # Errors
    /// `PlacementError` if both a process and a host are specified. `DefinitionError` if the name of the process is invalid.
    pub fn of(name: &str, process: InProcess, host: Option<String>) -> Result<Location, Refusals> {
        match (process, host) {
            (InProcess::Named(process), Some(host)) => Err(refuse(
                Class::PlacementError,
                format!("processor '{name}' is to run both in process '{process}' and on host '{host}'"),
                "name only one of the two: a process runs on this host, and all processors of another host share one process already",
            )),
            (_, Some(host)) => Ok(Location::Host(host)),
            (InProcess::Own(true), None) => Ok(Location::Process),
            (InProcess::Own(false), None) => Ok(Location::Thread),
            (InProcess::Named(process), None) if is_name(&process) => Ok(Location::Shared(process)),
            (InProcess::Named(process), None) => Err(refuse(
                Class::DefinitionError,
                format!("processor '{name}' is to run in process {process:?}, which is not a valid name"),
                format!("use letters, digits, '-', '_' and '.', at most {NAME_LEN_MAX} of them"),
            )),
        }
    }

    /// Returns the name of the process in which processor `name` runs; `None` if that is this process or one on another host.
    pub fn process<'a>(&'a self, name: &'a str) -> Option<&'a str> {
        match self {
            Location::Process => Some(name),
            Location::Shared(process) => Some(process),
            Location::Thread | Location::Host(_) => None,
        }
    }

    /// Returns the host, if it is not this one.
    pub fn host(&self) -> Option<&str> {
        if let Location::Host(host) = self { Some(host) } else { None }
    }
}

/// Returns true if a name is suitable for display, messages and shell arguments.
fn is_name(text: &str) -> bool {
    let letters = text.chars().all(|c| c.is_alphanumeric() || matches!(c, '-' | '_' | '.'));
    letters && text.starts_with(char::is_alphanumeric) && text.len() <= NAME_LEN_MAX
}

/// Maximum length of a process name, bytes.
const NAME_LEN_MAX: usize = 64;
