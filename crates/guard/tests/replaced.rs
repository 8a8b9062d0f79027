// SPDX-License-Identifier: Apache-2.0
//! Another guard in place of one that is gone: it guards when it has taken what is registered, and what ended before that is made safe.
use interconnect::Link;
use process_kit::{Child, Launch, SharedMemory, UnixLink, fresh_folder};
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// What any wait of these tests may take: only to end a test that hangs.
const LIMIT: Duration = Duration::from_secs(60);
const SAFE: u64 = u64::from_ne_bytes([1; 8]);

fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let deadline = Instant::now() + LIMIT;
    while !holds() {
        assert!(Instant::now() < deadline, "{what}: not within {LIMIT:?}");
        std::thread::yield_now();
    }
}

/// A program that is guarded itself, whose second guard takes nothing until it is let go on.
struct Delayed {
    folder: PathBuf,
    program: Child,
    output: SharedMemory,
    link: UnixLink,
}

impl Delayed {
    fn start() -> Delayed {
        let folder = fresh_folder().unwrap();
        let (script, gate) = (folder.join("guard.sh"), folder.join("gate"));
        assert!(std::process::Command::new("mkfifo").arg(&gate).status().unwrap().success());
        let first = folder.join("first");
        let text = format!("#!/bin/sh\nmkdir '{}' 2>/dev/null || : <'{}'\nexec '{}'\n", first.display(), gate.display(), env!("CARGO_BIN_EXE_opengpac-guard"));
        std::fs::write(&script, text).unwrap();
        std::fs::set_permissions(&script, std::os::unix::fs::PermissionsExt::from_mode(0o700)).unwrap();
        let (output, (link, theirs)) = (SharedMemory::new(16).unwrap(), UnixLink::pair().unwrap());
        let launch = Launch::new([env!("CARGO_BIN_EXE_guard-stand-in").into(), "program".into()]).descriptor("link", theirs);
        let program = launch.descriptor("output", output.descriptor().unwrap()).variable("TEST_GUARD", &script).start().unwrap();
        Delayed { folder, program, output, link }
    }

    /// The next words of the program.
    fn words(&self) -> String {
        String::from_utf8(self.link.receive(LIMIT).unwrap().expect("in time")).unwrap()
    }

    /// The number of its guard. What it says meanwhile is kept.
    fn guard(&self, said: &mut Vec<String>) -> i32 {
        self.link.send(b"guard").unwrap();
        loop {
            match self.words() {
                words if words.starts_with("Some(") => return words[5..words.len() - 1].parse().unwrap(),
                words => said.push(words),
            }
        }
    }

    /// Kills the first guard; returns when the second one has been told everything, and has heard nothing. What was said until then.
    fn replaces_its_guard(&self) -> Vec<String> {
        let mut said = Vec::new();
        let first = self.guard(&mut said);
        // SAFETY: signals a guard that has not been reaped: its program does so.
        unsafe { libc::kill(first, libc::SIGKILL) };
        until("another guard is started", || self.guard(&mut said) != first);
        said
    }

    /// Lets the second guard go on.
    fn goes_on(&self) {
        std::fs::write(self.folder.join("gate"), "").unwrap();
    }
}

impl Drop for Delayed {
    fn drop(&mut self) {
        self.program.kill();
        let _gone = std::fs::remove_dir_all(&self.folder);
    }
}

#[test]
fn another_guard_is_told_of_when_it_has_taken_what_it_guards() {
    let delayed = Delayed::start();
    let said = delayed.replaces_its_guard();
    assert!(!said.iter().any(|words| words.contains("Restarted")), "{said:?}");
    delayed.goes_on();
    until("it is told", || delayed.words().contains(r#"Restarted { how: "was ended by SIGKILL"#));
}

#[test]
fn a_guard_that_hears_of_a_program_after_its_end_makes_it_safe() {
    let delayed = Delayed::start();
    delayed.replaces_its_guard();
    delayed.program.kill();
    assert!(delayed.program.wait(LIMIT).is_some());
    assert_eq!(delayed.output.word(8).load(Ordering::Acquire), 0);
    delayed.goes_on();
    until("it is safe", || delayed.output.word(8).load(Ordering::Acquire) == SAFE);
}
