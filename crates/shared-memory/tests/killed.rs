// SPDX-License-Identifier: Apache-2.0
//! Processes killed at any instant: the other side continues, a restarted process takes over, and nothing is left behind.
mod processes;

use interconnect::{Ends, Receiver, Sender};
use processes::groups::{SPEC, agrees, fill};
use processes::{FarEnd, folders};
use shared_memory::{SharedMemory, new_run};
use std::hash::{BuildHasher, RandomState};
use std::hint::spin_loop;
use std::sync::mpsc;

/// Number of kills per kind of process and per way to choose the instant.
const KILLS: usize = 20;
const CONNECTION: u64 = 7;
/// Offset between the numbers of consecutive writers.
const STRIDE: u64 = 1 << 32;

/// Returns a number below `limit`.
fn any_below(limit: u64) -> u64 {
    RandomState::new().hash_one(0) % limit
}

/// Returns the name of a system that no other process tests at the same time.
fn system(name: &str) -> String {
    format!("{name}-{:x}", new_run())
}

/// A reader's checks, which span several writers.
struct Reading {
    receiver: Box<dyn Receiver>,
    seen: u64,
    next_row: u64,
}

impl Reading {
    /// Reads the group and a row once; returns true if the group was new.
    fn look(&mut self) -> bool {
        let header = self.receiver.latch(0);
        if let Some(header) = header {
            assert!(agrees(self.receiver.group(), header.number), "publication {} is torn", header.number);
            assert!(header.number > self.seen, "publication {} after {}", header.number, self.seen);
            assert_eq!(header.time_ns, header.number as i64);
            self.seen = header.number;
        }
        if let Some((number, row)) = self.receiver.peek_row() {
            assert!(agrees(row, number), "row {number} is torn");
            assert_eq!(number, self.next_row);
            self.next_row += 1;
            assert!(self.receiver.pop_row());
        }
        header.is_some()
    }

    /// Reads everything that the killed writer has left in memory.
    fn drain(&mut self) {
        while self.look() || self.receiver.rows() > 0 {}
        if self.seen > 0 {
            assert!(agrees(self.receiver.group(), self.seen), "the last complete group stays");
        }
    }
}

#[test]
fn a_reader_keeps_the_last_complete_group_of_each_writer_that_is_killed() {
    let (system, run) = (system("killed-writers"), new_run());
    let mut ends = SharedMemory::new(&system, run).expect("there is shared memory");
    let receiver = ends.receiver(CONNECTION, &SPEC, Box::new(|| ())).expect("the end is free");
    let mut reading = Reading { receiver, seen: 0, next_row: 0 };
    for life in 1..=2 * KILLS as u64 {
        reading.next_row = life * STRIDE;
        let mut writer = FarEnd::start("write", &system, run, &[CONNECTION, life * STRIDE]);
        if life.is_multiple_of(2) {
            assert_eq!(writer.hear(), "ready");
            let mut wanted = any_below(100) + 1;
            while wanted > 0 {
                match reading.look() {
                    true => wanted -= 1,
                    // If both share a core, the writer can write now.
                    false => std::thread::yield_now(),
                }
            }
        } else {
            // Killed during its start, the creation of its end, or its first writes.
            for _ in 0..any_below(200_000) {
                spin_loop();
            }
        }
        writer.kill();
        reading.drain();
    }
    assert_eq!(folders(&system).len(), 1);
    drop(reading);
    drop(ends);
    assert_eq!(folders(&system), Vec::<std::path::PathBuf>::new());
}

/// Returns the names in a run's folder that lead to processes that have exited.
fn left_names(system: &str) -> Vec<std::path::PathBuf> {
    let names = folders(system).into_iter().flat_map(|folder| std::fs::read_dir(folder).expect("its folder").flatten().map(|entry| entry.path()));
    names.filter(|path| path.is_symlink() && !path.exists()).collect()
}

#[test]
fn who_comes_in_the_place_of_a_killed_process_removes_its_names() {
    let (system, run) = (system("killed-names"), new_run());
    let _first = SharedMemory::new(&system, run).expect("there is shared memory");
    for life in 1..=3 {
        // Each has a connection with its own number, as a replacement process does.
        let mut writer = FarEnd::start("write", &system, run, &[CONNECTION + life, STRIDE]);
        assert_eq!(writer.hear(), "ready");
        assert_eq!(left_names(&system), Vec::<std::path::PathBuf>::new());
        writer.kill();
        assert_eq!(left_names(&system).len(), 2, "its bells and its end");
    }
    drop(SharedMemory::new(&system, run).expect("there is shared memory"));
    assert_eq!(left_names(&system), Vec::<std::path::PathBuf>::new());
}

/// Publishes and pushes until `enough`, which receives the last published number.
fn write(sender: &mut dyn Sender, number: &mut u64, row: &mut u64, mut enough: impl FnMut(u64) -> bool) {
    while !enough(*number) {
        *number += 1;
        fill(sender.group(), *number);
        sender.publish(*number, 0);
        *row += u64::from(sender.push(*row, 0, &mut |bytes| fill(bytes, *row)).is_ok());
    }
}

#[test]
fn a_reader_that_is_killed_and_started_again_finds_the_newest_group_and_the_rows_that_wait() {
    let (system, run) = (system("killed-readers"), new_run());
    let mut ends = SharedMemory::new(&system, run).expect("there is shared memory");
    let mut sender = ends.sender(CONNECTION, &SPEC).expect("the end is free");
    let (mut number, mut row) = (0, 0);
    write(&mut *sender, &mut number, &mut row, |number| number == 3);
    for life in 1..=2 * KILLS as u64 {
        let before = number;
        let mut reader = FarEnd::start("read", &system, run, &[CONNECTION]);
        if life % 4 == 0 {
            let first: u64 = reader.hear().parse().expect("the number that it latched first");
            assert_eq!(first, before, "the writer rests: the newest group is the one from before");
        } else if life % 4 == 2 {
            let (say, said) = mpsc::channel();
            std::thread::scope(|scope| {
                scope.spawn(|| say.send(reader.hear()).expect("somebody listens"));
                let mut first = None;
                write(&mut *sender, &mut number, &mut row, |_| {
                    first = first.take().or_else(|| said.try_recv().ok());
                    first.is_some()
                });
                let first: u64 = first.expect("it was awaited").parse().expect("the number that it latched first");
                assert!(first >= before, "it began with {first}, and {before} was published before it came");
            });
        }
        let until = number + any_below(5_000);
        write(&mut *sender, &mut number, &mut row, |number| number == until);
        reader.kill();
    }
    assert_eq!(folders(&system).len(), 1);
    drop(sender);
    drop(ends);
    assert_eq!(folders(&system), Vec::<std::path::PathBuf>::new());
}

#[test]
fn what_is_left_where_all_are_killed_is_removed_by_who_comes_next() {
    let system = system("killed-all");
    for _ in 0..KILLS {
        let run = new_run();
        let mut writer = FarEnd::start("write", &system, run, &[CONNECTION, 1]);
        assert_eq!(writer.hear(), "ready");
        let mut reader = FarEnd::start("read", &system, run, &[CONNECTION]);
        assert!(reader.hear().parse::<u64>().is_ok());
        writer.kill();
        reader.kill();
    }
    drop(SharedMemory::new("successor", new_run()).expect("there is shared memory"));
    assert_eq!(folders(&system), Vec::<std::path::PathBuf>::new());
}
