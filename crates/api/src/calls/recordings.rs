// SPDX-License-Identifier: Apache-2.0
//! Recordings: begin one, look at it, end it; run one again.
use crate::effect::Effect;
use crate::sure;
use model::refusal::{Class, Refusal, Refusals};
use recorder::{Again, Options, Recorder, Replaying, Summary};
use schemars::JsonSchema;
use serde::Serialize;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use supervisor::System;

/// Time for which one call waits for the end of a recording: a slow disk may take longer.
const END_MAX: Duration = Duration::from_millis(500);

/// A recording that has begun.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "RecordingBegun")]
struct StartedRecording {
    /// Its number.
    recording: u64,
}

/// A replay that has begun.
#[derive(Serialize, JsonSchema)]
struct ReplayBegun {
    /// Its number.
    replay: u64,
}

crate::calls! {
    /// Recordings.
    pub(super) const RECORDINGS about "recordings" = [
        /// Begins to record into a new MCAP file. Returns its number.
        Configure record(
            must path: PathBuf,
            /// Names of SVVs, with * and ?; all where they are left out.
            may svvs: Option<Vec<String>>,
            /// The private cells of all verb instances too.
            may cells: bool,
            /// Everything that comes from outside too, so that the run can be run again.
            may replay: bool,
            /// Bytes of a file, about, from which on the next one begins: run.mcap, run-2.mcap and so on. A recording for a replay has none.
            may split_bytes: Option<u64>,
            /// Files that stay where the recording is split; the oldest goes. All where it is left out.
            may keep: Option<u32>,
            /// Identity of the recording, which its files have in their metadata. Over the control interface the daemon gives it one.
            may identity: Option<String>,
            /// true: goes on behind the files of that path that are there, and those of this identity count for `keep`. Over the control
            /// interface it is the daemon's own, and is left out.
            may resumes: bool,
        ) -> StartedRecording: replaces(&["path"]), goes_with("stop_recording", "path"), record_path("path"), record_resumes("identity", "resumes"), effect(Effect::BeginsRecording)
            => |system| {
                let options = Options { svvs: svvs.unwrap_or_else(|| Options::default().svvs), cells, replay, split_bytes, keep, identity, resumes };
                Recorder::start(system, &path, &options).map(|(recording, _)| StartedRecording { recording })
            };
        /// Returns how a recording stands.
        Observe recording(must recording: u64) -> Summary
            => |system| sure(of(system, recording)?.summary());
        /// Ends a recording. Returns how it stands; where it still runs, it is to be called again.
        Configure stop_recording(must recording: u64) -> Summary: outcome_journalled, effect(Effect::EndsRecording)
            => |system, slice| sure(of(system, recording)?.stop_within(slice.min(END_MAX)));
        /// Begins to run a recording again, in a process of its own beside the system, which it does not touch, and compares every value. Returns
        /// its number. Code modules that the recording brings run only where their SHA-256 digests are those of modules that the system has
        /// had, or are in `trust`.
        Configure replay(
            must path: PathBuf,
            /// Digests of code modules that may run. Over the control interface they are the daemon's own, and are left out.
            may trust: Vec<String>,
            /// true: the modules of the same names that the system has now take the place of the recording's; then the first difference is of them.
            may present: bool,
        ) -> ReplayBegun: unjournalled, free, costs, record_path("path"), trusts("trust")
            => |system| Again::start(system, &path, trust, present).map(|replay| ReplayBegun { replay });
        /// Returns how a replay stands.
        Observe replaying(must replay: u64) -> Replaying
            => |system| sure(again(system, replay)?.standing());
        /// Ends a replay where it is, and forgets it. Returns how it stood.
        Configure stop_replay(must replay: u64) -> Replaying: unjournalled, free
            => |system| {
                let ended = again(system, replay)?;
                ended.stop();
                system.dismiss(replay);
                sure(ended.standing())
            };
    ];
}

/// Returns true if a recording of this number is under way.
pub fn is_recording(system: &System, number: u64) -> bool {
    of(system, number).is_ok_and(|recorder| recorder.summary().running)
}

fn of(system: &System, number: u64) -> Result<Arc<Recorder>, Refusals> {
    let found = system.companion(number).and_then(|companion| companion.as_any().downcast::<Recorder>().ok());
    found.ok_or_else(|| vec![Refusal::new(Class::UnknownName, format!("there is no recording {number}")).remedy("take the number that 'record' gave")])
}

fn again(system: &System, number: u64) -> Result<Arc<Again>, Refusals> {
    let found = system.companion(number).and_then(|companion| companion.as_any().downcast::<Again>().ok());
    found.ok_or_else(|| vec![Refusal::new(Class::UnknownName, format!("there is no replay {number}")).remedy("take the number that 'replay' gave")])
}
