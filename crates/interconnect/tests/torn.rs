// SPDX-License-Identifier: Apache-2.0
//! Searches for torn reads with threads: the numbers of each group and row only agree if all of it was written at once.
#![cfg(not(loom))]
use interconnect::{Carrier, ConnectionSpec, Header, Memory, queue, rows};
use std::sync::Barrier;
use std::thread;

const PUBLICATIONS: u64 = 200_000;
/// Values in a group: more than a cache line.
const VALUES: usize = 32;

/// Fills `bytes` with values that follow from `number`.
fn fill(bytes: &mut [u8], number: u64) {
    for (index, value) in bytes.as_chunks_mut::<8>().0.iter_mut().enumerate() {
        *value = number.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(index as u32).to_le_bytes();
    }
}

/// Returns true if all of `bytes` was written for `number`.
fn agrees(bytes: &[u8], number: u64) -> bool {
    let mut expected = vec![0; bytes.len()];
    fill(&mut expected, number);
    expected == bytes
}

#[test]
fn r049_a_group_is_never_torn_between_threads() {
    let spec = ConnectionSpec { writer: 0, reader: 1, asynchronous_len: VALUES * 8, queue_row_len: 0, queue_depth: 0 };
    let (mut sender, mut receiver) = Memory.connect(&spec);
    let start = Barrier::new(2);
    thread::scope(|scope| {
        scope.spawn(|| {
            start.wait();
            for number in 1..=PUBLICATIONS {
                fill(sender.group(), number);
                sender.publish(number, -(number as i64));
            }
        });
        start.wait();
        let mut seen = Header::default();
        while seen.number < PUBLICATIONS {
            let Some(header) = receiver.latch(0) else {
                std::hint::spin_loop();
                continue;
            };
            assert!(header.number > seen.number, "publication {} after {}", header.number, seen.number);
            assert_eq!(header.time_ns, -(header.number as i64));
            assert!(agrees(receiver.group(), header.number), "publication {} is torn", header.number);
            seen = header;
        }
    });
}

#[test]
fn every_row_of_a_queue_comes_once_and_whole_between_threads() {
    let (mut writer, mut reader) = queue(VALUES * 8, 4);
    thread::scope(|scope| {
        scope.spawn(|| {
            for number in 0..PUBLICATIONS {
                while writer.push(number, |row| fill(row, number)).is_err() {
                    thread::yield_now();
                }
            }
        });
        for expected in 0..PUBLICATIONS {
            let (number, row) = loop {
                // Peeked again below: a borrow cannot outlive an iteration of the loop.
                if reader.peek().is_some() {
                    break reader.peek().expect("a row stays until it is popped");
                }
                thread::yield_now();
            };
            assert_eq!(number, expected);
            assert!(agrees(row, number), "row {number} is torn");
            assert!(reader.pop());
        }
        assert!(!reader.pop());
    });
}

#[test]
fn rows_are_never_torn_for_several_readers() {
    let (mut writer, reader) = rows(VALUES * 8, 8);
    let start = Barrier::new(3);
    thread::scope(|scope| {
        let newest = reader.clone();
        scope.spawn(|| {
            let newest = newest;
            start.wait();
            let mut seen = 0;
            while seen < PUBLICATIONS - 1 {
                let Some(row) = newest.newest() else { continue };
                assert!(row.sequence >= seen, "row {} after {seen}", row.sequence);
                assert!(row.number == row.sequence && agrees(&row.bytes, row.number), "row {} is torn", row.number);
                seen = row.sequence;
            }
        });
        scope.spawn(|| {
            let (mut next, mut read, mut lost, mut out) = (0, 0, 0, Vec::new());
            start.wait();
            while next < PUBLICATIONS {
                let missed = reader.since(next, &mut out);
                next += missed + out.len() as u64;
                (read, lost) = (read + out.len() as u64, lost + missed);
                for row in out.drain(..) {
                    assert!(row.number == row.sequence && agrees(&row.bytes, row.number), "row {} is torn", row.number);
                }
            }
            assert_eq!(read + lost, PUBLICATIONS);
            assert!(read > 0);
        });
        start.wait();
        let mut values = vec![0; VALUES * 8];
        for number in 0..PUBLICATIONS {
            fill(&mut values, number);
            writer.write(number, 0, |sink| sink.put(&values));
        }
    });
}
