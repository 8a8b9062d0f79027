// SPDX-License-Identifier: Apache-2.0
//! The link for commands: whole frames, in order, each exactly once, or closed.
mod common;
use common::*;
use hosts::{Faulty, Hosts, Options, WireFaults, wire_to_join};
use interconnect::{Link, LinkClosed};
use std::sync::Arc;
use std::time::Duration;

fn pair(system: &str) -> (Hosts, Hosts, Box<dyn Link>, Box<dyn Link>) {
    let (a, endpoint) = listening(system);
    let b = Hosts::join(options_of(system, "cell-b", &endpoint)).expect("cell-a listens");
    let near = a.link("cell-b", 1).expect("cell-b has joined");
    let far = b.link("cell-a", 1).expect("cell-a listens");
    (a, b, near, far)
}

fn frame(number: usize, len: usize) -> Vec<u8> {
    (0..len).map(|at| (at * 7 + number) as u8).collect()
}

#[test]
fn frames_of_any_length_come_whole_and_in_order_both_ways() {
    let (_a, _b, near, far) = pair("frames");
    let lengths = [0, 1, 16 * 1024 - 1, 16 * 1024, 16 * 1024 + 1, 100, 3_000_000, 5];
    std::thread::scope(|scope| {
        for (sends, receives) in [(&near, &far), (&far, &near)] {
            scope.spawn(|| lengths.iter().enumerate().for_each(|(number, len)| sends.send(&frame(number, *len)).expect("it is open")));
            scope.spawn(|| {
                for (number, len) in lengths.iter().enumerate() {
                    let came = receives.receive(LONG).expect("it is open").expect("it was sent");
                    assert!(came == frame(number, *len), "frame {number} of {len} bytes came with {} bytes", came.len());
                }
            });
        }
    });
    assert_eq!(near.receive(Duration::ZERO), Ok(None));
}

#[test]
fn frames_of_several_threads_are_not_mixed() {
    let (_a, _b, near, far) = pair("threads");
    std::thread::scope(|scope| {
        for thread in 0..4u8 {
            let near = &near;
            scope.spawn(move || (0..20).for_each(|_| near.send(&vec![thread; 50_000]).expect("it is open")));
        }
        for _ in 0..80 {
            let came = far.receive(LONG).expect("it is open").expect("it was sent");
            assert!(came.len() == 50_000 && came.iter().all(|byte| *byte == came[0]));
        }
    });
}

#[test]
fn a_closed_link_is_closed_on_both_sides_behind_its_last_frame() {
    let (_a, _b, near, far) = pair("closed");
    near.send(b"last").expect("it is open");
    near.close();
    assert_eq!(near.send(b"too late"), Err(LinkClosed));
    assert_eq!(near.receive(LONG), Err(LinkClosed));
    assert_eq!(far.receive(LONG), Ok(Some(b"last".to_vec())));
    assert_eq!(far.receive(LONG), Err(LinkClosed));
    assert_eq!(far.send(b"nobody there"), Err(LinkClosed));
}

#[test]
fn a_dropped_link_and_a_host_that_goes_close_too() {
    let (a, b, near, far) = pair("dropped");
    far.send(b"one").expect("it is open");
    drop(far);
    assert_eq!(near.receive(LONG), Ok(Some(b"one".to_vec())));
    assert_eq!(near.receive(LONG), Err(LinkClosed));

    let (near, far) = (a.link("cell-b", 2).expect("joined"), b.link("cell-a", 2).expect("listens"));
    far.send(b"two").expect("it is open");
    drop(b);
    assert_eq!(near.receive(LONG), Ok(Some(b"two".to_vec())));
    assert_eq!(near.receive(LONG), Err(LinkClosed));
    assert!(a.peers().is_empty(), "its name is free at once");
    drop(far);
}

#[test]
fn a_receiver_that_waits_learns_of_a_close_here() {
    let (_a, _b, near, _far) = pair("waits");
    std::thread::scope(|scope| {
        let waits = scope.spawn(|| near.receive(LONG));
        near.close();
        assert_eq!(waits.join().expect("it does not panic"), Err(LinkClosed));
    });
}

#[test]
fn a_silent_host_closes_its_links_and_a_shorter_silence_does_not() {
    let endpoint = format!("tcp/127.0.0.1:{}", free_port());
    // Far longer than a busy machine delays a thread: the first silence must stay the shorter one.
    let silent_max = Duration::from_secs(6);
    let a = Hosts::listen(Options { silent_max, ..options_of("silent", "cell-a", &endpoint) }).expect("loopback");
    let options = Options { silent_max, ..options_of("silent", "cell-b", &endpoint) };
    let wire = Faulty::new(wire_to_join(&options).expect("cell-a listens"), 1, WireFaults::default());
    let b = Hosts::join_over(options, Arc::new(wire.clone())).expect("cell-a listens");
    let (near, far) = (a.link("cell-b", 1).expect("joined"), b.link("cell-a", 1).expect("listens"));

    wire.set(WireFaults::cut());
    far.send(b"in the partition").expect("it may wait");
    assert_eq!(near.receive(Duration::from_millis(500)), Ok(None));
    wire.set(WireFaults::default());
    assert_eq!(near.receive(LONG), Ok(Some(b"in the partition".to_vec())));

    wire.set(WireFaults::cut());
    assert_eq!(near.receive(LONG), Err(LinkClosed), "cell-a hears nothing");
    assert_eq!(far.receive(LONG), Err(LinkClosed), "and says nothing that cell-b hears, as it answers pings only");
    assert!(a.peers()[0].gone);
    assert!(a.link("cell-b", 2).is_err());
    wire.set(WireFaults::default());
    wait_until("each hears the other again", || !a.peers()[0].gone && !b.peers()[0].gone);
    assert_eq!(near.send(b"closed is closed"), Err(LinkClosed));
    let (near, far) = (a.link("cell-b", 3).expect("it is back"), b.link("cell-a", 3).expect("it is back"));
    near.send(b"a new link").expect("it is open");
    assert_eq!(far.receive(LONG), Ok(Some(b"a new link".to_vec())));
}
