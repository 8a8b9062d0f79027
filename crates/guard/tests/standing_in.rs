// SPDX-License-Identifier: Apache-2.0
//! Guards that stand in for stopped ones: they guard from the first moment, and a guard that resumes is never replaced.
use interconnect::Link;
use process_kit::{Child, Launch, SharedMemory, UnixLink};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Limit of any wait in these tests: it only ends a test that hangs.
const LIMIT: Duration = Duration::from_secs(300);
const SAFE: u64 = u64::from_ne_bytes([1; 8]);
/// A guard that is stopped for 0.1 s is replaced: if this thread was delayed that long, the trial is inconclusive.
const SURELY_SPARED: Duration = Duration::from_millis(40);

fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let deadline = Instant::now() + LIMIT;
    while !holds() {
        assert!(Instant::now() < deadline, "{what}: not within {LIMIT:?}");
        std::thread::yield_now();
    }
}

fn signal(pid: i32, signal: i32) {
    // SAFETY: signals a guard that has not been reaped; only its program reaps it.
    assert_eq!(unsafe { libc::kill(pid, signal) }, 0);
}

/// A program that is guarded itself.
struct Program {
    program: Child,
    output: SharedMemory,
    link: UnixLink,
    said: Vec<String>,
}

impl Program {
    fn start() -> Program {
        let (output, (link, theirs)) = (SharedMemory::new(16).unwrap(), UnixLink::pair().unwrap());
        let launch = Launch::new([env!("CARGO_BIN_EXE_guard-stand-in").into(), "program".into()]).descriptor("link", theirs);
        let launch = launch.descriptor("output", output.descriptor().unwrap()).variable("TEST_GUARD", env!("CARGO_BIN_EXE_opengpac-guard"));
        let program = Program { program: launch.start().unwrap(), output, link, said: Vec::new() };
        until("it has begun", || program.words() == "begun");
        program
    }

    fn words(&self) -> String {
        String::from_utf8(self.link.receive(LIMIT).unwrap().expect("in time")).unwrap()
    }

    /// Returns the process IDs of its guards and of their stand-ins, keeping its other output.
    fn guards(&mut self) -> (Vec<i32>, Vec<i32>) {
        self.link.send(b"guards").unwrap();
        loop {
            match self.words() {
                words if words.starts_with("guards ") => {
                    let numbers = |part: &str| {
                        let numbers = part.split(|char: char| !char.is_ascii_digit()).filter(|number| !number.is_empty());
                        numbers.map(|number| number.parse().unwrap()).collect()
                    };
                    let (guards, stand_ins) = words.split_once(';').expect("both");
                    return (numbers(guards), numbers(stand_ins));
                }
                words => self.said.push(words),
            }
        }
    }

    fn is_safe(&self) -> bool {
        self.output.word(8).load(Ordering::Acquire) == SAFE
    }

    /// Stops guards and resumes them; returns true if that was short enough that none of them may be replaced.
    fn pauses(&mut self, pause: impl FnOnce(&mut Program, &[i32])) -> bool {
        let (guards, _) = self.guards();
        let begun = Instant::now();
        guards.iter().for_each(|guard| signal(*guard, libc::SIGSTOP));
        pause(self, &guards);
        guards.iter().for_each(|guard| signal(*guard, libc::SIGCONT));
        let is_short = begun.elapsed() < SURELY_SPARED;
        if is_short {
            until("those that stood in have ended", || self.guards().1.is_empty());
            assert_eq!(self.guards().0, guards, "guards that live are never replaced");
            assert!(!self.said.iter().any(|words| words.contains("Restarted")), "{:?}", self.said);
        }
        is_short
    }

    /// Checks that both guards still guard: the program is made safe.
    fn assert_guarded(&mut self) {
        assert!(!self.is_safe());
        self.program.kill();
        until("it is safe", || self.is_safe());
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        self.program.kill();
    }
}

/// Repeats a trial with new programs until the machine's timing made it valid.
fn until_it_counts(mut trial: impl FnMut() -> bool) {
    let deadline = Instant::now() + LIMIT;
    while !trial() {
        assert!(Instant::now() < deadline, "this thread was held up each time");
    }
}

#[test]
fn a_program_that_ends_while_both_guards_are_stopped_is_made_safe_by_their_stand_ins() {
    for end in [libc::SIGKILL, libc::SIGSTOP] {
        until_it_counts(|| {
            let mut program = Program::start();
            let (guards, _) = program.guards();
            let begun = Instant::now();
            guards.iter().for_each(|guard| signal(*guard, libc::SIGSTOP));
            until("one stands in", || !program.guards().1.is_empty());
            signal(program.program.pid(), end);
            let is_before_they_are_judged = begun.elapsed() < SURELY_SPARED;
            until("it is safe", || program.is_safe());
            guards.iter().for_each(|guard| signal(*guard, libc::SIGKILL));
            is_before_they_are_judged
        });
    }
}

#[test]
fn guards_that_go_on_are_not_replaced() {
    until_it_counts(|| {
        let mut program = Program::start();
        let counts = (0..5).all(|_| program.pauses(|_, _| {}));
        if counts {
            program.assert_guarded();
        }
        counts
    });
}

#[test]
fn guards_that_go_on_when_others_stand_in_are_not_replaced() {
    until_it_counts(|| {
        let mut program = Program::start();
        let counts = program.pauses(|program, _| until("others stand in", || program.guards().1.len() == 2));
        if counts {
            program.assert_guarded();
        }
        counts
    });
}

#[test]
fn guards_that_a_debugger_looks_at_are_not_replaced() {
    until_it_counts(|| {
        let mut program = Program::start();
        let (guards, _) = program.guards();
        let begun = Instant::now();
        for guard in &guards {
            // SAFETY: traces a process of the same user and releases it; no memory of ours is passed.
            unsafe {
                let none = std::ptr::null_mut::<libc::c_void>();
                assert_eq!(libc::ptrace(libc::PTRACE_ATTACH, *guard, none, none), 0, "{}", std::io::Error::last_os_error());
                assert_eq!(libc::waitpid(*guard, std::ptr::null_mut(), libc::__WALL), *guard);
                assert_eq!(libc::ptrace(libc::PTRACE_DETACH, *guard, none, none), 0);
            }
        }
        let is_short = begun.elapsed() < SURELY_SPARED;
        if is_short {
            until("those that stood in have ended", || program.guards().1.is_empty());
            assert_eq!(program.guards().0, guards);
            program.assert_guarded();
        }
        is_short
    });
}

#[test]
fn guards_are_not_replaced_under_load() {
    let ends = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let cores = std::thread::available_parallelism().map_or(2, usize::from);
        (0..6 * cores).for_each(|_| {
            scope.spawn(|| {
                while !ends.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            });
        });
        let mut program = Program::start();
        let (guards, _) = program.guards();
        let from = program.output.word(0).load(Ordering::Acquire);
        // Measured by the program's progress, not by a clock.
        until("the program goes on", || program.output.word(0).load(Ordering::Acquire) > from + 500);
        let (now, stand_ins) = program.guards();
        ends.store(true, Ordering::Relaxed);
        assert_eq!((now, stand_ins), (guards, vec![]));
        program.assert_guarded();
    });
}
