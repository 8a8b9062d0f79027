// SPDX-License-Identifier: Apache-2.0
//! kill -9 in each phase of a driver's life: what the guard has then works, and the next process can open the device.
use super::rest::write;
use super::rig::Rig;
use super::serve::LINK;
use super::watch::Settings;
use super::{Outcome, Passed, Subject, Tried, Verdict};
use device::SafeHandle;
use interconnect::Link;
use process_kit::{Launch, UnixLink};
use serde_json::{Value, json};
use std::os::fd::{AsFd, BorrowedFd};
use std::time::Duration;

/// Where a process is when it is killed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Phase {
    Made,
    Opened,
    Read,
    Engaged,
    Closed,
}

const PHASES: [(Phase, &str, &str); 5] = [
    (Phase::Made, "kill-made", "killed when it was made, it can be opened by the next process"),
    (Phase::Opened, "kill-opened", "killed when it was opened, it can be opened by the next process"),
    (Phase::Read, "kill-read", "killed between reading and writing, it can be opened by the next process"),
    (Phase::Engaged, "kill-engaged", "killed while its parts are engaged, its handles take what the guard writes, and the next process can open it"),
    (Phase::Closed, "kill-closed", "killed when it was closed, it can be opened by the next process"),
];

/// Any wait for a process: only to end one that hangs.
const LIMIT: Duration = Duration::from_secs(60);

impl Phase {
    pub(super) fn of(name: &str) -> Option<Phase> {
        PHASES.iter().find(|(_, known, _)| *known == name).map(|(phase, ..)| *phase)
    }
}

/// In the process that is killed: lives up to the phase, says so, and stays there.
pub(super) fn live(subject: &Subject, phase: Phase, link: &UnixLink) -> Result<(), String> {
    match up_to(subject, phase) {
        Err(why) => tell(link, &json!({ "failed": why }), &[]),
        Ok(rig) => {
            // What the guard has before it begins to command: asked for once.
            let handles = if matches!(phase, Phase::Made | Phase::Closed) { Vec::new() } else { rig.driver.safe_handles() };
            let writes: Vec<Value> = handles.iter().map(|handle| json!(handle.writes)).collect();
            let descriptors: Vec<BorrowedFd<'_>> = handles.iter().map(|handle| handle.descriptor.as_fd()).collect();
            tell(link, &json!({ "reached": writes }), &descriptors)?;
            // Until it is killed; or who killed it is gone itself.
            let _ = link.receive(LIMIT);
            std::mem::forget(rig);
            Ok(())
        }
    }
}

fn tell(link: &UnixLink, news: &Value, descriptors: &[BorrowedFd<'_>]) -> Result<(), String> {
    link.send_with(news.to_string().as_bytes(), descriptors, Some(LIMIT)).map_err(|_| "who started it is gone".to_owned())
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

/// One after the other; from who started the checks.
pub(super) fn outcomes(kind: &str, options: &Value, settings: &Settings) -> Vec<Outcome> {
    let outcome = |(_, name, sentence): &(Phase, &str, &str)| Outcome {
        check: (*name).to_owned(),
        sentence: (*sentence).to_owned(),
        verdict: match killed(kind, options, name, settings) {
            Ok(Passed::Yes) => Verdict::Passed,
            Ok(Passed::NotApplicable(why)) => Verdict::NotApplicable(why.to_owned()),
            Err(cause) => Verdict::Failed(cause),
        },
    };
    PHASES.iter().map(outcome).collect()
}

/// Kills one process in that phase, does what the guard does, and has another one open the device.
fn killed(kind: &str, options: &Value, phase: &str, settings: &Settings) -> Tried {
    let handles = reached(kind, options, phase, settings)?;
    handles.into_iter().try_for_each(write).map_err(|why| format!("a handle of the guard: {why}"))?;
    reached(kind, options, "kill-engaged", settings).map_err(|why| format!("the next process: {why}"))?;
    Ok(Passed::Yes)
}

/// Has a process live up to a phase and kills it there; what the guard has then.
fn reached(kind: &str, options: &Value, phase: &str, settings: &Settings) -> Result<Vec<SafeHandle>, String> {
    let (link, theirs) = UnixLink::pair().map_err(|why| why.to_string())?;
    let child = Launch::new(settings.command.iter().cloned()).descriptor(LINK, theirs).start().map_err(|why| why.to_string())?;
    tell(&link, &json!({ "kind": kind, "options": options, "phase": phase }), &[])?;
    let frame = link.receive_with(LIMIT).map_err(|_| format!("its process ended: {}", ended(&child)))?;
    let (bytes, descriptors) = frame.ok_or_else(|| format!("it has not come so far within {} s", LIMIT.as_secs()))?;
    child.kill();
    child.wait(LIMIT).ok_or("its process does not end when it is killed")?;
    let news: Value = serde_json::from_slice(&bytes).map_err(|why| why.to_string())?;
    if let Some(why) = news["failed"].as_str().or_else(|| news["unknown"].as_str()) {
        return Err(why.to_owned());
    }
    let writes: Vec<Vec<(u64, Vec<u8>)>> = serde_json::from_value(news["reached"].clone()).map_err(|why| why.to_string())?;
    Ok(descriptors.into_iter().zip(writes).map(|(descriptor, writes)| SafeHandle { descriptor, writes, latches: false }).collect())
}

fn ended(child: &process_kit::Child) -> String {
    child.wait(LIMIT).map_or_else(|| "it has not".to_owned(), |status| status.to_string())
}
