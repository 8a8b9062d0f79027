// SPDX-License-Identifier: Apache-2.0
//! Calls for recordings: start, inspect, end and replay them.
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

/// Maximum time for which one call waits for a recording to end; a slow disk may take longer.
const END_MAX: Duration = Duration::from_millis(500);

/// Answer to the call that starts a recording.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "RecordingBegun")]
struct StartedRecording {
    /// Number of the recording.
    recording: u64,
}

/// Answer to the call that starts a replay.
#[derive(Serialize, JsonSchema)]
struct ReplayBegun {
    /// Number of the replay.
    replay: u64,
}

crate::calls! {
    /// Calls for recordings.
    pub(super) const RECORDINGS about "recordings" = [
        /// Starts recording to a new MCAP file. Returns the number of the recording.
        Operate record(
            must path: PathBuf,
            /// Names of SVVs, with * and ? as wildcards; all SVVs if omitted.
            may svvs: Option<Vec<String>>,
            /// True to include the private cells of all verb instances.
            may cells: bool,
            /// True to include all external inputs, so that the run can be replayed.
            may replay: bool,
            /// Approximate file size, bytes, at which the next file is started: run.mcap, run-2.mcap and so on. A recording for replay
            /// cannot be split.
            may split_bytes: Option<u64>,
            /// Number of files to keep if the recording is split (the oldest is deleted); all if omitted.
            may keep: Option<u32>,
            /// Identity of the recording, stored in the metadata of its files. Over the control interface, it is set by the daemon.
            may identity: Option<String>,
            /// True to continue after the existing files at that path; those with this identity then count towards `keep`. Over the
            /// control interface, it is set by the daemon and must be omitted.
            may resumes: bool,
        ) -> StartedRecording: commands("path"), journalled, replaces(&["path"]), goes_with("stop_recording", "path"), record_path("path"), record_resumes("identity", "resumes"), effect(Effect::BeginsRecording)
            => |system| {
                let options = Options { svvs: svvs.unwrap_or_else(|| Options::default().svvs), cells, replay, split_bytes, keep, identity, resumes };
                Recorder::start(system, &path, &options).map(|(recording, _)| StartedRecording { recording })
            };
        /// Returns the state of a recording.
        Observe recording(must recording: u64) -> Summary
            => |system| sure(of(system, recording)?.summary());
        /// Ends a recording. Returns its state; if the recording has not ended yet, call again.
        Operate stop_recording(must recording: u64) -> Summary: commands("recording"), outcome_journalled, effect(Effect::EndsRecording)
            => |system, slice| sure(of(system, recording)?.stop_within(slice.min(END_MAX)));
        /// Starts to replay a recording in a separate process, without affecting the system, and compares every value. Returns the number
        /// of the replay. Code modules in the recording run only if their SHA-256 digests match modules that the system has loaded at
        /// some time, or are in `trust`.
        Configure replay(
            must path: PathBuf,
            /// Digests of code modules that may run. Over the control interface, they are set by the daemon and must be omitted.
            may trust: Vec<String>,
            /// True to replace modules of the recording with the system's current modules of the same names; the first difference is then
            /// caused by them.
            may present: bool,
        ) -> ReplayBegun: unjournalled, free, costs, record_path("path"), trusts("trust")
            => |system| Again::start(system, &path, trust, present).map(|replay| ReplayBegun { replay });
        /// Returns the state of a replay.
        Observe replaying(must replay: u64) -> Replaying
            => |system| sure(again(system, replay)?.standing());
        /// Stops a replay at its current position and deletes it. Returns its final state.
        Configure stop_replay(must replay: u64) -> Replaying: unjournalled, free
            => |system| {
                let ended = again(system, replay)?;
                ended.stop();
                system.dismiss(replay);
                sure(ended.standing())
            };
    ];
}

/// Returns true if a recording with this number is in progress.
pub fn is_recording(system: &System, number: u64) -> bool {
    of(system, number).is_ok_and(|recorder| recorder.summary().running)
}

fn of(system: &System, number: u64) -> Result<Arc<Recorder>, Refusals> {
    let found = system.companion(number).and_then(|companion| companion.as_any().downcast::<Recorder>().ok());
    found.ok_or_else(|| vec![Refusal::new(Class::UnknownName, format!("there is no recording {number}")).remedy("use the number that 'record' returned")])
}

fn again(system: &System, number: u64) -> Result<Arc<Again>, Refusals> {
    let found = system.companion(number).and_then(|companion| companion.as_any().downcast::<Again>().ok());
    found.ok_or_else(|| vec![Refusal::new(Class::UnknownName, format!("there is no replay {number}")).remedy("use the number that 'replay' returned")])
}
