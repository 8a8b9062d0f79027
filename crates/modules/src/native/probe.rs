// SPDX-License-Identifier: Apache-2.0
//! Sacrificial child that loads a module and walks its tables, so that a bad file crashes the child instead of this process.

use std::collections::HashSet;
use std::ffi::{OsStr, OsString};
use std::hash::{BuildHasher, RandomState};
use std::io::Read;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{LazyLock, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Probe in Python, for installations that have the interpreter but not `opengpac-probe`: [`Probe::python`]. Requires only the standard
/// library.
pub const PYTHON_PROBE: &str = include_str!("probe.py");

/// Command of the child, to which the path of the module is appended. It prints one line: `ok`, `abi N`, `nosymbol`, `noload TEXT` or
/// `damaged TEXT`.
#[derive(Clone, Debug)]
pub struct Probe {
    pub command: Vec<OsString>,
    /// Time limit for the child.
    pub limit: Duration,
    /// False if no child is started, because the sender of a file has tried it on this host.
    pub is_needed: bool,
}

/// Lengths and hashes of the files that this process has loaded after a child found them sound; the child's command is hashed too.
static SOUND: LazyLock<Mutex<HashSet<(usize, u64)>>> = LazyLock::new(Default::default);
/// Random key of these hashes.
static KEY: LazyLock<RandomState> = LazyLock::new(RandomState::new);

impl Default for Probe {
    /// Returns `opengpac-probe` if it is next to this program, otherwise the Python probe with `python3`; the limit is 10 s.
    fn default() -> Probe {
        let beside = std::env::current_exe().ok().map(|program| program.with_file_name("opengpac-probe")).filter(|program| program.is_file());
        match beside {
            Some(program) => Probe::of([program.into_os_string()]),
            None => Probe::python("python3"),
        }
    }
}

/// Result of the child.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Finding {
    Sound,
    OtherAbi(u32),
    NoSymbol,
    Refused(String),
    Crashed(i32),
    TimedOut,
    /// The child could not be used, for the given reason.
    Unusable(String),
}

impl Probe {
    /// Creates a probe with this command and a limit of 10 s.
    pub fn of(command: impl IntoIterator<Item = OsString>) -> Probe {
        Probe { command: command.into_iter().collect(), limit: Duration::from_secs(10), is_needed: true }
    }

    /// Creates the probe in Python, run by this interpreter without the user's packages: they take half of its start-up time.
    pub fn python(interpreter: impl Into<OsString>) -> Probe {
        Probe::of([interpreter.into(), "-I".into(), "-S".into(), "-c".into(), PYTHON_PROBE.into()])
    }

    /// Returns a probe that starts no child, for a process that only receives files which a supervisor on this host has tried.
    pub fn unneeded() -> Probe {
        Probe { is_needed: false, ..Probe::of([]) }
    }

    /// Returns true if these bytes need no trial: this process has loaded the same bytes after such a trial, or their sender has tried
    /// them.
    pub(super) fn knows(&self, bytes: &[u8]) -> bool {
        !self.is_needed || SOUND.lock().unwrap_or_else(PoisonError::into_inner).contains(&self.key(bytes))
    }

    /// Remembers bytes that have been loaded after a trial.
    pub(super) fn remember(&self, bytes: &[u8]) {
        SOUND.lock().unwrap_or_else(PoisonError::into_inner).insert(self.key(bytes));
    }

    fn key(&self, bytes: &[u8]) -> (usize, u64) {
        (bytes.len(), KEY.hash_one((&self.command, bytes)))
    }

    /// Loads the file in a child. Blocks until the child has finished, but no longer than the time limit.
    pub fn run(&self, file: &Path) -> Finding {
        let Some((program, arguments)) = self.command.split_first() else { return Finding::Unusable("the probe has no command".to_string()) };
        let mut command = Command::new(program);
        command.args(arguments).arg::<&OsStr>(file.as_ref()).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = match command.spawn() {
            Ok(child) => child,
            Err(error) => return Finding::Unusable(format!("the probe '{}' cannot be started: {error}", program.display())),
        };
        let mut output = child.stdout.take().expect("the child was started with a pipe");
        let (done, said) = channel();
        // A separate thread, because the file's code may keep the pipe open.
        std::thread::spawn(move || {
            let mut text = Vec::new();
            let _ = output.read_to_end(&mut text);
            let _ = done.send(String::from_utf8_lossy(&text).trim().to_string());
        });
        let deadline = Instant::now() + self.limit;
        let text = match said.recv_timeout(self.limit) {
            Ok(text) => text,
            Err(RecvTimeoutError::Timeout) => String::new(),
            Err(RecvTimeoutError::Disconnected) => String::new(),
        };
        let status = loop {
            match child.try_wait() {
                Ok(Some(status)) => break status,
                Ok(None) if Instant::now() < deadline => std::thread::sleep(Duration::from_millis(1)),
                _ => {
                    // It may just have ended by itself.
                    let _ = child.kill();
                    let _ = child.wait();
                    return Finding::TimedOut;
                }
            }
        };
        match (status.signal(), text.split_once(' ').unwrap_or((&text, ""))) {
            (Some(signal), _) => Finding::Crashed(signal),
            (None, ("ok", _)) => Finding::Sound,
            (None, ("abi", version)) => Finding::OtherAbi(version.parse().unwrap_or(u32::MAX)),
            (None, ("nosymbol", _)) => Finding::NoSymbol,
            (None, ("noload" | "damaged", what)) => Finding::Refused(what.to_string()),
            _ => Finding::Unusable(format!("the probe ended with {status} and reported '{text}'")),
        }
    }
}
