// SPDX-License-Identifier: Apache-2.0
//! Processes for the tests of this crate: `rtp` stores to its output and beats, `supervisor` starts one with a guard, `exit N`,
//! `abort`, `words` says what it was started with.
use guard::{Guard, GuardCommand, Heartbeat, Launch, SharedMemory, UnixLink, inherited};
use interconnect::Link;
use std::os::fd::AsFd;
use std::sync::atomic::Ordering;
use std::time::Duration;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words[0].as_str() {
        "exit" => std::process::exit(words[1].parse().expect("a number")),
        "abort" => std::process::abort(),
        "words" => say_words(),
        "parent" => parent(),
        "rtp" => rtp(),
        "supervisor" => supervisor(),
        other => panic!("no stand-in '{other}'"),
    }
}

fn link() -> UnixLink {
    UnixLink::from_descriptor(inherited("link").expect("passed")).expect("a socket")
}

/// What it was started with: open descriptors, process group, limit of real-time threads.
fn say_words() {
    let link = link();
    let open: Vec<String> = (0..64).filter(|fd| std::fs::symlink_metadata(format!("/proc/self/fd/{fd}")).is_ok()).map(|fd| fd.to_string()).collect();
    // SAFETY: asks about this process; the limit is a value of our own.
    let (group, limit) = unsafe {
        let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
        libc::getrlimit(libc::RLIMIT_RTTIME, &mut limit);
        (libc::getpgrp(), limit.rlim_cur)
    };
    let again = inherited("link").expect_err("taken").to_string().contains("taken before");
    let text = format!("{} {} {limit} {again}", open.join(","), group.cast_unsigned() == std::process::id());
    link.send(text.as_bytes()).expect("the test is there");
    // Until the test closes the link.
    let _closed = link.receive(Duration::from_secs(10));
}

/// Starts a process in its own group and says its number, then ends when the link does, without a look at what it started.
#[allow(clippy::zombie_processes, reason = "that somebody else ends and reaps it is what the test is about")]
fn parent() {
    let link = link();
    let sleeper = std::process::Command::new("sleep").arg("1000").spawn().expect("there is sleep");
    link.send(sleeper.id().to_string().as_bytes()).expect("the test is there");
    while let Ok(None) = link.receive(Duration::from_secs(10)) {}
}

/// Stores 1, 2, 3, … to its output and beats, for ever.
fn rtp() {
    let output = SharedMemory::received(inherited("output").expect("passed"), 16).expect("memory");
    let heartbeat = Heartbeat::received(inherited("heartbeat").expect("passed")).expect("memory");
    for command in 1.. {
        output.word(0).store(command, Ordering::Release);
        heartbeat.beat();
        std::thread::sleep(Duration::from_micros(200));
    }
}

/// Starts an rtp with a guard at `GUARD_PATH`, sends the rtp's descriptor, and waits to be killed.
fn supervisor() {
    let link = link();
    let output = SharedMemory::received(inherited("output").expect("passed"), 16).expect("memory");
    let path = std::env::var_os("TEST_GUARD_PATH").expect("given").into();
    let program = std::env::var_os("TEST_GUARD").expect("given");
    let heartbeat = Heartbeat::new().expect("memory");
    let this = std::env::current_exe().expect("it has a path").into_os_string();
    let descriptors = (output.descriptor().expect("one"), heartbeat.descriptor().expect("one"));
    let rtp = Launch::new([this, "rtp".into()]).descriptor("output", descriptors.0).descriptor("heartbeat", descriptors.1).start().expect("it starts");
    let guard = Guard::start(GuardCommand { command: vec![program], path: Some(path) }, |_| {}).expect("it starts");
    let process = rtp.descriptor().expect("one");
    guard.watch(7, "rtp1", rtp.descriptor().expect("one"), Some((heartbeat, Duration::from_secs(5)))).expect("guarded");
    let handle = kernel::SafeHandle { descriptor: output.descriptor().expect("one"), writes: vec![(0, vec![0; 8]), (8, vec![1; 8])] };
    guard.hold(7, "arm", vec![handle]).expect("held");
    let guard_pid = guard.pid().expect("ours").to_string();
    link.send_with(guard_pid.as_bytes(), &[process.as_fd()], None).expect("the test is there");
    while let Ok(None) = link.receive(Duration::from_secs(10)) {}
    panic!("the test ends the supervisor by SIGKILL");
}
