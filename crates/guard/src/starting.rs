// SPDX-License-Identifier: Apache-2.0
//! First messages exchanged with a guard process that is being started or taken over.
use crate::guard_event::{GuardCommand, GuardError};
use crate::messages::{Ask, GuardRequest, Tell, encode};
use crate::registry::Registry;
use crate::serve::{HEART, Hearts, LINK, PATH, STANDS_IN, SUPERVISOR};
use interconnect::LinkClosed;
use process_kit::{Child, Heartbeat, Launch, UnixLink};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::path::Path;
use std::time::Duration;

/// Timeout for the guard's answer.
pub(crate) const ANSWER: Duration = Duration::from_secs(10);

/// Sends a request with its descriptors.
pub(crate) fn send(link: &UnixLink, request: u64, ask: Ask, descriptors: &[OwnedFd]) -> Result<(), LinkClosed> {
    let borrowed: Vec<BorrowedFd<'_>> = descriptors.iter().map(AsFd::as_fd).collect();
    link.send_with(&encode(&GuardRequest { request, ask }), &borrowed, Some(ANSWER))
}

/// Starts a guard process. With `stands_in`, it guards like any other, but beats and listens only when it is asked to [lead](Ask::Lead),
/// and it is started at the priority of the calling thread.
pub(crate) fn launch(command: &GuardCommand, hearts: &Hearts, stands_in: bool) -> Result<(UnixLink, Child), GuardError> {
    let (link, theirs) = UnixLink::pair().map_err(|error| GuardError(format!("cannot create a link to a guard: {error}")))?;
    let [heart, supervisor] = hearts.descriptors().map_err(|error| GuardError(format!("cannot create a descriptor for a guard: {error}")))?;
    let mut launch = Launch::new(command.command.iter().cloned()).descriptor(LINK, theirs).descriptor(HEART, heart).descriptor(SUPERVISOR, supervisor);
    if let Some(path) = &command.path {
        launch = launch.variable(PATH, path);
    }
    if stands_in {
        launch = launch.variable(STANDS_IN, "1").urgently();
    }
    let child = launch.start().map_err(|error| GuardError(error.to_string()))?;
    Ok((link, child))
}

/// Returns the registrations and heartbeats that a guard sends to the supervisor that adopts it, and the privileges that it lacks.
pub(crate) fn tale(link: &UnixLink, path: &Path) -> Result<(Registry, Hearts, Vec<String>), GuardError> {
    let silent = || GuardError(format!("the process that listens at '{}' does not answer like a guard", path.display()));
    let (mut registry, mut hearts, mut lacks) = (Registry::default(), None, Vec::new());
    send(link, 0, Ask::Adopt, &[]).map_err(|LinkClosed| silent())?;
    loop {
        let (frame, descriptors) = link.receive_with(ANSWER).map_err(|LinkClosed| silent())?.ok_or_else(silent)?;
        match serde_json::from_slice::<Tell>(&frame).map_err(|_| silent())? {
            Tell::Hello { missing } => lacks = missing,
            Tell::Hearts => {
                let both = descriptors.into_iter().map(Heartbeat::received).collect::<Result<Vec<_>, _>>().map_err(|_| silent())?;
                let [guard, supervisor] = <[Heartbeat; 2]>::try_from(both).map_err(|_| silent())?;
                hearts = Some(Hearts { guard, supervisor });
            }
            Tell::Ward(text) => registry.told_ward(text, descriptors).ok_or_else(silent)?,
            Tell::Handle(text) => registry.told_handle(text, descriptors).ok_or_else(silent)?,
            Tell::Lost(loss) => {
                registry.lose(&loss);
            }
            Tell::MadeSafe(_) | Tell::GoesOn { .. } => {}
            Tell::Done { .. } => return Ok((registry, hearts.ok_or_else(silent)?, lacks)),
            Tell::Refused { problem, .. } => return Err(GuardError(problem)),
        }
    }
}
