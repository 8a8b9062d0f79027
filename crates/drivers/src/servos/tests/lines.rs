// SPDX-License-Identifier: Apache-2.0
//! A bus on a pseudo terminal, and a servo at its other end with scripted answers.
use super::codecs::answer;
use crate::serial::tests::pty;
use crate::servos::bus::{Bus, Count, Timing};
use crate::servos::protocol::Protocol;
use crate::servos::registers::Register;
use device::Counters;
use std::fs::File;
use std::io::{Read, Write};
use std::sync::Arc;
use std::time::Duration;

const MODEL: Register = Register { address: 3, len: 2 };
const ASKED: [u8; 8] = [0xff, 0xff, 1, 4, 2, 3, 2, 0xf3];

fn bus(path: &str, latency: Duration, echo: Option<bool>) -> (Bus, Arc<Counters>) {
    let counters = Arc::new(Counters::new(Count::WORDS));
    let timing = Timing { baud: 1_000_000, latency, retries: 100, echo };
    (Bus::open(path, Protocol::Sts, timing, counters.clone()).expect("it opens"), counters)
}

/// Answers each request with the next entry of `said`, and repeats the last one until the line is closed.
fn peer(mut device: File, said: Vec<Vec<u8>>) -> std::thread::JoinHandle<()> {
    std::thread::spawn(move || {
        let mut at = 0;
        let mut request = [0; ASKED.len()];
        while device.read_exact(&mut request).is_ok() {
            assert_eq!(request, ASKED);
            if device.write_all(&said[at.min(said.len() - 1)]).is_err() {
                return;
            }
            at += 1;
        }
    })
}

fn value(said: Vec<Vec<u8>>, latency: Duration, echo: Option<bool>) -> (u32, Arc<Counters>) {
    let (device, path) = pty();
    // Held open, so that the far end does not read an end of the line before the bus has opened it.
    let peer = peer(device, said);
    let (mut bus, counters) = bus(&path, latency, echo);
    bus.find_echo(1, MODEL).expect("the line is there");
    let read = bus.read(1, MODEL).expect("the line is there").expect("it answers");
    drop(bus);
    peer.join().expect("it was asked for what it knows");
    (read.value, counters)
}

fn good() -> Vec<u8> {
    answer(Protocol::Sts, 1, 0, &[9, 3])
}

/// Time limit that is long enough for any machine; the tests never wait that long.
const LONG: Duration = Duration::from_secs(60);
/// Time limit for missing answers; late answers cause retries.
const SHORT: Duration = Duration::from_millis(100);

#[test]
fn an_answer_is_taken_with_and_without_an_echo() {
    assert_eq!(value(vec![good()], LONG, None).0, 777);
    assert_eq!(value(vec![[&ASKED[..], &good()].concat()], LONG, None).0, 777);
}

#[test]
fn what_is_no_answer_is_counted_and_dropped() {
    let mut bad = good();
    bad[6] ^= 0x10;
    let strange = answer(Protocol::Sts, 2, 0, &[1, 1]);
    let long = answer(Protocol::Sts, 1, 0, &[1, 1, 1]);
    let (read, counters) = value(vec![good(), [bad, strange, long, vec![7, 7], good()].concat()], LONG, None);
    assert_eq!((read, counters.get(Count::FramesBad), counters.get(Count::FramesStrange), counters.get(Count::Timeouts)), (777, 1, 2, 0));
}

#[test]
fn a_servo_that_does_not_answer_is_asked_again() {
    let (read, counters) = value(vec![Vec::new(), good()], SHORT, Some(false));
    assert_eq!(read, 777);
    assert!(counters.get(Count::Retries) >= 1 && counters.get(Count::Timeouts) >= 1);
}

#[test]
fn a_line_that_is_gone_is_an_error() {
    let (device, path) = pty();
    let (mut bus, _) = bus(&path, LONG, None);
    drop(device);
    assert!(bus.read(1, MODEL).is_err());
}
