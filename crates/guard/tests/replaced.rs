// SPDX-License-Identifier: Apache-2.0
//! Replacement of guards that have exited: while one is being replaced, the other guards; if both are, the new ones guard as soon as they
//! have received the registrations, and the devices of processes that ended before are made safe.
use interconnect::Link;
use process_kit::{Child, Launch, SharedMemory, UnixLink, fresh_folder};
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// Limit of any wait in these tests: it only ends a test that hangs.
const LIMIT: Duration = Duration::from_secs(300);
const SAFE: u64 = u64::from_ne_bytes([1; 8]);

fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let deadline = Instant::now() + LIMIT;
    while !holds() {
        assert!(Instant::now() < deadline, "{what}: not within {LIMIT:?}");
        std::thread::yield_now();
    }
}

/// A program that is guarded itself, whose third and later guards read nothing until they are released.
struct DelayedProgram {
    folder: PathBuf,
    program: Child,
    output: SharedMemory,
    link: UnixLink,
}

impl DelayedProgram {
    fn start() -> DelayedProgram {
        let folder = fresh_folder().unwrap();
        let (script, gate) = (folder.join("guard.sh"), folder.join("gate"));
        let (first, second, guard) = (folder.join("first"), folder.join("second"), env!("CARGO_BIN_EXE_opengpac-guard"));
        let begins = format!("mkdir '{}' 2>/dev/null || mkdir '{}' 2>/dev/null", first.display(), second.display());
        let text =
            format!("#!/bin/sh\n{begins} || while [ ! -e '{}' ]; do [ -d '{}' ] || exit; sleep 0.01; done\nexec '{guard}'\n", gate.display(), folder.display());
        std::fs::write(&script, text).unwrap();
        std::fs::set_permissions(&script, std::os::unix::fs::PermissionsExt::from_mode(0o700)).unwrap();
        let (output, (link, theirs)) = (SharedMemory::new(16).unwrap(), UnixLink::pair().unwrap());
        let launch = Launch::new([env!("CARGO_BIN_EXE_guard-stand-in").into(), "program".into()]).descriptor("link", theirs);
        let program = launch.descriptor("output", output.descriptor().unwrap()).variable("TEST_GUARD", &script).start().unwrap();
        DelayedProgram { folder, program, output, link }
    }

    /// Returns the next line of the program.
    fn words(&self) -> String {
        String::from_utf8(self.link.receive(LIMIT).unwrap().expect("in time")).unwrap()
    }

    /// Returns the process IDs of its guards, keeping its other output.
    fn guards(&self, said: &mut Vec<String>) -> Vec<i32> {
        self.link.send(b"guards").unwrap();
        loop {
            match self.words() {
                words if words.starts_with("guards ") => {
                    let (guards, _) = words.split_once(';').expect("stand-ins come behind them");
                    let numbers = guards.split(|char: char| !char.is_ascii_digit()).filter(|number| !number.is_empty());
                    return numbers.map(|number| number.parse().unwrap()).collect();
                }
                words => said.push(words),
            }
        }
    }

    /// Signals `count` of the guards; if they are killed, waits until others have started. Returns the output meanwhile.
    fn loses_guards(&self, count: usize, signal: i32) -> Vec<String> {
        let mut said = Vec::new();
        let first = self.guards(&mut said);
        for guard in &first[..count] {
            // SAFETY: signals a guard that has not been reaped; only its program reaps it.
            unsafe { libc::kill(*guard, signal) };
        }
        if signal == libc::SIGKILL {
            until("other guards are started", || self.guards(&mut said)[..count].iter().all(|guard| !first.contains(guard)));
        }
        said
    }

    fn is_safe(&self) -> bool {
        self.output.word(8).load(Ordering::Acquire) == SAFE
    }

    /// Releases the guards.
    fn goes_on(&self) {
        std::fs::write(self.folder.join("gate"), "").unwrap();
    }
}

impl Drop for DelayedProgram {
    fn drop(&mut self) {
        self.program.kill();
        let _gone = std::fs::remove_dir_all(&self.folder);
    }
}

#[test]
fn a_guard_is_told_of_when_it_has_taken_what_it_guards() {
    let delayed = DelayedProgram::start();
    let said = delayed.loses_guards(1, libc::SIGKILL);
    assert!(!said.iter().any(|words| words.contains("Restarted")), "{said:?}");
    delayed.goes_on();
    until("it is told", || delayed.words().contains(r#"Restarted { how: "was ended by SIGKILL"#));
}

#[test]
fn a_program_that_ends_while_one_guard_is_being_replaced_is_made_safe_by_the_other() {
    for signal in [libc::SIGKILL, libc::SIGSTOP] {
        let delayed = DelayedProgram::start();
        delayed.loses_guards(1, signal);
        assert!(!delayed.is_safe());
        delayed.program.kill();
        until("it is safe", || delayed.is_safe());
    }
}

#[test]
fn a_program_that_stands_still_while_one_guard_is_being_replaced_is_made_safe_by_the_other() {
    for signal in [libc::SIGKILL, libc::SIGSTOP] {
        let delayed = DelayedProgram::start();
        delayed.loses_guards(1, signal);
        // SAFETY: signals a child of ours, which has not been reaped yet.
        unsafe { libc::kill(delayed.program.pid(), libc::SIGSTOP) };
        until("it is safe", || delayed.is_safe());
    }
}

#[test]
fn guards_that_hear_of_a_program_after_its_end_make_it_safe() {
    let delayed = DelayedProgram::start();
    delayed.loses_guards(2, libc::SIGKILL);
    delayed.program.kill();
    assert!(delayed.program.wait(LIMIT).is_some());
    assert!(!delayed.is_safe());
    delayed.goes_on();
    until("it is safe", || delayed.is_safe());
}
