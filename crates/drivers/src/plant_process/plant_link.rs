// SPDX-License-Identifier: Apache-2.0
//! Finding and asking a plant: its socket by its name, one answer to one question.
use super::plant_messages::{Answer, Ask};
use process_kit::{UnixLink, run_folder};
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::time::Duration;

/// Time limit for a plant to make, load and describe itself.
pub(super) const ANSWER: Duration = Duration::from_secs(120);
/// Prefix of the socket of a plant that others find by its name.
pub(super) const SOCKET: &str = "plant-";
/// The name of the descriptor of the first link.
pub(super) const LINK: &str = "link";
/// Name of the link over which a driver in a process of its own is asked for services: they last, and no other message waits for them.
pub(super) const SERVICES: &str = "services";

/// Returns the path at which the plant of that name listens.
pub(super) fn place(name: &str) -> std::io::Result<PathBuf> {
    Ok(run_folder()?.join(format!("{SOCKET}{name}")))
}

/// Asks a plant; its answer, or in words why there is none.
pub(super) fn ask(link: &UnixLink, ask: Ask) -> Result<Answer, String> {
    ask_with(link, ask).map(|(answer, _)| answer)
}

pub(super) fn ask_with(link: &UnixLink, ask: Ask) -> Result<(Answer, Vec<OwnedFd>), String> {
    ask_within(link, ask, ANSWER)
}

pub(super) fn ask_within(link: &UnixLink, ask: Ask, limit: Duration) -> Result<(Answer, Vec<OwnedFd>), String> {
    let gone = |_| "its process is gone".to_owned();
    let frame = serde_json::to_vec(&ask).expect("an ask has no map with keys that are no texts");
    link.send_with(&frame, &[], Some(limit)).map_err(gone)?;
    let (frame, descriptors) = link.receive_with(limit).map_err(gone)?.ok_or_else(|| format!("its process does not answer for {} s", limit.as_secs()))?;
    let answer = serde_json::from_slice(&frame).map_err(|_| "its process answers what no plant does".to_owned())?;
    Ok((answer, descriptors))
}
