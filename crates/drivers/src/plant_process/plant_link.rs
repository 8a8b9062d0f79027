// SPDX-License-Identifier: Apache-2.0
//! Finds and queries plants: a socket by name, and one answer per request.
use super::plant_messages::{Answer, Ask};
use process_kit::{UnixLink, run_folder};
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::time::Duration;

/// Time limit for a plant to be created, to load and to describe itself.
pub(super) const ANSWER: Duration = Duration::from_secs(120);
/// Prefix of the socket of a named plant.
pub(super) const SOCKET: &str = "plant-";
/// Name of the descriptor of the link to the first client.
pub(super) const LINK: &str = "link";
/// Name of the link for services of a driver in a process of its own. It is separate because services may take a long time, and no other
/// message must wait for them.
pub(super) const SERVICES: &str = "services";

/// Returns the path at which the plant with that name listens.
pub(super) fn place(name: &str) -> std::io::Result<PathBuf> {
    Ok(run_folder()?.join(format!("{SOCKET}{name}")))
}

/// Sends a request to a plant. Returns its answer; the error is a message.
pub(super) fn ask(link: &UnixLink, ask: Ask) -> Result<Answer, String> {
    ask_with(link, ask).map(|(answer, _)| answer)
}

pub(super) fn ask_with(link: &UnixLink, ask: Ask) -> Result<(Answer, Vec<OwnedFd>), String> {
    ask_within(link, ask, ANSWER)
}

pub(super) fn ask_within(link: &UnixLink, ask: Ask, limit: Duration) -> Result<(Answer, Vec<OwnedFd>), String> {
    let gone = |_| "its process has exited".to_owned();
    let frame = serde_json::to_vec(&ask).expect("a request has no map whose keys are not texts");
    link.send_with(&frame, &[], Some(limit)).map_err(gone)?;
    let (frame, descriptors) = link.receive_with(limit).map_err(gone)?.ok_or_else(|| format!("its process did not answer within {} s", limit.as_secs()))?;
    let answer = serde_json::from_slice(&frame).map_err(|_| "its process returned an invalid answer".to_owned())?;
    Ok((answer, descriptors))
}
