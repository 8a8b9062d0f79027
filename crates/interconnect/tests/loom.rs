// SPDX-License-Identifier: Apache-2.0
//! Models of the lock-free structures: every order of their steps that the memory model permits. `RUSTFLAGS="--cfg loom" cargo test -p
//! interconnect --release --test loom`
#![cfg(loom)]
use interconnect::{QueueReader, queue, rows, triple_buffer};
use loom::thread;

/// All executions with at most this many preemptions (loom's own bound for models that are not tiny).
const PREEMPTIONS_MAX: usize = 5;

fn model(check: impl Fn() + Sync + Send + 'static) {
    let mut builder = loom::model::Builder::new();
    builder.preemption_bound = Some(PREEMPTIONS_MAX);
    builder.check(check);
}

/// Returns the value that all bytes share.
fn whole(bytes: &[u8]) -> u8 {
    assert!(bytes.iter().all(|byte| *byte == bytes[0]), "torn: {bytes:?}");
    bytes[0]
}

#[test]
fn triple_buffer_is_never_torn_and_never_goes_back() {
    model(|| {
        let (mut writer, mut reader) = triple_buffer(2);
        let writing = thread::spawn(move || {
            for value in 1..=3 {
                writer.back().fill(value);
                writer.publish();
            }
        });
        let mut seen = 0;
        for _ in 0..2 {
            let news = reader.latch();
            let value = whole(reader.front());
            assert!(if news { value > seen } else { value == seen }, "news {news}: {value} after {seen}");
            seen = value;
        }
        writing.join().unwrap();
        assert_eq!(reader.latch(), seen < 3, "the newest publication is latched once");
        assert_eq!(whole(reader.front()), 3);
    });
}

/// Pops all rows; `next` is the next expected number.
fn pop_all(reader: &mut QueueReader, mut next: u64) -> u64 {
    while let Some((number, row)) = reader.peek() {
        assert_eq!(number, next);
        assert_eq!(u64::from(whole(row)), number + 1);
        assert!(reader.pop());
        next += 1;
    }
    next
}

#[test]
fn queue_gives_every_row_in_order_and_once() {
    for depth in 1..=2 {
        model(move || {
            let (mut writer, mut reader) = queue(2, depth);
            let writing = thread::spawn(move || {
                let mut pushed = 0;
                for _ in 0..3 {
                    if writer.push(pushed, |row| row.fill(pushed as u8 + 1)).is_ok() {
                        pushed += 1;
                    }
                }
                assert!(pushed >= depth as u64, "an empty queue has room");
                pushed
            });
            let next = pop_all(&mut reader, 0);
            let next = pop_all(&mut reader, next);
            let pushed = writing.join().unwrap();
            assert_eq!(pop_all(&mut reader, next), pushed);
        });
    }
}

/// One byte more than a word, so that a row is more than one store.
const ROW_LEN: usize = 9;

#[test]
fn rows_are_never_torn_and_the_newest_never_goes_back() {
    model(|| {
        let (mut writer, reader) = rows(ROW_LEN, 2);
        let writing = thread::spawn(move || {
            for number in 0..3 {
                writer.write(number, 0, |sink| sink.put(&[number as u8 + 1; ROW_LEN]));
            }
        });
        if let Some(row) = reader.newest() {
            assert_eq!(row.number, row.sequence);
            assert_eq!(u64::from(whole(&row.bytes)), row.number + 1);
            let again = reader.newest().expect("there was a row");
            assert!(again.sequence >= row.sequence);
        }
        writing.join().unwrap();
        assert_eq!(reader.newest().map(|row| (row.sequence, whole(&row.bytes))), Some((2, 3)));
    });
}

#[test]
fn rows_since_a_sequence_are_read_or_counted_as_lost() {
    model(|| {
        let (mut writer, reader) = rows(ROW_LEN, 2);
        writer.write(0, 0, |sink| sink.put(&[1; ROW_LEN]));
        let writing = thread::spawn(move || {
            for number in 1..3 {
                writer.write(number, 0, |sink| sink.put(&[number as u8 + 1; ROW_LEN]));
            }
        });
        let mut rows = Vec::new();
        let mut lost = reader.since(0, &mut rows);
        writing.join().unwrap();
        lost += reader.since(rows.len() as u64 + lost, &mut rows);
        assert_eq!(rows.len() as u64 + lost, 3, "each row is accounted for once");
        for row in &rows {
            assert_eq!(u64::from(whole(&row.bytes)), row.number + 1);
        }
        assert!(rows.is_sorted_by(|a, b| a.sequence < b.sequence));
    });
}
