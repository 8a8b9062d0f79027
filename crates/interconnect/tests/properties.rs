// SPDX-License-Identifier: Apache-2.0
//! Arbitrary sequences of calls: the structures against a model, a perfect link against memory, and the guarantees of a connection under
//! any mix of faults.
#![cfg(not(loom))]
use interconnect::{Carrier, ConnectionSpec, Counters, Faults, Full, Memory, Message, Receiver, Sender, queue, rows, triple_buffer};
use proptest::prelude::*;
use std::collections::VecDeque;

/// One call on a connection.
#[derive(Clone, Debug)]
enum Call {
    Publish,
    Latch,
    Push,
    Peek,
    Pop,
    /// Time passes, ns, and due messages are delivered.
    Deliver(i64),
}

fn calls() -> impl Strategy<Value = Vec<Call>> {
    let call = prop_oneof![
        1 => Just(Call::Publish),
        1 => Just(Call::Latch),
        3 => Just(Call::Push),
        1 => Just(Call::Peek),
        2 => Just(Call::Pop),
        2 => (0..400_000i64).prop_map(Call::Deliver),
    ];
    proptest::collection::vec(call, 0..200)
}

fn faults() -> impl Strategy<Value = Faults> {
    let probability = || prop_oneof![Just(0.0), 0.0..0.5];
    let delays = prop_oneof![Just((0, 0)), (0..300_000i64, 0..300_000i64)];
    (delays, (probability(), probability(), probability(), probability()), 1..500_000i64, 1..8usize).prop_map(
        |((least, more), (drop, repeat, reorder, corrupt), retransmit_ns, window)| Faults {
            delay_ns_min: least,
            delay_ns_max: least + more,
            drop,
            repeat,
            reorder,
            corrupt,
            // A row resent every nanosecond during a delay of 100 µs produces 100,000 events but no different behaviour.
            retransmit_ns: retransmit_ns.max((least + more) / 100),
            window,
        },
    )
}

fn spec(depth: usize) -> ConnectionSpec {
    ConnectionSpec { writer: 0, reader: 1, asynchronous_len: 16, queue_row_len: 8, queue_depth: depth }
}

/// A connection, its time, and the progress of its writer.
struct Run {
    carrier: Box<dyn Carrier>,
    sender: Box<dyn Sender>,
    receiver: Box<dyn Receiver>,
    now_ns: i64,
    published: u64,
    pushed: u64,
}

impl Run {
    fn new(mut carrier: Box<dyn Carrier>, depth: usize) -> Run {
        let (sender, receiver) = carrier.connect(&spec(depth));
        Run { carrier, sender, receiver, now_ns: 0, published: 0, pushed: 0 }
    }

    /// Makes a call; returns all its observable effects.
    fn call(&mut self, call: &Call) -> String {
        match call {
            Call::Publish => {
                self.published += 1;
                self.sender.group().fill(self.published as u8);
                self.sender.publish(self.published, self.now_ns);
                String::new()
            }
            Call::Latch => format!("{:?} {:?}", self.receiver.latch(self.now_ns), self.receiver.group()),
            Call::Push => {
                let number = self.pushed;
                let pushed = self.sender.push(number, self.now_ns, &mut |row| row.copy_from_slice(&number.to_le_bytes()));
                self.pushed += u64::from(pushed.is_ok());
                format!("{pushed:?} {}", self.sender.arrived())
            }
            Call::Peek => format!("{} {:?}", self.receiver.rows(), self.receiver.peek_row()),
            Call::Pop => format!("{:?}", self.receiver.pop_row()),
            Call::Deliver(after_ns) => {
                self.now_ns += after_ns;
                let mut raised = 0;
                self.carrier.deliver(self.now_ns, &mut |_| raised += 1);
                format!("{raised} {:?}", self.carrier.next_arrival())
            }
        }
    }

    fn settle(&mut self) {
        for _ in 0..100_000 {
            let Some(at_ns) = self.carrier.next_arrival() else { return };
            self.now_ns = self.now_ns.max(at_ns);
            self.carrier.deliver(self.now_ns, &mut |_| ());
        }
        panic!("the link does not come to rest");
    }
}

proptest! {
    #[test]
    fn a_triple_buffer_holds_the_newest_publication(latches in proptest::collection::vec(any::<bool>(), 0..100)) {
        let (mut writer, mut reader) = triple_buffer(3);
        let (mut published, mut latched) = (0u8, 0u8);
        for latch in latches {
            if latch {
                prop_assert_eq!(reader.latch(), published > latched);
                latched = published;
            } else {
                published += 1;
                writer.back().fill(published);
                writer.publish();
            }
            prop_assert_eq!(reader.front(), [latched; 3]);
        }
    }

    #[test]
    fn a_queue_is_a_bounded_sequence(depth in 1..5usize, calls in calls()) {
        let (mut writer, mut reader) = queue(8, depth);
        let (mut model, mut next) = (VecDeque::new(), 0u64);
        for call in calls {
            match call {
                Call::Push => {
                    let pushed = writer.push(next, |row| row.copy_from_slice(&next.to_le_bytes()));
                    prop_assert_eq!(pushed, if model.len() < depth { Ok(()) } else { Err(Full) });
                    if pushed.is_ok() {
                        model.push_back(next);
                        next += 1;
                    }
                }
                Call::Pop => prop_assert_eq!(reader.pop(), model.pop_front().is_some()),
                _ => {
                    let bytes = model.front().map(|number| (*number, number.to_le_bytes()));
                    prop_assert_eq!(reader.peek(), bytes.as_ref().map(|(number, bytes)| (*number, bytes.as_slice())));
                }
            }
            prop_assert_eq!((writer.len(), reader.len()), (model.len(), model.len()));
        }
    }

    #[test]
    fn a_ring_keeps_the_last_rows(depth in 2..6usize, row_len in 0..30usize, written in 0..20u64, from in 0..25u64, n in 0..8usize) {
        let (mut writer, reader) = rows(row_len, depth);
        for number in 0..written {
            writer.write(number, -(number as i64), |sink| sink.put(&vec![number as u8; row_len]));
        }
        let oldest = written.saturating_sub(depth as u64);
        let sequences = |rows: &[interconnect::Row]| rows.iter().map(|row| row.sequence).collect::<Vec<_>>();
        let mut out = Vec::new();
        prop_assert_eq!(reader.since(from, &mut out), oldest.saturating_sub(from));
        prop_assert_eq!(sequences(&out), (from.max(oldest)..written).collect::<Vec<_>>());
        for row in &out {
            prop_assert_eq!((row.number, row.time_ns), (row.sequence, -(row.sequence as i64)));
            prop_assert_eq!(&row.bytes, &vec![row.number as u8; row_len]);
        }
        prop_assert_eq!(sequences(&reader.last(n)), (oldest.max(written.saturating_sub(n as u64))..written).collect::<Vec<_>>());
        prop_assert_eq!(reader.newest().map(|row| row.sequence), written.checked_sub(1));
    }

    #[test]
    fn a_perfect_link_cannot_be_told_from_memory(depth in 1..5usize, calls in calls(), seed: u64) {
        let mut memory = Run::new(Box::new(Memory), depth);
        let mut message = Run::new(Box::new(Message::new(seed, Faults::none())), depth);
        for call in calls {
            prop_assert_eq!(memory.call(&call), message.call(&call), "{:?}", call);
            prop_assert_eq!(message.carrier.next_arrival(), None);
        }
    }

    #[test]
    fn the_same_seed_and_calls_give_the_same_run(depth in 1..5usize, calls in calls(), seed: u64, faults in faults()) {
        let run = || -> (Vec<String>, Counters) {
            let link = Message::new(seed, faults);
            let mut run = Run::new(Box::new(link.clone()), depth);
            let seen = calls.iter().map(|call| run.call(call)).collect();
            run.settle();
            (seen, link.counters())
        };
        prop_assert_eq!(run(), run());
    }

    #[test]
    fn rows_come_in_order_and_once_and_the_newest_group_wins_under_any_faults(
        depth in 1..5usize, calls in calls(), seed: u64, faults in faults(),
    ) {
        let link = Message::new(seed, faults);
        let mut run = Run::new(Box::new(link.clone()), depth);
        let (mut popped, mut latched) = (0u64, 0u64);
        for call in &calls {
            match call {
                Call::Pop => {
                    let row = run.receiver.peek_row().map(|(number, row)| (number, row.to_vec()));
                    prop_assert_eq!(run.receiver.pop_row(), row.is_some());
                    if let Some(row) = row {
                        prop_assert_eq!(row, (popped, popped.to_le_bytes().to_vec()));
                        popped += 1;
                    }
                }
                Call::Latch => {
                    if let Some(header) = run.receiver.latch(run.now_ns) {
                        prop_assert!(header.number > latched, "{} after {}", header.number, latched);
                        latched = header.number;
                    }
                    prop_assert_eq!(run.receiver.group(), [latched as u8; 16]);
                }
                call => {
                    run.call(call);
                }
            }
            prop_assert!(run.receiver.rows() <= depth + faults.window);
        }
        run.settle();
        prop_assert_eq!(run.receiver.rows() as u64, run.pushed - popped, "every row has arrived");
        run.receiver.latch(run.now_ns);
        prop_assert_eq!(run.receiver.group(), [run.published as u8; 16]);
        while run.receiver.pop_row() {}
        run.settle();
        let counters = link.counters();
        prop_assert_eq!(counters.refused, counters.corrupted, "every damaged packet is found, and no other");
        prop_assert_eq!(counters.delivered + counters.refused + counters.dropped, counters.sent + counters.repeated);
        for room in 0..depth {
            run.sender.push(0, run.now_ns, &mut |_| ()).unwrap_or_else(|full| panic!("{full}: {room} of {depth}"));
            run.settle();
        }
    }
}
