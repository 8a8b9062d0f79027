// SPDX-License-Identifier: Apache-2.0
//! The process on the other side: `far-end MODE SYSTEM RUN [NUMBER [FROM]]`.
#[path = "../groups.rs"]
mod groups;
mod obey;

use groups::{GROUP_LEN, SPEC, agrees, fill};
use interconnect::Ends;
use shared_memory::SharedMemory;
use std::io::{Write, stdout};

fn main() {
    // A killed test leaves no writing process behind. SAFETY: requests a signal; no memory of this process is touched.
    unsafe { libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL) };
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [mode, system, run, more @ ..] = arguments.as_slice() else { panic!("far-end MODE SYSTEM RUN [NUMBER [FROM]]") };
    let number_at = |at: usize| more.get(at).map_or(0, |text| text.parse().expect("a number"));
    let ends = SharedMemory::new(system, run.parse().expect("a number")).expect("there is shared memory");
    match mode.as_str() {
        "obey" => obey::obey(ends),
        "write" => write(ends, number_at(0), number_at(1)),
        "read" => read(ends, number_at(0)),
        _ => panic!("there is no mode '{mode}'"),
    }
}

fn say(word: &str) {
    println!("{word}");
    stdout().flush().expect("who started this process reads");
}

/// Publishes and pushes, from number `from` on, until it is killed.
fn write(mut ends: SharedMemory, connection: u64, from: u64) {
    let mut sender = ends.sender(connection, &SPEC).expect("the end is free");
    say("ready");
    let mut row = from;
    for number in from.. {
        fill(sender.group(), number);
        sender.publish(number, number as i64);
        if sender.push(row, 0, &mut |bytes| fill(bytes, row)).is_ok() {
            row += 1;
        }
    }
}

/// Latches and takes rows until it is killed; prints the first latched number, and exits with a failure if anything is torn or out of
/// order.
fn read(mut ends: SharedMemory, connection: u64) {
    let mut receiver = ends.receiver(connection, &SPEC, Box::new(|| ())).expect("the end is free");
    assert_eq!(receiver.group(), [0; GROUP_LEN], "zeros before the first latch");
    let (mut seen, mut next) = (None, None);
    loop {
        if let Some(header) = receiver.latch(0) {
            assert!(agrees(receiver.group(), header.number), "publication {} is torn", header.number);
            assert!(seen.is_none_or(|seen| seen < header.number), "publication {} after {seen:?}", header.number);
            if seen.is_none() {
                say(&format!("{}", header.number));
            }
            seen = Some(header.number);
        } else {
            std::thread::yield_now();
        }
        if let Some((number, row)) = receiver.peek_row() {
            assert!(agrees(row, number), "row {number} is torn");
            assert!(next.is_none_or(|next| next == number), "row {number} instead of {next:?}");
            next = Some(number + 1);
            receiver.pop_row();
        }
    }
}
