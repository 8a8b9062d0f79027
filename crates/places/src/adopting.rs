// SPDX-License-Identifier: Apache-2.0
//! Adoption: a new supervisor finds a processor's process that has lost its own, and both speak before the greeting.
//!
//! Each process of a processor listens at a socket in the folder of this user's sockets, named for its system, what it is
//! called there (as its processor, or as those that share it name it) and itself. Who
//! connects says whom it looks for. A process that may be taken over answers with a descriptor of itself, its heartbeat and the path of
//! its guard; then it is told the run of the new system, and given the way of safe handles and the memory of the black box. From there on
//! it is greeted like one that was just started.
use crate::text;
use interconnect::Link;
use process_kit::{Frame, Heartbeat, UnixLink, connect, is_abandoned, run_folder};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io::ErrorKind;
use std::os::fd::{AsFd, OwnedFd};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Bound for the answer of the other side, which may be about to let somebody else in.
pub(crate) const ANSWER: Duration = Duration::from_secs(30);

/// Version of the messages, which must be that of the other side.
const VERSION: u32 = 2;

/// Names of the sockets: of processes of processors, of guards.
const PROCESSOR: &str = "rtp-";
const GUARD: &str = "guard-";

/// Bytes of the path of a socket; the second process of a guard puts one more behind its path.
const PATH_LEN_MAX: usize = 106;

/// From who looks for a processor.
#[derive(Serialize, Deserialize)]
pub(crate) struct Knock {
    version: u32,
    system: String,
    /// Name of its process.
    processor: String,
}

impl Knock {
    /// Returns whether this process is meant.
    pub fn means(&self, system: &str, processor: &str) -> bool {
        self.version == VERSION && self.system == system && self.processor == processor
    }
}

/// The answer.
#[derive(Serialize, Deserialize)]
pub(crate) enum AdoptionAnswer {
    /// It may come in. Descriptors: the process, its heartbeat.
    Come { guard: Option<PathBuf> },
    /// It is another processor.
    Other,
    /// Not now, and why.
    Refused { why: String },
}

/// From who comes in. Descriptors: the way of safe handles, the black box, the hearts of the guard and of who comes.
#[derive(Serialize, Deserialize)]
pub(crate) struct Enter {
    pub run: u64,
    pub guard: Option<PathBuf>,
    /// The guard before is gone.
    pub is_unguarded: bool,
}

/// A process that waits for a new supervisor, and has answered.
pub(crate) struct WaitingProcess {
    pub link: UnixLink,
    pub guard: Option<PathBuf>,
    pub process: OwnedFd,
    pub heart: Heartbeat,
}

/// The process of this name that has lost its system. None where there is none. Errors: it must not be taken over, in words.
pub(crate) fn find(system: &str, processor: &str) -> Result<Option<WaitingProcess>, String> {
    let Ok(folder) = run_folder() else { return Ok(None) };
    let prefix = prefix(system, processor);
    for path in sockets(&folder).filter(|path| name(path).starts_with(&prefix)) {
        let link = match connect(&path) {
            Ok(link) => link,
            Err(why) => {
                if why.kind() == ErrorKind::ConnectionRefused {
                    // Its maker was killed. Gone meanwhile is as good.
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
    // One that ends meanwhile is not there to be taken over.
    let Ok(Some((frame, descriptors))) = link.receive_with(ANSWER) else { return Ok(None) };
    match heard(&frame)? {
        AdoptionAnswer::Other => Ok(None),
        AdoptionAnswer::Refused { why } => Err(format!("its process cannot be taken over: {why}")),
        AdoptionAnswer::Come { guard } => {
            let [process, heart] = <[OwnedFd; 2]>::try_from(descriptors).map_err(|_| "what answers there is no processor".to_owned())?;
            let heart = Heartbeat::received(heart).map_err(text)?;
            Ok(Some(WaitingProcess { link, guard, process, heart }))
        }
    }
}

/// Returns the path at which the process `pid` of a processor listens; none where this user has no folder for it.
pub(crate) fn place(system: &str, processor: &str, pid: u32) -> Option<PathBuf> {
    socket(format!("{}{pid}", prefix(system, processor)))
}

/// Returns the path at which the guard of a run of a system listens.
pub(crate) fn guard_place(run: u64) -> Option<PathBuf> {
    socket(format!("{GUARD}{run:016x}"))
}

/// A socket in the folder of this user; none where there is no folder, or its path is too long for a socket.
fn socket(name: String) -> Option<PathBuf> {
    run_folder().ok().map(|folder| folder.join(name)).filter(|path| path.as_os_str().len() <= PATH_LEN_MAX)
}

/// Removes the sockets of processes and guards that were killed.
pub(crate) fn clean() {
    let Ok(folder) = run_folder() else { return };
    let left = |path: &PathBuf| (name(path).starts_with(PROCESSOR) || name(path).starts_with(GUARD)) && is_abandoned(path);
    for path in sockets(&folder).filter(left) {
        // Gone meanwhile is as good.
        let _removed = std::fs::remove_file(path);
    }
}

/// Sends a message with descriptors.
pub(crate) fn say(link: &UnixLink, message: &impl Serialize, descriptors: &[&OwnedFd]) -> Result<(), String> {
    let bytes = serde_json::to_vec(message).map_err(text)?;
    let borrowed: Vec<_> = descriptors.iter().map(|descriptor| descriptor.as_fd()).collect();
    link.send_with(&bytes, &borrowed, Some(ANSWER)).map_err(text)
}

/// Decodes a message. Errors: it is none, in words.
pub(crate) fn heard<T: DeserializeOwned>(frame: &[u8]) -> Result<T, String> {
    serde_json::from_slice(frame).map_err(|why| format!("what was said is of another version: {why}"))
}

/// The next message, at once or within the limit.
pub(crate) fn next(link: &UnixLink, limit: Duration) -> Result<Frame, String> {
    link.receive_with(limit).map_err(text)?.ok_or_else(|| {
        link.close();
        "nothing was said".to_owned()
    })
}

/// Paths of sockets are short, names of systems need not be.
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
