// SPDX-License-Identifier: Apache-2.0
//! Audit file, to which one JSON line per command is appended, with the caller. A configuration change that cannot be recorded is
//! refused. A system that serves only its studio has no audit file unless requested; commands are then recorded only in the log.
use crate::caller::Caller;
use crate::failure::Failure;
use crate::requests::hex;
use model::refusal::Class;
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{SystemTime, UNIX_EPOCH};

/// Maximum size of the file, bytes. When it is reached, the file becomes `FILE.1`, and a new one is started.
pub(crate) const FILE_MAX: u64 = 64 << 20;
/// Number of earlier files to keep: `FILE.1` to `FILE.4`, the last of which is the oldest.
const OLD_MAX: usize = 4;

/// A line of the audit file.
#[derive(Serialize)]
struct Line<'a> {
    /// Time, s since the Unix epoch.
    time: f64,
    who: &'a str,
    role: &'a str,
    from: &'a str,
    session: &'a str,
    call: &'a str,
    arguments_sha256: &'a str,
    /// Outcome: `begun`, `ok`, or the class of the refusal.
    outcome: &'a str,
}

/// Action to be recorded in a line.
#[derive(Clone, Debug)]
pub struct Act {
    pub caller: Caller,
    /// Name of the session; empty if there is none.
    pub session: String,
    pub call: String,
    /// Object of the action, for the log: an instance, a device, an SVV.
    pub about: String,
    pub arguments_sha256: String,
}

impl Act {
    /// Creates an action with these arguments; the file stores only their digest.
    pub fn new(caller: &Caller, session: &str, call: &str, arguments: &[u8]) -> Act {
        Act {
            caller: caller.clone(),
            session: session.to_owned(),
            call: call.to_owned(),
            about: String::new(),
            arguments_sha256: hex(&Sha256::digest(arguments)),
        }
    }
}

/// The audit file, if there is one.
pub struct Audit {
    file: Option<Mutex<Open>>,
    path: PathBuf,
    max: u64,
}

/// The open file.
struct Open {
    file: File,
    /// Size of the file, bytes.
    len: u64,
    /// True if the last line was written successfully.
    is_written: bool,
}

impl Audit {
    /// Opens the file for appending; creates it with mode 0600.
    pub fn open(path: &Path) -> io::Result<Audit> {
        Audit::bounded(path, FILE_MAX)
    }

    /// Opens the file with a different maximum size.
    pub(crate) fn bounded(path: &Path, max: u64) -> io::Result<Audit> {
        Ok(Audit { file: Some(Mutex::new(Open::at(path)?)), path: path.to_owned(), max })
    }

    /// Creates an audit without a file.
    pub fn none() -> Audit {
        Audit { file: None, path: PathBuf::new(), max: FILE_MAX }
    }

    /// Reopens the file by its name, after another program has moved it. If this fails, the previous file stays open.
    pub fn reopen(&self) -> io::Result<()> {
        if let Some(file) = &self.file {
            *file.lock().expect("nobody panics with this lock") = Open::at(&self.path)?;
        }
        Ok(())
    }

    /// Writes a line. Fails with `AuditFailed`; the first failure is also reported on standard error.
    pub fn write(&self, act: &Act, outcome: &str) -> Result<(), Failure> {
        let Some(file) = &self.file else { return Ok(()) };
        let line = Line {
            time: SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64()),
            who: &act.caller.who,
            role: act.caller.role.word(),
            from: &act.caller.from,
            session: &act.session,
            call: &act.call,
            arguments_sha256: &act.arguments_sha256,
            outcome,
        };
        let mut text = serde_json::to_string(&line).expect("texts and a number are JSON");
        text.push('\n');
        let mut open = file.lock().expect("nobody panics with this lock");
        if open.len > 0 && open.len + text.len() as u64 > self.max {
            // If the file cannot be moved, let it grow rather than lose a line.
            let _grows = self.rotate(&mut open);
        }
        // One write per line: with O_APPEND, lines do not mix.
        match open.file.write_all(text.as_bytes()) {
            Ok(()) => {
                (open.is_written, open.len) = (true, open.len + text.len() as u64);
                Ok(())
            }
            Err(why) => {
                if std::mem::replace(&mut open.is_written, false) {
                    eprintln!("audit: cannot write '{}': {why}; nothing can be configured until it can be written again", self.path.display());
                }
                Err(Failure::new(
                    Class::AuditFailed,
                    format!("the audit file cannot be written: {why}"),
                    "free up disk space; observing and operating still work",
                ))
            }
        }
    }

    /// Renames the file to `FILE.1` and each earlier file to the next number, and starts a new file.
    fn rotate(&self, open: &mut Open) -> io::Result<()> {
        let old = |number: usize| {
            let mut name = self.path.as_os_str().to_owned();
            name.push(format!(".{number}"));
            PathBuf::from(name)
        };
        for number in (1..OLD_MAX).rev() {
            match fs::rename(old(number), old(number + 1)) {
                Err(why) if why.kind() != io::ErrorKind::NotFound => return Err(why),
                _ => {}
            }
        }
        fs::rename(&self.path, old(1))?;
        *open = Open::at(&self.path)?;
        Ok(())
    }
}

impl Open {
    fn at(path: &Path) -> io::Result<Open> {
        let file = OpenOptions::new().append(true).create(true).mode(0o600).open(path)?;
        let len = file.metadata()?.len();
        Ok(Open { file, len, is_written: true })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use api::Role;

    #[test]
    fn it_rotates_within_its_bounds_and_loses_no_line_before() {
        let folder = std::env::temp_dir().join(format!("audit-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder");
        let path = folder.join("a.jsonl");
        let audit = Audit::bounded(&path, 1000).expect("a file");
        let caller = Caller { who: "token panel".to_owned(), role: Role::Operate, from: "here".to_owned() };
        for number in 0..100 {
            audit.write(&Act::new(&caller, "panel", &format!("call{number}"), b""), "ok").expect("there is room");
        }
        let mut files: Vec<PathBuf> = fs::read_dir(&folder).expect("ours").map(|entry| entry.expect("ours").path()).collect();
        files.sort();
        let names: Vec<_> = files.iter().map(|file| file.file_name().and_then(|name| name.to_str()).expect("a name").to_owned()).collect();
        assert_eq!(names, ["a.jsonl", "a.jsonl.1", "a.jsonl.2", "a.jsonl.3", "a.jsonl.4"]);
        assert!(files.iter().all(|file| fs::metadata(file).expect("ours").len() <= 1000));
        let read = |file: &PathBuf| fs::read_to_string(file).expect("text");
        let lines: Vec<String> = files.iter().rev().flat_map(|file| read(file).lines().map(str::to_owned).collect::<Vec<_>>()).collect();
        let numbers: Vec<usize> = lines
            .iter()
            .map(|line| {
                let line: serde_json::Value = serde_json::from_str(line).expect("JSON");
                line["call"].as_str().and_then(|call| call.strip_prefix("call")?.parse().ok()).expect("a number")
            })
            .collect();
        assert!(numbers.windows(2).all(|two| two[0] + 1 == two[1]) && numbers.last() == Some(&99), "{numbers:?}");
        // Simulates an external rotation that moves the file away.
        fs::rename(&path, folder.join("moved")).expect("ours");
        audit.reopen().expect("a new one");
        audit.write(&Act::new(&caller, "panel", "after", b""), "ok").expect("there is room");
        assert!(read(&path).lines().count() == 1 && read(&path).contains("after"));
        fs::remove_dir_all(&folder).expect("ours");
    }
}
