// SPDX-License-Identifier: Apache-2.0
//! Processes for the tests of this crate: `rtp`, which opens the plant described by its first frame and commands it until it is killed.
use device::Direction;
use interconnect::Link;
use process_kit::{UnixLink, inherited};
use std::os::fd::AsFd;
use std::time::Duration;

fn main() {
    match std::env::args().nth(1).as_deref() {
        Some("rtp") => rtp(),
        other => panic!("there is no stand-in {other:?}"),
    }
}

/// Sends the handle that makes the plant safe, then commands an effort of 1 for every part until the process is killed.
fn rtp() {
    let link = UnixLink::from_descriptor(inherited("link").expect("passed")).expect("a socket");
    let options = link.receive(Duration::from_secs(10)).expect("the test is there").expect("in time");
    let (mut driver, _) = drivers::open("plant_process", &serde_json::from_slice(&options).expect("options")).expect("a plant");
    driver.open(0).unwrap_or_else(|error| panic!("{}", error.message));
    let [handle] = &driver.safe_handles()[..] else { panic!("one handle") };
    link.send_with(&serde_json::to_vec(&handle.writes).expect("bytes"), &[handle.descriptor.as_fd()], None).expect("the test is there");
    let len = |direction| driver.channels().iter().filter(|c| c.direction == direction).map(|c| c.offset + c.len).max().unwrap_or(0);
    let (mut readings, commands) = (vec![0; len(Direction::Read)], 1f64.to_ne_bytes().repeat(len(Direction::Write) / 8));
    let engaged = vec![true; commands.len() / 8];
    for firing in 0.. {
        driver.read(firing * 200_000, &mut readings).unwrap_or_else(|error| panic!("{}", error.message));
        driver.write(firing * 200_000, &commands, &engaged).unwrap_or_else(|error| panic!("{}", error.message));
        std::thread::sleep(Duration::from_micros(200));
    }
}
