// SPDX-License-Identifier: Apache-2.0
//! Processes for the tests of this crate: `rtp`, which stores to its output and beats; `supervisor`, which starts an `rtp` with a guard;
//! `program`, which is guarded itself; `exit N`.
use guard::{Guard, GuardCommand};
use interconnect::Link;
use process_kit::{Heartbeat, Launch, SharedMemory, UnixLink, inherited};
use std::os::fd::AsFd;
use std::sync::atomic::Ordering;
use std::time::Duration;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words[0].as_str() {
        "exit" => std::process::exit(words[1].parse().expect("a number")),
        "rtp" => rtp(),
        "supervisor" => supervisor(),
        "program" => program(),
        other => panic!("there is no stand-in '{other}'"),
    }
}

fn link() -> UnixLink {
    UnixLink::from_descriptor(inherited("link").expect("passed")).expect("a socket")
}

/// Stores 1, 2, 3, … to its output and beats, in an endless loop.
fn rtp() {
    let output = SharedMemory::received(inherited("output").expect("passed"), 16).expect("memory");
    let heartbeat = Heartbeat::received(inherited("heartbeat").expect("passed")).expect("memory");
    for command in 1.. {
        output.word(0).store(command, Ordering::Release);
        heartbeat.beat();
        std::thread::sleep(Duration::from_micros(200));
    }
}

/// Starts an `rtp` with a guard at `GUARD_PATH`, sends its descriptor, and waits to be killed.
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
    guard.watch(7, "rtp1", rtp.descriptor().expect("one"), Some((heartbeat, Duration::from_secs(5).into()))).expect("guarded");
    let handle = device::SafeHandle { descriptor: output.descriptor().expect("one"), writes: vec![(0, vec![0; 8]), (8, vec![1; 8])], latches: false };
    guard.hold(7, "arm", vec![handle]).expect("held");
    let pids = guard.pids().map(|pid| pid.expect("ours").to_string()).join(" ");
    link.send_with(pids.as_bytes(), &[process.as_fd()], None).expect("the test is there");
    while let Ok(None) = link.receive(Duration::from_secs(10)) {}
    panic!("the test ends the supervisor by SIGKILL");
}

/// Stores 1, 2, 3, … to its output and beats, while being guarded itself. Forwards the events of its guards, and on request sends the
/// process IDs of its guards and their stand-ins. Its safe handle latches.
fn program() {
    let link = std::sync::Arc::new(link());
    let output = SharedMemory::received(inherited("output").expect("passed"), 16).expect("memory");
    let command = vec![std::env::var_os("TEST_GUARD").expect("given")];
    let (heartbeat, says) = (Heartbeat::new().expect("memory"), link.clone());
    let guard = Guard::start(GuardCommand { command, path: None }, move |event| says.send(format!("{event:?}").as_bytes()).expect("the test is there"));
    let guard = guard.expect("it starts");
    let beats = Heartbeat::received(heartbeat.descriptor().expect("one")).expect("memory");
    // Only a stop of the program counts: a machine under load may hold it up for longer than the usual bound for silence.
    let bounds = guard::Bounds { silent_ns: 600_000_000_000, ..guard::Bounds::default() };
    guard.watch_this(1, "program", heartbeat, bounds).expect("guarded");
    let handle = device::SafeHandle { descriptor: output.descriptor().expect("one"), writes: vec![(8, vec![1; 8])], latches: true };
    guard.hold(1, "arm", vec![handle]).expect("held");
    link.send(b"begun").expect("the test is there");
    for command in 1.. {
        output.word(0).store(command, Ordering::Release);
        beats.beat();
        // All requests are the same.
        if let Ok(Some(_asked)) = link.receive(Duration::from_millis(1)) {
            link.send(format!("guards {:?}; {:?}", guard.pids(), guard.stand_ins()).as_bytes()).expect("the test is there");
        }
    }
}
