// SPDX-License-Identifier: Apache-2.0
//! Checks of the guarantees that every carrier of connections makes; the tests of each carrier run all of them with
//! [`conformance!`](crate::conformance!).
mod joined;

pub use joined::JoinedCarrier;

use crate::carrier::{Carrier, ConnectionSpec, Full, Header, Receiver, Sender};

const WRITER: u32 = 3;
const READER: u32 = 5;
const SPEC: ConnectionSpec = ConnectionSpec { writer: WRITER, reader: READER, asynchronous_len: 40, queue_row_len: 12, queue_depth: 4 };
/// Time between two releases.
pub const PERIOD_NS: i64 = 1_000_000;

/// Generates a test for each check: `$on_each`, a `fn(fn(&mut Interconnect))`, calls the check passed to it with each interconnect to be
/// tested.
#[macro_export]
macro_rules! conformance {
    ($on_each:path) => {
        $crate::conformance! { $on_each:
            a_connection_that_was_never_published_has_no_news_and_zeros
            a_group_arrives_with_its_number_and_time_once
            r049_a_reader_sees_all_of_a_publication_or_nothing_and_never_goes_back
            a_writer_that_is_gone_leaves_its_last_complete_group_and_its_rows
            rows_come_in_order_and_once
            a_reader_that_takes_nothing_makes_the_queue_full_and_room_comes_back
            each_row_raises_the_reader_once_unless_it_arrived_at_once
            a_row_can_be_read_when_its_reader_is_raised
            connections_do_not_mix
            an_end_that_is_gone_troubles_nobody
            a_connection_may_lack_a_group_or_a_queue
            groups_start_on_cache_lines
        }
    };
    ($on_each:path: $($check:ident)*) => {
        $(#[test]
        fn $check() {
            $on_each($crate::conformance::$check)
        })*
    };
}

/// A carrier under test and its time.
pub struct Interconnect {
    name: String,
    carrier: Box<dyn Carrier>,
    now_ns: i64,
    raised: Vec<u32>,
}

impl Interconnect {
    /// Creates an interconnect; `name` appears in the message of a failed check.
    pub fn new(name: &str, carrier: impl Carrier + 'static) -> Self {
        Interconnect { name: name.to_owned(), carrier: Box::new(carrier), now_ns: PERIOD_NS, raised: Vec::new() }
    }

    fn connect(&mut self, spec: &ConnectionSpec) -> (Box<dyn Sender>, Box<dyn Receiver>) {
        self.carrier.connect(spec)
    }

    /// Delivers everything due and advances to the next release.
    fn release(&mut self) {
        self.carrier.deliver(self.now_ns, &mut |source| self.raised.push(source));
        self.now_ns += PERIOD_NS;
    }

    /// Delivers everything in transit.
    fn settle(&mut self) {
        for _ in 0..10_000 {
            let Some(at_ns) = self.carrier.next_arrival() else { return };
            self.now_ns = self.now_ns.max(at_ns);
            self.carrier.deliver(self.now_ns, &mut |source| self.raised.push(source));
        }
        panic!("{}: the carrier does not come to rest", self.name);
    }

    fn publish(&self, sender: &mut dyn Sender, number: u64) {
        sender.group().fill(number as u8);
        sender.publish(number, self.now_ns);
    }

    fn push(&self, sender: &mut dyn Sender, number: u64) -> Result<(), Full> {
        sender.push(number, self.now_ns, &mut |row| row.fill(number as u8))
    }
}

/// Checks that before the first publication there is no new group, and that the group is all zeros.
pub fn a_connection_that_was_never_published_has_no_news_and_zeros(it: &mut Interconnect) {
    let (_sender, mut receiver) = it.connect(&SPEC);
    it.settle();
    assert_eq!(receiver.latch(it.now_ns), None, "{}", it.name);
    assert_eq!(receiver.group(), [0; 40]);
    assert_eq!(receiver.peek_row(), None);
    assert!(!receiver.pop_row());
    assert_eq!(receiver.rows(), 0);
}

/// Checks that a group is latched exactly once, with the writer's number and time, and remains readable until the next one.
pub fn a_group_arrives_with_its_number_and_time_once(it: &mut Interconnect) {
    let (mut sender, mut receiver) = it.connect(&SPEC);
    for number in 1..=20 {
        let time_ns = it.now_ns;
        it.publish(&mut *sender, number);
        it.settle();
        let header = receiver.latch(it.now_ns);
        assert_eq!(header, Some(Header { number, time_ns }), "{}", it.name);
        assert_eq!(header.map(|header| header.age_ns(time_ns + 7)), Some(7));
        assert_eq!(receiver.group(), [number as u8; 40]);
        assert_eq!(receiver.latch(it.now_ns), None);
        assert_eq!(receiver.group(), [number as u8; 40], "a group stays until the next");
        it.release();
    }
}

/// Checks that every latched group is complete and newer than the previous one, and that the last one is the newest.
pub fn r049_a_reader_sees_all_of_a_publication_or_nothing_and_never_goes_back(it: &mut Interconnect) {
    let (mut sender, mut receiver) = it.connect(&SPEC);
    let mut seen = 0;
    for number in 1..=200 {
        it.publish(&mut *sender, number);
        it.release();
        if let Some(header) = receiver.latch(it.now_ns) {
            assert!(header.number > seen, "{}: {} after {seen}", it.name, header.number);
            seen = header.number;
        }
        assert_eq!(receiver.group(), [seen as u8; 40], "{}: publication {seen} is torn", it.name);
    }
    it.settle();
    receiver.latch(it.now_ns);
    assert_eq!(receiver.group(), [200; 40], "{}: the newest group arrives in the end", it.name);
}

/// Checks that after the writer has disappeared, an incomplete publication is never seen but a complete one is.
pub fn a_writer_that_is_gone_leaves_its_last_complete_group_and_its_rows(it: &mut Interconnect) {
    let (mut sender, mut receiver) = it.connect(&SPEC);
    it.publish(&mut *sender, 1);
    it.publish(&mut *sender, 2);
    it.push(&mut *sender, 9).expect("there is room");
    sender.group()[..20].fill(3);
    drop(sender);
    it.settle();
    assert_eq!(receiver.latch(it.now_ns).map(|header| header.number), Some(2), "{}", it.name);
    assert_eq!(receiver.group(), [2; 40]);
    assert_eq!(receiver.peek_row(), Some((9, [9; 12].as_slice())));
}

/// Checks that every accepted row arrives in order, exactly once.
pub fn rows_come_in_order_and_once(it: &mut Interconnect) {
    let (mut sender, mut receiver) = it.connect(&SPEC);
    let (mut pushed, mut popped) = (0, 0);
    for _ in 0..300 {
        if it.push(&mut *sender, pushed).is_ok() {
            pushed += 1;
        }
        it.release();
        while let Some((number, row)) = receiver.peek_row() {
            assert_eq!((number, row), (popped, [popped as u8; 12].as_slice()), "{}", it.name);
            assert!(receiver.pop_row());
            popped += 1;
        }
    }
    it.settle();
    while receiver.pop_row() {
        popped += 1;
    }
    assert_eq!(popped, pushed, "{}", it.name);
    assert!(pushed > 100, "{}: only {pushed} rows went through", it.name);
}

/// Checks that a full queue refuses a row without calling `fill`, and that taking a row frees space for another.
pub fn a_reader_that_takes_nothing_makes_the_queue_full_and_room_comes_back(it: &mut Interconnect) {
    let (mut sender, mut receiver) = it.connect(&SPEC);
    let mut next = 0;
    for round in 0..5 {
        while it.push(&mut *sender, next).is_ok() {
            next += 1;
            it.settle();
        }
        assert_eq!(next, 4 + round, "{}: depth is 4, and one was taken a round", it.name);
        assert_eq!(receiver.rows(), 4);
        let filled = sender.push(next, it.now_ns, &mut |_| panic!("filled a row that there is no room for"));
        assert_eq!(filled, Err(Full));
        assert_eq!(receiver.peek_row(), Some((round, [round as u8; 12].as_slice())));
        assert!(receiver.pop_row());
        it.settle();
    }
}

/// Checks that rows raise the reader, and that groups do not raise a source.
pub fn each_row_raises_the_reader_once_unless_it_arrived_at_once(it: &mut Interconnect) {
    let (mut sender, mut receiver) = it.connect(&SPEC);
    let (mut pushed, mut at_once) = (0, 0);
    for number in 0..100 {
        it.publish(&mut *sender, number);
        if it.push(&mut *sender, number).is_ok() {
            pushed += 1;
            at_once += usize::from(sender.arrived());
        }
        it.release();
        while receiver.pop_row() {}
    }
    it.settle();
    assert_eq!(it.raised.len() + at_once, pushed, "{}", it.name);
    assert!(it.raised.iter().all(|source| *source == READER));
}

/// Checks that a row is readable when its reader is raised.
pub fn a_row_can_be_read_when_its_reader_is_raised(it: &mut Interconnect) {
    let (mut sender, mut receiver) = it.connect(&SPEC);
    for number in 0..50 {
        it.push(&mut *sender, number).expect("the reader has taken all rows before");
        let mut readable = sender.arrived();
        while !readable {
            let at_ns = it.carrier.next_arrival().expect("a row is on its way");
            it.carrier.deliver(at_ns, &mut |_| readable = true);
            it.now_ns = it.now_ns.max(at_ns);
        }
        assert_eq!(receiver.peek_row().map(|(number, _)| number), Some(number), "{}", it.name);
        assert!(receiver.pop_row());
        it.settle();
    }
}

/// Checks that connections between the same sources are independent.
pub fn connections_do_not_mix(it: &mut Interconnect) {
    let other = ConnectionSpec { reader: 6, asynchronous_len: 8, queue_row_len: 3, queue_depth: 2, ..SPEC };
    let (mut sender, mut receiver) = it.connect(&SPEC);
    let (mut other_sender, mut other_receiver) = it.connect(&other);
    it.publish(&mut *sender, 1);
    it.push(&mut *other_sender, 2).expect("there is room");
    it.settle();
    assert_eq!(receiver.latch(it.now_ns).map(|header| header.number), Some(1), "{}", it.name);
    assert_eq!(receiver.peek_row(), None);
    assert_eq!(other_receiver.latch(it.now_ns), None);
    assert_eq!(other_receiver.peek_row(), Some((2, [2; 3].as_slice())));
}

/// Checks that the remaining end continues, and that a new connection starts from scratch.
pub fn an_end_that_is_gone_troubles_nobody(it: &mut Interconnect) {
    let (mut sender, receiver) = it.connect(&SPEC);
    it.publish(&mut *sender, 1);
    it.push(&mut *sender, 1).expect("there is room");
    drop(receiver);
    it.publish(&mut *sender, 2);
    it.push(&mut *sender, 2).expect("there is room");
    it.settle();
    drop(sender);
    let (mut sender, mut receiver) = it.connect(&SPEC);
    it.publish(&mut *sender, 3);
    it.settle();
    assert_eq!(receiver.latch(it.now_ns).map(|header| header.number), Some(3), "{}", it.name);
    assert_eq!(receiver.rows(), 0);
}

/// Checks that a connection may have only a group, or only rows.
pub fn a_connection_may_lack_a_group_or_a_queue(it: &mut Interconnect) {
    let (mut sender, mut receiver) = it.connect(&ConnectionSpec { queue_row_len: 0, queue_depth: 0, ..SPEC });
    it.publish(&mut *sender, 1);
    it.settle();
    assert!(receiver.latch(it.now_ns).is_some(), "{}", it.name);
    assert_eq!(receiver.rows(), 0);
    assert_eq!(receiver.peek_row(), None);
    assert!(!receiver.pop_row());

    let (mut sender, mut receiver) = it.connect(&ConnectionSpec { asynchronous_len: 0, ..SPEC });
    it.push(&mut *sender, 1).expect("there is room");
    it.publish(&mut *sender, 2);
    it.settle();
    assert!(receiver.peek_row().is_some(), "{}", it.name);
    assert_eq!(receiver.latch(it.now_ns).map(|header| header.number), Some(2));
    assert!(receiver.group().is_empty());
}

/// Checks that the groups of both ends start on cache lines.
pub fn groups_start_on_cache_lines(it: &mut Interconnect) {
    let (mut sender, mut receiver) = it.connect(&SPEC);
    for number in 0..4 {
        assert_eq!(sender.group().as_ptr().addr() % 64, 0, "{}", it.name);
        it.publish(&mut *sender, number);
        it.settle();
        assert!(receiver.latch(it.now_ns).is_some());
        assert_eq!(receiver.group().as_ptr().addr() % 64, 0, "{}", it.name);
    }
}
