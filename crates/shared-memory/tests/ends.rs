// SPDX-License-Identifier: Apache-2.0
//! Creation, refusal and dropping of ends.
mod processes;

use interconnect::{ConnectionSpec, Ends, Header};
use processes::folders;
use shared_memory::{SharedMemory, new_run};
use std::sync::mpsc;

const SPEC: ConnectionSpec = ConnectionSpec { writer: 3, reader: 5, asynchronous_len: 8, queue_row_len: 8, queue_depth: 4 };

fn enter(run: u64) -> SharedMemory {
    SharedMemory::new("ends", run).expect("there is shared memory")
}

fn nobody() -> Box<dyn Fn() + Send + Sync> {
    Box::new(|| ())
}

#[test]
fn a_second_end_of_a_kind_is_refused_while_the_first_lives() {
    let run = new_run();
    let (mut here, mut there) = (enter(run), enter(run));
    let first = here.sender(1, &SPEC).expect("the end is free");
    let refused = there.sender(1, &SPEC).err().expect("there is one").message;
    assert_eq!(
        refused,
        "cannot create the writing end of connection 1 (source 3 to source 5) in shared memory: its writing end already exists; drop that one first"
    );
    drop(first);
    assert!(there.sender(1, &SPEC).is_ok());
}

#[test]
fn ends_of_different_lengths_are_refused() {
    let run = new_run();
    let (mut here, mut there) = (enter(run), enter(run));
    let _sender = here.sender(1, &SPEC).expect("the end is free");
    let other = ConnectionSpec { asynchronous_len: 16, queue_depth: 2, ..SPEC };
    let refused = there.receiver(1, &other, nobody()).err().expect("it differs").message;
    assert_eq!(
        refused,
        "cannot create the reading end of connection 1 (source 3 to source 5) in shared memory: the writing end was created for a group of 8 bytes and 4 rows \
         of 8, but this one is for a group of 16 bytes and 2 rows of 8; create both for the same"
    );
    assert!(there.receiver(1, &SPEC, nobody()).is_ok(), "the refusal claimed nothing");
}

#[test]
fn what_was_published_and_pushed_before_the_reader_came_is_found_and_raises_it() {
    let run = new_run();
    let (mut here, mut there) = (enter(run), enter(run));
    let mut sender = here.sender(1, &SPEC).expect("the end is free");
    for number in 1..=3 {
        sender.group().fill(number as u8);
        sender.publish(number, 10);
        sender.push(number, 10, &mut |row| row.fill(number as u8)).expect("there is room");
    }
    let (raise, raised) = mpsc::channel();
    let mut receiver = there.receiver(1, &SPEC, Box::new(move || raise.send(()).expect("the test listens"))).expect("the end is free");
    for _ in 0..3 {
        raised.recv().expect("each row raises");
    }
    assert_eq!(receiver.latch(0), Some(Header { number: 3, time_ns: 10 }));
    assert_eq!((receiver.group(), receiver.rows()), ([3; 8].as_slice(), 3));
    assert_eq!(receiver.peek_row(), Some((1, [1; 8].as_slice())));
}

#[test]
fn an_end_that_was_dropped_can_be_made_again_while_the_other_lives() {
    let run = new_run();
    let (mut here, mut there) = (enter(run), enter(run));
    let mut sender = here.sender(1, &SPEC).expect("the end is free");
    let mut next = 0u64;
    for _ in 0..10 {
        let mut receiver = there.receiver(1, &SPEC, nobody()).expect("the end is free");
        assert_eq!(receiver.group(), [0; 8], "zeros before the first latch");
        assert_eq!(receiver.latch(0).map(|header| header.number), next.checked_sub(1), "the newest, also where the reader before had it");
        for _ in 0..3 {
            sender.group().fill(next as u8);
            sender.publish(next, 0);
            assert_eq!(receiver.latch(0).map(|header| header.number), Some(next));
            assert_eq!(receiver.group(), [next as u8; 8]);
            next += 1;
        }
        assert_eq!(receiver.latch(0), None);
    }
    let mut receiver = there.receiver(1, &SPEC, nobody()).expect("the end is free");
    drop(sender);
    for _ in 0..10 {
        let mut sender = here.sender(1, &SPEC).expect("the end is free");
        sender.group().fill(next as u8);
        sender.publish(next, 0);
        assert_eq!(receiver.latch(0).map(|header| header.number), Some(next));
        assert_eq!(receiver.group(), [next as u8; 8]);
        sender.group().fill(0xee);
        assert_eq!((receiver.latch(0), receiver.group()), (None, [next as u8; 8].as_slice()));
        next += 1;
    }
}

#[test]
fn runs_do_not_meet_and_a_connection_whose_ends_are_gone_begins_anew() {
    let run = new_run();
    let (mut here, mut there, mut elsewhere) = (enter(run), enter(run), enter(new_run()));
    let mut sender = here.sender(1, &SPEC).expect("the end is free");
    sender.publish(1, 0);
    assert_eq!(elsewhere.receiver(1, &SPEC, nobody()).expect("the end is free").latch(0), None);
    drop(sender);
    assert_eq!(there.receiver(1, &SPEC, nobody()).expect("the end is free").latch(0), None);
}

#[test]
fn connections_that_are_gone_leave_nothing() {
    let (system, run) = (format!("ends-{:x}", new_run()), new_run());
    let mut ends = SharedMemory::new(&system, run).expect("there is shared memory");
    for number in 0..1_000 {
        let sender = ends.sender(number, &SPEC).expect("the end is free");
        let receiver = ends.receiver(number, &SPEC, nobody()).expect("the end is free");
        match number % 2 {
            0 => drop(receiver),
            _ => drop((sender, receiver)),
        }
    }
    let [folder] = folders(&system).try_into().expect("one folder a run");
    let mut left: Vec<_> = std::fs::read_dir(&folder).expect("it is ours").map(|entry| entry.expect("it is ours").file_name()).collect();
    left.sort();
    let names: Vec<_> = left.iter().map(|name| name.to_string_lossy().split('-').next().unwrap_or_default().to_owned()).collect();
    assert_eq!(names, ["bells", "members"]);

    let sender = ends.sender(0, &SPEC).expect("the end is free");
    drop(ends);
    assert!(folder.exists(), "an end keeps what it stands on");
    drop(sender);
    assert!(!folder.exists());
}
