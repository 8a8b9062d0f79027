// SPDX-License-Identifier: Apache-2.0
//! Adoption: a new supervisor finds the process of a processor that has lost its own supervisor, and the two exchange messages before the
//! greeting.
//!
//! Each process of a processor listens on a socket in this user's socket folder, named after its system, its processor (or the common
//! name of several), and itself. A connecting supervisor names the processor that it is looking for. A process that may be taken over
//! answers with a descriptor of itself, its heartbeat and the path of its guard; it then receives the run number of the new system, the
//! link for safe handles and the memory of the black box. After that, it is greeted like a process that was just started.
use crate::text;
use interconnect::Link;
use process_kit::{Frame, Heartbeat, UnixLink, connect, is_abandoned, run_folder};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io::ErrorKind;
use std::os::fd::{AsFd, OwnedFd};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Timeout for the other side's answer; that side may be admitting another supervisor.
pub(crate) const ANSWER: Duration = Duration::from_secs(30);

/// Version of the messages, which must be the same on both sides.
const VERSION: u32 = 2;

/// Name prefixes of the sockets of processors' processes and of guards.
const PROCESSOR: &str = "rtp-";
const GUARD: &str = "guard-";

/// Maximum length of a socket's path in bytes; the second process of a guard appends one more byte.
const PATH_LEN_MAX: usize = 106;

/// Message of a supervisor that is looking for a processor.
#[derive(Serialize, Deserialize)]
pub(crate) struct Knock {
    version: u32,
    system: String,
    /// Name of the processor's process.
    processor: String,
}

impl Knock {
    /// Returns true if the knock is addressed to this process.
    pub fn means(&self, system: &str, processor: &str) -> bool {
        self.version == VERSION && self.system == system && self.processor == processor
    }
}

/// Answer to a knock.
#[derive(Serialize, Deserialize)]
pub(crate) enum AdoptionAnswer {
    /// The supervisor may enter. Descriptors: the process, its heartbeat.
    Come { guard: Option<PathBuf> },
    /// This is a different processor.
    Other,
    /// Refused for now, for this reason.
    Refused { why: String },
}

/// Message of a supervisor that enters. Descriptors: the link for safe handles, the black box, the heartbeats of the guard and of the
/// supervisor.
#[derive(Serialize, Deserialize)]
pub(crate) struct Enter {
    pub run: u64,
    pub guard: Option<PathBuf>,
    /// True if the previous guard has exited.
    pub is_unguarded: bool,
}

/// A process that waits for a new supervisor and has answered the knock.
pub(crate) struct WaitingProcess {
    pub link: UnixLink,
    pub guard: Option<PathBuf>,
    pub process: OwnedFd,
    pub heart: Heartbeat,
}

/// Returns the process of this name that has lost its system; `None` if there is none. Fails with a message if it must not be taken over.
pub(crate) fn find(system: &str, processor: &str) -> Result<Option<WaitingProcess>, String> {
    let Ok(folder) = run_folder() else { return Ok(None) };
    let prefix = prefix(system, processor);
    for path in sockets(&folder).filter(|path| name(path).starts_with(&prefix)) {
        let link = match connect(&path) {
            Ok(link) => link,
            Err(why) => {
                if why.kind() == ErrorKind::ConnectionRefused {
                    // Its maker was killed. The file may have been removed meanwhile.
                    let _removed = std::fs::remove_file(&path);
                }
                continue;
            }
        };
        if let Some(waiting) = ask(link, system, processor)? {
            return Ok(Some(waiting));
        }
    }
    Ok(None)
}

fn ask(link: UnixLink, system: &str, processor: &str) -> Result<Option<WaitingProcess>, String> {
    let knock = Knock { version: VERSION, system: system.to_owned(), processor: processor.to_owned() };
    if say(&link, &knock, &[]).is_err() {
        return Ok(None);
    }
    // A process that ends meanwhile cannot be taken over.
    let Ok(Some((frame, descriptors))) = link.receive_with(ANSWER) else { return Ok(None) };
    match heard(&frame)? {
        AdoptionAnswer::Other => Ok(None),
        AdoptionAnswer::Refused { why } => Err(format!("its process cannot be taken over: {why}")),
        AdoptionAnswer::Come { guard } => {
            let [process, heart] = <[OwnedFd; 2]>::try_from(descriptors).map_err(|_| "the process that answers there is not a processor".to_owned())?;
            let heart = Heartbeat::received(heart).map_err(text)?;
            Ok(Some(WaitingProcess { link, guard, process, heart }))
        }
    }
}

/// Returns the path at which process `pid` of a processor listens; `None` if this user has no folder for it.
pub(crate) fn place(system: &str, processor: &str, pid: u32) -> Option<PathBuf> {
    socket(format!("{}{pid}", prefix(system, processor)))
}

/// Returns the path at which the guard of a run of a system listens.
pub(crate) fn guard_place(run: u64) -> Option<PathBuf> {
    socket(format!("{GUARD}{run:016x}"))
}

/// Returns a socket path in this user's folder; `None` if there is no folder, or the path is too long for a socket.
fn socket(name: String) -> Option<PathBuf> {
    run_folder().ok().map(|folder| folder.join(name)).filter(|path| path.as_os_str().len() <= PATH_LEN_MAX)
}

/// Removes the sockets left behind by killed processes and guards.
pub(crate) fn clean() {
    let Ok(folder) = run_folder() else { return };
    let left = |path: &PathBuf| (name(path).starts_with(PROCESSOR) || name(path).starts_with(GUARD)) && is_abandoned(path);
    for path in sockets(&folder).filter(left) {
        // It may have been removed meanwhile.
        let _removed = std::fs::remove_file(path);
    }
}

/// Sends a message with descriptors.
pub(crate) fn say(link: &UnixLink, message: &impl Serialize, descriptors: &[&OwnedFd]) -> Result<(), String> {
    let bytes = serde_json::to_vec(message).map_err(text)?;
    let borrowed: Vec<_> = descriptors.iter().map(|descriptor| descriptor.as_fd()).collect();
    link.send_with(&bytes, &borrowed, Some(ANSWER)).map_err(text)
}

/// Decodes a message. Fails if the bytes are not a message.
pub(crate) fn heard<T: DeserializeOwned>(frame: &[u8]) -> Result<T, String> {
    serde_json::from_slice(frame).map_err(|why| format!("the message is of another version: {why}"))
}

/// Returns the next message. Waits for at most `limit`.
pub(crate) fn next(link: &UnixLink, limit: Duration) -> Result<Frame, String> {
    link.receive_with(limit).map_err(text)?.ok_or_else(|| {
        link.close();
        "there was no message".to_owned()
    })
}

/// Returns a short prefix, because the length of a socket path is limited but the length of a system's name is not.
fn prefix(system: &str, processor: &str) -> String {
    let words = system.bytes().chain([0]).chain(processor.bytes());
    let hash = words.fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    format!("{PROCESSOR}{hash:016x}-")
}

fn sockets(folder: &Path) -> impl Iterator<Item = PathBuf> {
    std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path())
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
