// SPDX-License-Identifier: Apache-2.0
//! Life cycle of a driver up to a phase, in the process that is killed there.
use super::orders::{LIMIT, tell};
use super::rig::Rig;
use super::subject::Subject;
use interconnect::Link;
use process_kit::UnixLink;
use serde_json::{Value, json};
use std::os::fd::{AsFd, BorrowedFd};

/// Phase in which a process is killed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Phase {
    Made,
    Opened,
    Read,
    Engaged,
    Closed,
}

pub(super) const PHASES: [(Phase, &str, &str); 5] = [
    (Phase::Made, "kill-made", "if it is killed after it was created, the next process can open it"),
    (Phase::Opened, "kill-opened", "if it is killed after it was opened, the next process can open it"),
    (Phase::Read, "kill-read", "if it is killed between reading and writing, the next process can open it"),
    (Phase::Engaged, "kill-engaged", "if it is killed while its parts are engaged, its handles accept what the guard writes, and the next process can open it"),
    (Phase::Closed, "kill-closed", "if it is killed after it was closed, the next process can open it"),
];

impl Phase {
    pub(super) fn of(name: &str) -> Option<Phase> {
        PHASES.iter().find(|(_, known, _)| *known == name).map(|(phase, ..)| *phase)
    }
}

/// Takes the driver through its life cycle up to the phase, reports the phase, and stays in it.
pub(super) fn live(subject: &Subject, phase: Phase, link: &UnixLink) -> Result<(), String> {
    match up_to(subject, phase) {
        Err(why) => tell(link, &json!({ "failed": why }), &[]),
        Ok(rig) => {
            // The handles that the guard has before it begins to command, requested once.
            let handles = if matches!(phase, Phase::Made | Phase::Closed) { Vec::new() } else { rig.driver.safe_handles() };
            let writes: Vec<Value> = handles.iter().map(|handle| json!(handle.writes)).collect();
            let descriptors: Vec<BorrowedFd<'_>> = handles.iter().map(|handle| handle.descriptor.as_fd()).collect();
            tell(link, &json!({ "reached": writes }), &descriptors)?;
            // Until this process is killed, or the other side has exited.
            let _ = link.receive(LIMIT);
            std::mem::forget(rig);
            Ok(())
        }
    }
}

fn up_to(subject: &Subject, phase: Phase) -> Result<Rig, String> {
    let mut rig = Rig::new(subject.made()?);
    if phase == Phase::Made {
        return Ok(rig);
    }
    rig.open()?;
    match phase {
        Phase::Made | Phase::Opened => {}
        Phase::Read => rig.read()?,
        Phase::Engaged => {
            let joints = rig.joints();
            rig.read()?;
            rig.hold(&joints);
            rig.write()?;
        }
        Phase::Closed => rig.driver.close(),
    }
    Ok(rig)
}
