// SPDX-License-Identifier: Apache-2.0
//! The audit file: who commanded what, one JSON line each, appended. What cannot be recorded is not configured. A system that serves
//! only its studio has none, unless it is asked for: there the log alone says who commanded what.
use crate::caller::Caller;
use crate::failure::Failure;
use crate::requests::hex;
use model::refusal::Class;
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::sync::Mutex;
use std::time::{SystemTime, UNIX_EPOCH};

/// One line.
#[derive(Serialize)]
struct Line<'a> {
    /// s since 1970.
    time: f64,
    who: &'a str,
    role: &'a str,
    from: &'a str,
    session: &'a str,
    call: &'a str,
    arguments_sha256: &'a str,
    /// `begun`, `ok`, or the class of the refusal.
    outcome: &'a str,
}

/// What a line is about.
#[derive(Clone, Debug)]
pub struct Act {
    pub caller: Caller,
    /// Name of the session; empty: none.
    pub session: String,
    pub call: String,
    /// What it concerns, for the log: an instance, a device, an SVV.
    pub about: String,
    pub arguments_sha256: String,
}

impl Act {
    /// An act with these arguments, of which the file has only the digest.
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

/// The open file, and whether the last line could be written; nothing where there is none.
pub struct Audit {
    file: Option<Mutex<(File, bool)>>,
    path: String,
}

impl Audit {
    /// Opens the file for appending; it is made with mode 0600.
    pub fn open(path: &Path) -> io::Result<Audit> {
        let file = OpenOptions::new().append(true).create(true).mode(0o600).open(path)?;
        Ok(Audit { file: Some(Mutex::new((file, true))), path: path.display().to_string() })
    }

    /// No file.
    pub fn none() -> Audit {
        Audit { file: None, path: String::new() }
    }

    /// Writes a line. Errors: `AuditFailed`; the first is also said on standard error.
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
        let mut file = file.lock().expect("nobody panics with this lock");
        // One write a line: with O_APPEND lines do not mix.
        match file.0.write_all(text.as_bytes()) {
            Ok(()) => {
                file.1 = true;
                Ok(())
            }
            Err(why) => {
                if std::mem::replace(&mut file.1, false) {
                    eprintln!("audit: cannot write '{}': {why}; nothing can be configured until that is possible again", self.path);
                }
                Err(Failure::new(Class::AuditFailed, format!("the audit file cannot be written: {why}"), "make room for it; observing and operating go on"))
            }
        }
    }
}
