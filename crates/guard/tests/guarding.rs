// SPDX-License-Identifier: Apache-2.0
//! The guard with real processes: however a process ends, its outputs are made safe, and nothing is left behind.
use device::SafeHandle;
use guard::{Bounds, Cause, FoundWard, Guard, GuardCommand, GuardEvent, Loss};
use interconnect::Link;
use process_kit::{Child, Heartbeat, Launch, SharedMemory, Status, UnixLink, fresh_folder, now_ns};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Limit of any wait in these tests: it only ends a test that hangs.
const LIMIT: Duration = Duration::from_secs(300);
const SAFE: u64 = u64::from_ne_bytes([1; 8]);

fn program() -> OsString {
    env!("CARGO_BIN_EXE_opengpac-guard").into()
}

/// Starts a guard; returns it and its events.
fn guard(path: Option<PathBuf>) -> (Guard, Receiver<GuardEvent>) {
    let (tell, told) = channel();
    let guard = Guard::start(GuardCommand { command: vec![program()], path }, move |event| tell.send(event).expect("the test is there")).unwrap();
    (guard, told)
}

/// A process that stores 1, 2, 3, … to the first word of its output; its safe handle stores 0 there and a mark to the second.
struct Rtp {
    child: Child,
    output: SharedMemory,
    heartbeat: Heartbeat,
}

impl Rtp {
    fn start() -> Rtp {
        let (output, heartbeat) = (SharedMemory::new(16).unwrap(), Heartbeat::new().unwrap());
        let launch = Launch::new([env!("CARGO_BIN_EXE_guard-stand-in").into(), "rtp".into()]).descriptor("output", output.descriptor().unwrap());
        let child = launch.descriptor("heartbeat", heartbeat.descriptor().unwrap()).start().unwrap();
        Rtp { child, output, heartbeat }
    }

    fn guarded(&self, guard: &Guard, ward: u64, bounds: impl Into<Bounds>) {
        let heartbeat = Heartbeat::received(self.heartbeat.descriptor().unwrap()).unwrap();
        guard.watch(ward, "rtp1", self.child.descriptor().unwrap(), Some((heartbeat, bounds.into()))).unwrap();
        guard.hold(ward, "arm", vec![self.handle()]).unwrap();
    }

    fn handle(&self) -> SafeHandle {
        SafeHandle { descriptor: self.output.descriptor().unwrap(), writes: vec![(0, vec![0; 8]), (8, SAFE.to_ne_bytes().to_vec())], latches: false }
    }

    /// Waits until it has stored `more` further commands.
    fn runs(&self, more: u64) {
        let from = self.output.word(0).load(Ordering::Acquire);
        until("the process stores", || self.output.word(0).load(Ordering::Acquire) >= from + more);
    }

    fn is_safe(&self) -> bool {
        self.output.word(0).load(Ordering::Acquire) == 0 && self.output.word(8).load(Ordering::Acquire) == SAFE
    }
}

fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let deadline = Instant::now() + LIMIT;
    while !holds() {
        assert!(Instant::now() < deadline, "{what}: not within {LIMIT:?}");
        std::thread::yield_now();
    }
}

/// Returns the next event, ignoring features missing from this operating system.
fn next(told: &Receiver<GuardEvent>) -> GuardEvent {
    loop {
        match told.recv_timeout(LIMIT).expect("an event is told") {
            GuardEvent::Missing(_) => {}
            event => return event,
        }
    }
}

fn loss(told: &Receiver<GuardEvent>) -> Loss {
    loop {
        match next(told) {
            GuardEvent::Lost(loss) => return loss,
            GuardEvent::Restarted { .. } => {}
            other => panic!("{other:?}"),
        }
    }
}

/// Returns the process ID of the first of the two guards.
fn pid(guard: &Guard) -> i32 {
    guard.pids()[0].expect("ours")
}

fn signal(pid: i32, signal: i32) {
    // SAFETY: signals a child of ours, which has not been reaped yet.
    unsafe { libc::kill(pid, signal) };
}

/// Returns the state of a process as `/proc` has it: T for one that is stopped, none for one that has been reaped.
fn state_of(pid: i32) -> Option<char> {
    let line = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    line.rsplit_once(") ")?.1.chars().next()
}

/// Returns true if no process has that ID, or only one that has not been reaped.
fn is_gone(pid: i32) -> bool {
    state_of(pid).is_none_or(|state| state == 'Z')
}

/// Returns the median and the 99th percentile, µs.
fn quantiles(mut spans_ns: Vec<i64>) -> (f64, f64) {
    spans_ns.sort_unstable();
    (spans_ns[spans_ns.len() / 2] as f64 * 1e-3, spans_ns[spans_ns.len() * 99 / 100] as f64 * 1e-3)
}

#[test]
fn a_killed_process_leaves_safe_outputs_every_time() {
    let (guard, told) = guard(None);
    let pids = guard.pids();
    // Any other generator of instants would do.
    let mut random = 0x2545_f491_4f6c_dd1d_u64;
    let (mut from_kill, mut from_seen) = (Vec::new(), Vec::new());
    for ward in 0..100 {
        let rtp = Rtp::start();
        rtp.guarded(&guard, ward, LIMIT);
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        rtp.runs(1 + random % 8);
        (0..random % 50_000).for_each(|_| std::hint::spin_loop());
        let killed_ns = now_ns();
        rtp.child.kill();
        let loss = loss(&told);
        assert!(rtp.is_safe(), "{loss}");
        assert_eq!((loss.ward, loss.cause, loss.written, loss.failed.len()), (ward, Cause::Died, 1, 0));
        from_kill.push(loss.safe_ns - killed_ns);
        from_seen.push(loss.safe_ns - loss.seen_ns);
        assert_eq!(rtp.child.wait(LIMIT), Some(Status::Killed { signal: libc::SIGKILL, core: false }));
        guard.forget(ward).unwrap();
    }
    drop(guard);
    assert!(pids.into_iter().flatten().all(is_gone), "guards with nothing to guard end");
    let ((kill, kill_99), (seen, seen_99)) = (quantiles(from_kill), quantiles(from_seen));
    println!("safe outputs after kill -9: median {kill:.0} us, p99 {kill_99:.0} us; after the guard saw it: median {seen:.0} us, p99 {seen_99:.0} us");
}

#[test]
fn a_process_that_stops_answering_is_killed_before_its_outputs_are_made_safe() {
    let (guard, told) = guard(None);
    let rtp = Rtp::start();
    rtp.guarded(&guard, 1, Bounds::default());
    rtp.runs(5);
    let stopped_ns = now_ns();
    signal(rtp.child.pid(), libc::SIGSTOP);
    let loss = loss(&told);
    assert_eq!(loss.cause, Cause::Stopped);
    assert!(rtp.is_safe(), "{loss}");
    assert_eq!(rtp.child.wait(LIMIT), Some(Status::Killed { signal: libc::SIGKILL, core: false }), "it cannot come back and write");
    println!("stopped process: safe {:.1} ms after it was stopped", (loss.safe_ns - stopped_ns) as f64 * 1e-6);
}

#[test]
fn another_guard_takes_over_with_everything() {
    let (guard, told) = guard(None);
    let rtp = Rtp::start();
    rtp.guarded(&guard, 1, LIMIT);
    for _ in 0..3 {
        let first = pid(&guard);
        signal(first, libc::SIGKILL);
        let event = next(&told);
        assert!(matches!(&event, GuardEvent::Restarted { how, .. } if how.contains("SIGKILL")), "{event:?}");
        assert_ne!(pid(&guard), first);
    }
    rtp.runs(1);
    rtp.child.kill();
    assert_eq!(loss(&told).cause, Cause::Died);
    assert!(rtp.is_safe());
}

#[test]
fn a_guard_that_stands_still_is_replaced() {
    let (guard, told) = guard(None);
    let rtp = Rtp::start();
    rtp.guarded(&guard, 1, LIMIT);
    rtp.runs(1);
    let first = pid(&guard);
    signal(first, libc::SIGSTOP);
    let event = next(&told);
    assert!(matches!(&event, GuardEvent::Restarted { how, .. } if how.contains("hung")), "{event:?}");
    assert!(pid(&guard) != first && is_gone(first));
    signal(rtp.child.pid(), libc::SIGSTOP);
    rtp.child.kill();
    assert_eq!(loss(&told).cause, Cause::Died);
    assert!(rtp.is_safe());
}

#[test]
fn what_the_guard_does_not_see_the_supervisor_sees() {
    for how in [libc::SIGKILL, libc::SIGSTOP] {
        let (guard, told) = guard(None);
        let rtp = Rtp::start();
        rtp.guarded(&guard, 1, Bounds::default());
        rtp.runs(5);
        let begun_ns = now_ns();
        guard.pids().into_iter().flatten().for_each(|guard| signal(guard, libc::SIGSTOP));
        signal(rtp.child.pid(), how);
        until("the outputs are safe", || rtp.is_safe());
        println!("guards stopped, process {how}: safe after {:.1} ms", (now_ns() - begun_ns) as f64 * 1e-6);
        assert!(matches!(loss(&told).cause, Cause::Died | Cause::Stopped));
        drop(guard);
    }
}

#[test]
fn closing_while_a_stopped_guard_is_replaced_comes_to_its_end() {
    for _ in 0..5 {
        let (guard, _) = guard(None);
        let stopped = pid(&guard);
        signal(stopped, libc::SIGSTOP);
        until("it is stopped", || state_of(stopped) == Some('T'));
        until("it is being ended", || state_of(stopped) != Some('T'));
        drop(guard);
    }
}

#[test]
fn a_stopped_guard_with_nothing_to_guard_does_not_stay() {
    let (guard, _) = guard(None);
    let pids = guard.pids();
    signal(pid(&guard), libc::SIGSTOP);
    drop(guard);
    until("both guards are gone", || pids.into_iter().flatten().all(is_gone));
}

#[test]
fn a_program_that_is_guarded_itself_is_spared_where_it_only_stands_still() {
    let (output, (link, theirs)) = (SharedMemory::new(16).unwrap(), UnixLink::pair().unwrap());
    let launch = Launch::new([env!("CARGO_BIN_EXE_guard-stand-in").into(), "program".into()]).descriptor("link", theirs);
    let program = launch.descriptor("output", output.descriptor().unwrap()).variable("TEST_GUARD", program()).start().unwrap();
    let heard = |what: &str| {
        until(what, || {
            let (frame, _) = link.receive_with(LIMIT).unwrap().expect("in time");
            String::from_utf8(frame).unwrap().contains(what)
        })
    };
    let is_safe = || output.word(8).load(Ordering::Acquire) == SAFE;
    heard("begun");
    for _ in 0..2 {
        assert!(!is_safe());
        signal(program.pid(), libc::SIGSTOP);
        until("its outputs are safe", is_safe);
        signal(program.pid(), libc::SIGCONT);
        heard("cause: Stopped");
        heard("GoesOn");
        output.word(8).store(0, Ordering::Release);
    }
    program.kill();
    until("its outputs are safe", is_safe);
}

#[test]
fn a_process_that_dies_while_there_is_no_guard_is_safe_when_there_is_one() {
    let (guard, told) = guard(None);
    let rtp = Rtp::start();
    rtp.guarded(&guard, 1, LIMIT);
    rtp.runs(1);
    guard.pids().into_iter().flatten().for_each(|guard| signal(guard, libc::SIGKILL));
    rtp.child.kill();
    assert_eq!(loss(&told).cause, Cause::Died);
    assert!(rtp.is_safe());
    // A later guard is not notified again of a loss that has been handled.
    signal(pid(&guard), libc::SIGKILL);
    assert!(matches!(next(&told), GuardEvent::Restarted { .. }));
    // The guard answers after everything it has to report about earlier messages.
    guard.forget(1).unwrap();
    assert!(!told.try_iter().any(|event| matches!(event, GuardEvent::Lost(_))));
}

#[test]
fn a_guard_that_cannot_stay_is_given_up_in_words() {
    let (tell, told) = channel();
    let command = GuardCommand { command: vec![env!("CARGO_BIN_EXE_guard-stand-in").into(), "exit".into(), "3".into()], path: None };
    let guard = Guard::start(command, move |event| tell.send(event).expect("the test is there")).unwrap();
    let gone = std::iter::from_fn(|| told.recv_timeout(LIMIT).ok()).find_map(|event| if let GuardEvent::Gone(why) = event { Some(why) } else { None });
    let gone = gone.expect("it is told");
    assert!(gone.contains("status 3") && gone.contains("at most 20 restarts within 10s"), "{gone}");
    assert!(guard.forget(1).expect_err("there is none").to_string().contains("there is no guard"));
}

#[test]
fn what_is_released_or_forgotten_is_not_written_to() {
    let (guard, told) = guard(None);
    let (released, forgotten, held) = (Rtp::start(), Rtp::start(), Rtp::start());
    for (rtp, ward) in [(&released, 1), (&forgotten, 2), (&held, 3)] {
        rtp.guarded(&guard, ward, LIMIT);
        rtp.runs(1);
    }
    guard.release(1, "arm").unwrap();
    guard.forget(2).unwrap();
    forgotten.child.kill();
    released.child.kill();
    assert_eq!((loss(&told).written, released.is_safe()), (0, false));
    held.child.kill();
    assert_eq!((loss(&told).ward, held.is_safe(), forgotten.is_safe()), (3, true, false));
    // A device registered for a process that is already dead is made safe at once.
    guard.hold(1, "arm", vec![released.handle()]).unwrap();
    assert!(released.is_safe());
    assert!(guard.hold(2, "arm", vec![]).expect_err("forgotten").to_string().contains("no process 2"));
    assert!(guard.watch(3, "again", held.child.descriptor().unwrap(), None).expect_err("in use").to_string().contains("'rtp1'"));
}

#[test]
fn a_handle_that_cannot_be_written_is_named_and_the_others_are_safe() {
    let (guard, told) = guard(None);
    let rtp = Rtp::start();
    guard.watch(1, "rtp1", rtp.child.descriptor().unwrap(), None).unwrap();
    let read_only = std::fs::File::open("/dev/null").unwrap().into();
    guard.hold(1, "broken", vec![SafeHandle { descriptor: read_only, writes: vec![(0, vec![0])], latches: false }]).unwrap();
    let (mut reads, writes) = std::io::pipe().unwrap();
    guard.hold(1, "line", vec![SafeHandle { descriptor: writes.into(), writes: vec![(5, b"safe".to_vec())], latches: false }]).unwrap();
    guard.hold(1, "arm", vec![rtp.handle()]).unwrap();
    rtp.runs(1);
    rtp.child.kill();
    let loss = loss(&told);
    assert_eq!((loss.written, loss.failed.len(), rtp.is_safe()), (2, 1, true), "{loss}");
    assert!(loss.to_string().contains("not made safe: device 'broken'"), "{loss}");
    let mut line = [0; 4];
    std::io::Read::read_exact(&mut reads, &mut line).unwrap();
    assert_eq!(&line, b"safe");
}

/// A killed supervisor with an rtp and a guard.
struct Orphans {
    folder: PathBuf,
    rtp: Child,
    output: SharedMemory,
    guards: Vec<i32>,
}

impl Orphans {
    fn make() -> Orphans {
        let folder = fresh_folder().unwrap();
        let output = SharedMemory::new(16).unwrap();
        let (link, theirs) = UnixLink::pair().unwrap();
        let launch = Launch::new([env!("CARGO_BIN_EXE_guard-stand-in").into(), "supervisor".into()]).descriptor("link", theirs);
        let launch =
            launch.descriptor("output", output.descriptor().unwrap()).variable("TEST_GUARD", program()).variable("TEST_GUARD_PATH", folder.join("guard"));
        let supervisor = launch.start().unwrap();
        let (pids, mut rtp) = link.receive_with(LIMIT).unwrap().expect("in time");
        let rtp = Child::adopt(rtp.pop().expect("the rtp")).unwrap();
        supervisor.kill();
        assert_eq!(supervisor.wait(LIMIT), Some(Status::Killed { signal: libc::SIGKILL, core: false }));
        assert!(link.receive(LIMIT).is_err());
        let guards = String::from_utf8(pids).unwrap().split(' ').map(|pid| pid.parse().unwrap()).collect();
        Orphans { folder, rtp, output, guards }
    }

    fn is_safe(&self) -> bool {
        self.output.word(0).load(Ordering::Acquire) == 0 && self.output.word(8).load(Ordering::Acquire) == SAFE
    }

    fn runs(&self) {
        let from = self.output.word(0).load(Ordering::Acquire);
        until("the orphan goes on", || self.output.word(0).load(Ordering::Acquire) > from + 2);
    }

    /// Waits until the guards have ended and removed their sockets.
    fn end(&self) {
        until("the guards end", || self.guards.iter().all(|guard| is_gone(*guard)));
        std::fs::remove_dir(&self.folder).expect("nothing is left in it");
    }
}

#[test]
fn the_guards_go_on_when_their_supervisor_is_gone_and_either_is_enough() {
    for killed in [None, Some(0), Some(1)] {
        let orphans = Orphans::make();
        orphans.runs();
        if let Some(killed) = killed {
            signal(orphans.guards[killed], libc::SIGKILL);
        }
        orphans.rtp.kill();
        until("the outputs are safe", || orphans.is_safe());
        until("the guards end", || orphans.guards.iter().all(|guard| is_gone(*guard)));
    }
}

impl Drop for Orphans {
    /// Kills the rtp, so that the guard ends even if a test failed.
    fn drop(&mut self) {
        self.rtp.kill();
    }
}

fn adopt(folder: &Path) -> (Guard, Vec<FoundWard>, Receiver<GuardEvent>) {
    let (tell, told) = channel();
    let command = GuardCommand { command: vec![program()], path: Some(folder.join("guard")) };
    let (guard, found) = Guard::adopt(command, move |event| tell.send(event).expect("the test is there")).unwrap();
    (guard, found, told)
}

#[test]
fn a_new_supervisor_adopts_the_guard_and_what_it_guards() {
    for killed in [None, Some(0), Some(1)] {
        let orphans = Orphans::make();
        if let Some(killed) = killed {
            // The number is still the guard's: its supervisor started it, and nothing has reaped it.
            signal(orphans.guards[killed], libc::SIGKILL);
            until("it is gone", || is_gone(orphans.guards[killed]));
        }
        let (guard, found, told) = adopt(&orphans.folder);
        let [found] = found.as_slice() else { panic!("one process is guarded: {found:?}") };
        assert_eq!((found.ward, found.name.as_str(), found.devices.as_slice(), found.loss.as_ref()), (7, "rtp1", &["arm".to_owned()][..], None));
        assert_eq!(found.process.pid(), orphans.rtp.pid());
        orphans.runs();
        // The adopted state suffices to start new guards.
        orphans.guards.iter().for_each(|guard| signal(*guard, libc::SIGKILL));
        assert!(matches!(next(&told), GuardEvent::Restarted { .. }));
        let others = guard.pids();
        found.process.kill();
        assert_eq!(loss(&told).cause, Cause::Died);
        assert!(orphans.is_safe());
        guard.forget(7).unwrap();
        drop(guard);
        until("the other guards end", || others.into_iter().flatten().all(is_gone));
        orphans.end();
    }
}
