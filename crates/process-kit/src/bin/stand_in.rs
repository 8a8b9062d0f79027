// SPDX-License-Identifier: Apache-2.0
//! Processes for the tests of this crate: `exit N`; `abort`; `words`, which prints its environment; `parent`, which starts another
//! process.
use interconnect::Link;
use process_kit::{UnixLink, inherited};
use std::time::Duration;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words[0].as_str() {
        "exit" => std::process::exit(words[1].parse().expect("a number")),
        "abort" => std::process::abort(),
        "words" => say_words(),
        "parent" => parent(),
        other => panic!("there is no stand-in '{other}'"),
    }
}

fn link() -> UnixLink {
    UnixLink::from_descriptor(inherited("link").expect("passed")).expect("a socket")
}

/// Prints the environment of this process: open descriptors, process group, limit on real-time threads.
fn say_words() {
    let link = link();
    let open: Vec<String> = (0..64).filter(|fd| std::fs::symlink_metadata(format!("/proc/self/fd/{fd}")).is_ok()).map(|fd| fd.to_string()).collect();
    // SAFETY: asks about this process; the limit is a value of our own.
    let (group, limit) = unsafe {
        let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
        libc::getrlimit(libc::RLIMIT_RTTIME, &mut limit);
        (libc::getpgrp(), limit.rlim_cur)
    };
    let again = inherited("link").expect_err("taken").to_string().contains("already taken");
    let text = format!("{} {} {limit} {again}", open.join(","), group.cast_unsigned() == std::process::id());
    link.send(text.as_bytes()).expect("the test is there");
    // Until the test closes the link.
    let _closed = link.receive(Duration::from_secs(10));
}

/// Starts a process in its own group and prints its process ID, then exits with the link, ignoring the started process.
#[allow(clippy::zombie_processes, reason = "that somebody else ends and reaps it is what the test is about")]
fn parent() {
    let link = link();
    let sleeper = std::process::Command::new("sleep").arg("1000").spawn().expect("there is sleep");
    link.send(sleeper.id().to_string().as_bytes()).expect("the test is there");
    while let Ok(None) = link.receive(Duration::from_secs(10)) {}
}
