// SPDX-License-Identifier: Apache-2.0
//! Replays a recording in a separate process while the system runs. If the replay differs, the recorded values are added to the reported
//! difference.
use crate::opened;
use model::refusal::{Class, Refusal, Refusals};
use replay::{Apart, DifferenceText, ReplayResult, Replaying, ShownSvv, elements};
use std::any::Any;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use supervisor::{Companion, System};

/// Replay of a recording in progress. It ends with [`Again::stop`], or together with its system.
pub struct Again {
    path: PathBuf,
    apart: Apart,
    /// Difference that was found, with values of the recording added.
    found: Mutex<Option<ReplayResult>>,
}

impl Again {
    /// Starts a replay; returns its number in the system. The recording's own code modules may run if they were loaded in the system at
    /// some time, or if their digests are in `trust`. `present` replaces them with the system's current modules of the same names. Fails
    /// if the process cannot be started.
    pub fn start(system: &System, path: &Path, mut trust: Vec<String>, present: bool) -> Result<u64, Refusals> {
        let archive = opened(path)?;
        let cannot = |why: String, remedy: &str| {
            let message = format!("cannot run '{}' again: {why}", path.display());
            vec![Refusal::new(Class::InvalidState, message).remedy(remedy)]
        };
        if !archive.has(replay::TOPIC) {
            return Err(cannot("it has nothing to replay".to_owned(), "record with replay=True, before the first interrupt source is created"));
        }
        let Some((command, python)) = system.replay_command() else {
            return Err(cannot("this system has no way to start processes".to_owned(), "run it again with 'opengpac replay'"));
        };
        trust.extend(system.module_digests());
        let others = if present { system.module_code() } else { Vec::new() };
        let apart = Apart::start(command, python.to_string_lossy().into_owned(), path, trust, others).map_err(|why| cannot(why, ""))?;
        Ok(system.accompany(Arc::new(Again { path: path.to_owned(), apart, found: Mutex::new(None) })))
    }

    /// Returns the state of the replay.
    pub fn standing(&self) -> Replaying {
        let standing = self.apart.standing();
        Replaying { found: standing.found.map(|found| self.told(found)), ..standing }
    }

    /// Stops the replay at its current position. Idempotent.
    pub fn stop(&self) {
        self.apart.stop();
    }

    /// Adds the differing value, read from the recorded values of SVVs, if the replay knows only a digest of it.
    fn told(&self, found: ReplayResult) -> ReplayResult {
        let mut known = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        known
            .get_or_insert_with(|| {
                let mut found = found;
                if let Some(difference) = found.difference.as_mut().filter(|difference| difference.block.is_empty()) {
                    self.name(difference);
                }
                found
            })
            .clone()
    }

    fn name(&self, difference: &mut DifferenceText) {
        // If the file has been deleted in the meantime, nothing can be added.
        let Ok(archive) = opened(&self.path) else { return };
        let recorded = |shown: &ShownSvv| {
            let (bytes, _, time_ns) = archive.value_at(&shown.name, difference.time_ns).ok()??;
            (time_ns == difference.time_ns).then(|| elements(&shown.type_text, &bytes))
        };
        let found = difference.stored.iter().find_map(|shown| Some((shown.clone(), recorded(shown)?)).filter(|(shown, recorded)| shown.value != *recorded));
        if let Some((shown, recorded)) = found {
            difference.svv = shown.name;
            difference.type_text = shown.type_text;
            difference.replayed = shown.value;
            difference.recorded = recorded;
        }
    }
}

impl Companion for Again {
    fn end(&self) {
        self.stop();
    }

    fn as_any(self: Arc<Self>) -> Arc<dyn Any + Send + Sync> {
        self
    }
}
