// SPDX-License-Identifier: Apache-2.0
//! Where a processor runs: as it is said, what of it is refused, and how it is shown.
use crate::refuse::refuse;
use model::refusal::{Class, Refusals};
use rtp::Bounds;
use serde::Deserialize;
use std::time::Duration;

/// Location of a processor.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Location {
    /// Threads of this process.
    #[default]
    Thread,
    /// A process of its own on this host.
    Process,
    /// The process of this name on this host, with every other processor that names it.
    Shared(String),
    /// A host that has joined the system.
    Host(String),
}

/// A processor as it was asked for.
pub(crate) struct Processor {
    pub core: Option<usize>,
    pub supervisor: bool,
    /// True if it was named supervisor, and is not one only because it is the first.
    pub asked: bool,
    pub location: Location,
}

/// Process of a processor, as a call names it.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum InProcess {
    /// True: in one of its own; false: in none but this.
    Own(bool),
    /// The processor runs in the process of this name.
    Named(String),
}

impl Default for InProcess {
    fn default() -> Self {
        InProcess::Own(false)
    }
}

/// Times for which a remote processor and its supervisor may stand still, ns, as far as they are set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Patience {
    /// The process is ended, and lost, where its heart stands still for so long; this process itself is made safe, and spared.
    pub lost_after_ns: Option<u64>,
    /// A supervisor that says nothing for so long is lost, and what goes on without one waits so long for the next.
    pub patience_ns: Option<u64>,
}

/// A heart beats every 20 ms, and what is shorter than some beats would judge the scheduler.
const LOST_AFTER_MIN: Duration = Duration::from_millis(100);
/// A supervisor says every half second that it is there.
const PATIENCE_MIN: Duration = Duration::from_secs(2);
const BOUND_MAX: Duration = Duration::from_secs(24 * 3600);

impl Patience {
    /// Returns it as bounds of processor `name`.
    ///
    /// # Errors
    /// `PlacementError`: it runs where there is nothing to bound. `OutOfRange`: too short or too long.
    pub(crate) fn bounds(&self, name: &str, location: &Location) -> Result<Bounds, Refusals> {
        let misplaced = |word: &str, why: &str, remedy: &str| refuse(Class::PlacementError, format!("processor '{name}' has {word}=, and {why}"), remedy);
        match location {
            Location::Thread if self.patience_ns.is_some() => {
                return Err(misplaced("patience", "runs in threads of the supervisor's own process", "add process=True, or leave it out"));
            }
            Location::Host(_) if self.lost_after_ns.is_some() => {
                return Err(misplaced(
                    "lost_after",
                    "runs on another host, where no guard watches it",
                    "leave it out: a link to a host that is silent is closed",
                ));
            }
            _ => {}
        }
        let within = |word: &str, given: Option<u64>, min: Duration| match given.map(Duration::from_nanos) {
            Some(given) if given < min || given > BOUND_MAX => Err(refuse(
                Class::OutOfRange,
                format!("{word} {} s of processor '{name}' is not in {} s to {} s", given.as_secs_f64(), min.as_secs_f64(), BOUND_MAX.as_secs()),
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
    /// Returns the location that a call gives for processor `name`.
    ///
    /// # Errors
    /// `PlacementError`: a process and a host together. `DefinitionError`: the name of the process is none.
    pub fn of(name: &str, process: InProcess, host: Option<String>) -> Result<Location, Refusals> {
        match (process, host) {
            (InProcess::Named(process), Some(host)) => Err(refuse(
                Class::PlacementError,
                format!("processor '{name}' is to run in process '{process}' and on host '{host}'"),
                "name one of the two: a process is one of this host, and all processors of another host share one already",
            )),
            (_, Some(host)) => Ok(Location::Host(host)),
            (InProcess::Own(true), None) => Ok(Location::Process),
            (InProcess::Own(false), None) => Ok(Location::Thread),
            (InProcess::Named(process), None) if is_name(&process) => Ok(Location::Shared(process)),
            (InProcess::Named(process), None) => Err(refuse(
                Class::DefinitionError,
                format!("processor '{name}' is to run in process {process:?}, which is no name"),
                format!("take letters, digits, '-', '_' and '.', at most {NAME_LEN_MAX} of them"),
            )),
        }
    }

    /// Returns the name of the process of processor `name`; none if it is in this one, or on another host.
    pub fn process<'a>(&'a self, name: &'a str) -> Option<&'a str> {
        match self {
            Location::Process => Some(name),
            Location::Shared(process) => Some(process),
            Location::Thread | Location::Host(_) => None,
        }
    }

    /// Returns the host, if that is another one.
    pub fn host(&self) -> Option<&str> {
        if let Location::Host(host) = self { Some(host) } else { None }
    }
}

/// Returns true if a name is fit for people, for messages and for an argument of a shell.
fn is_name(text: &str) -> bool {
    let letters = text.chars().all(|c| c.is_alphanumeric() || matches!(c, '-' | '_' | '.'));
    letters && text.starts_with(char::is_alphanumeric) && text.len() <= NAME_LEN_MAX
}

/// Bytes of the name of a process.
const NAME_LEN_MAX: usize = 64;
