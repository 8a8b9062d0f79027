// SPDX-License-Identifier: Apache-2.0
//! Processes start with exactly the named resources, and leave nothing when they end.
use interconnect::Link;
use process_kit::{Child, ChildChange, Launch, Status, UnixLink, next_change};
use std::ffi::OsString;
use std::os::fd::{AsFd, AsRawFd, OwnedFd};
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(300);

fn stand_in(words: &[&str]) -> Launch {
    let program: OsString = env!("CARGO_BIN_EXE_process-kit-stand-in").into();
    Launch::new([program].into_iter().chain(words.iter().map(OsString::from)))
}

fn linked(words: &[&str]) -> (Child, UnixLink) {
    let (link, theirs) = UnixLink::pair().unwrap();
    (stand_in(words).descriptor("link", theirs).real_time_max(Duration::from_secs(3)).start().unwrap(), link)
}

#[test]
fn a_process_ends_in_words() {
    let ended = |words: &[&str]| stand_in(words).start().unwrap().wait(LIMIT).expect("it ends").to_string();
    assert_eq!(ended(&["exit", "0"]), "ended by itself");
    assert_eq!(ended(&["exit", "3"]), "ended by itself with status 3");
    assert!(ended(&["abort"]).starts_with("was ended by SIGABRT (it aborted)"));
}

#[test]
fn a_program_that_is_not_there_is_named() {
    let refused = Launch::new(["/nowhere/program".into(), "--now".into()]).start().expect_err("there is none").to_string();
    assert!(refused.contains("cannot start '/nowhere/program --now'") && refused.contains("No such file"), "{refused}");
    assert!(Launch::new([]).start().expect_err("no words").to_string().contains("is empty"));
}

#[test]
fn it_gets_what_is_named_and_nothing_else() {
    // A descriptor that no library marked close-on-exec.
    let open: OwnedFd = std::fs::File::open("/dev/null").unwrap().into();
    // SAFETY: clears a flag of our own descriptor.
    unsafe { libc::fcntl(open.as_raw_fd(), libc::F_SETFD, 0) };
    let (child, link) = linked(&["words"]);
    let said = String::from_utf8(link.receive(LIMIT).unwrap().expect("in time")).unwrap();
    assert_eq!(said, "0,1,2,3 true 3000000 true", "descriptors, group of its own, limit of real-time threads, taken once");
    link.close();
    assert_eq!(child.wait(LIMIT), Some(Status::Exited(0)));
}

#[test]
fn what_it_started_ends_with_it() {
    let (child, link) = linked(&["parent"]);
    let sleeper: i32 = String::from_utf8(link.receive(LIMIT).unwrap().expect("in time")).unwrap().parse().unwrap();
    assert!(std::path::Path::new(&format!("/proc/{sleeper}")).exists());
    drop(child);
    let gone = || match std::fs::read_to_string(format!("/proc/{sleeper}/stat")) {
        Err(_) => true,
        // A process that its new parent has not reaped yet.
        Ok(stat) => stat.contains(") Z "),
    };
    let deadline = std::time::Instant::now() + LIMIT;
    while !gone() {
        assert!(std::time::Instant::now() < deadline, "the sleeper outlives its group");
        std::thread::yield_now();
    }
    assert!(link.receive(LIMIT).is_err(), "the other side is gone");
}

#[test]
fn a_stopped_process_ends_when_it_is_asked_to() {
    let (child, link) = linked(&["parent"]);
    link.receive(LIMIT).unwrap().expect("in time");
    // SAFETY: signals our child.
    unsafe { libc::kill(child.pid(), libc::SIGSTOP) };
    assert_eq!(child.end(LIMIT), Status::Killed { signal: libc::SIGTERM, core: false });
    assert_eq!(child.wait(Duration::ZERO), Some(Status::Killed { signal: libc::SIGTERM, core: false }), "it is remembered");
}

#[test]
fn the_changes_of_a_child_are_told_in_their_order_and_it_is_not_reaped() {
    let (child, link) = linked(&["parent"]);
    link.receive(LIMIT).unwrap().expect("in time");
    let process = child.descriptor().unwrap();
    // SAFETY: signals our child, which has not been reaped.
    let signal = |signal| unsafe { libc::kill(child.pid(), signal) };
    for _ in 0..2 {
        signal(libc::SIGSTOP);
        assert_eq!(next_change(process.as_fd(), false), ChildChange::Stopped);
        signal(libc::SIGCONT);
        assert_eq!(next_change(process.as_fd(), true), ChildChange::Continued);
    }
    signal(libc::SIGSTOP);
    assert_eq!(next_change(process.as_fd(), false), ChildChange::Stopped);
    signal(libc::SIGKILL);
    assert_eq!(next_change(process.as_fd(), true), ChildChange::Ended);
    assert_eq!(child.wait(LIMIT), Some(Status::Killed { signal: libc::SIGKILL, core: false }), "its end is still there");
    assert_eq!(next_change(process.as_fd(), false), ChildChange::Ended);
}

#[test]
fn a_process_that_is_started_urgently_has_the_priority_of_the_thread_that_starts_it() {
    // SAFETY: queries a child that has not been reaped.
    let scheduling = |pid| unsafe { libc::sched_getscheduler(pid) };
    let is_given = scheduling::prioritise(1, scheduling::Children::Inherit);
    let (urgent, ordinary) = (stand_in(&["parent"]).urgently(), stand_in(&["parent"]));
    let with_link = |launch: Launch| {
        let (link, theirs) = UnixLink::pair().unwrap();
        (launch.descriptor("link", theirs).start().unwrap(), link)
    };
    let ((urgent, _link), (ordinary, _other)) = (with_link(urgent), with_link(ordinary));
    assert_eq!(scheduling(urgent.pid()), if is_given { libc::SCHED_FIFO } else { libc::SCHED_OTHER });
    assert_eq!(scheduling(ordinary.pid()), libc::SCHED_OTHER);
}

#[test]
fn an_adopted_process_is_known_by_its_descriptor() {
    let (child, link) = linked(&["parent"]);
    link.receive(LIMIT).unwrap().expect("in time");
    let adopted = Child::adopt(child.descriptor().unwrap()).unwrap();
    assert_eq!(adopted.pid(), child.pid());
    assert!(adopted.is_running());
    adopted.kill();
    assert_eq!(child.wait(LIMIT), Some(Status::Killed { signal: libc::SIGKILL, core: false }));
    assert_eq!(adopted.wait(LIMIT), Some(Status::Ended));
    let other: OwnedFd = std::fs::File::open("/dev/null").unwrap().into();
    assert!(Child::adopt(other).is_err());
}
