// SPDX-License-Identifier: Apache-2.0
//! Tests of the protocol between hosts in simulated time: the guarantees of both sides hold whatever the network does.
use crate::inbound::Inbound;
use crate::outbound::{Outbound, Packets};
use interconnect::Header;
use interconnect::message::packet::{Packet, Repr};
use proptest::prelude::*;
use std::collections::BTreeMap;

const MS: i64 = 1_000_000;
const CONNECTION: u64 = u64::MAX - 3;
const DEPTH: usize = 3;
const WINDOW: usize = 16;

/// Both sides and the packets in transit between them.
struct Way {
    outbound: Outbound,
    inbound: Inbound,
    now_ns: i64,
    flying: BTreeMap<(i64, u64), (bool, Vec<u8>)>,
    sent: u64,
    random: u64,
    /// Mean number of packets per faulty one, which is lost, repeated or corrupted; 0 disables faults.
    one_in: u64,
    /// True if every packet is lost.
    cut: bool,
    groups: Vec<u64>,
    rows: Vec<u64>,
}

impl Way {
    fn new(seed: u64, one_in: u64) -> Self {
        let inbound = Inbound::new(CONNECTION, 8, Some(8), WINDOW);
        let (flying, groups, rows) = (BTreeMap::new(), Vec::new(), Vec::new());
        Way { outbound: Outbound::new(CONNECTION, DEPTH, WINDOW), inbound, now_ns: 0, flying, sent: 0, random: seed, one_in, cut: false, groups, rows }
    }

    fn draw(&mut self) -> u64 {
        self.random = self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.random >> 33
    }

    fn unlucky(&mut self) -> bool {
        self.one_in > 0 && self.draw().is_multiple_of(self.one_in)
    }

    fn fly(&mut self, to_reader: bool, packets: Packets) {
        for packet in packets {
            if self.cut || self.unlucky() {
                continue;
            }
            let copies = 1 + usize::from(self.unlucky());
            for _ in 0..copies {
                let mut packet = packet.clone();
                if self.unlucky() {
                    let bit = self.draw() as usize % (packet.len() * 8);
                    packet[bit / 8] ^= 1 << (bit % 8);
                }
                // Each packet takes up to 3 ms of its own, so packets overtake each other.
                let at_ns = self.now_ns + self.draw() as i64 % (3 * MS);
                self.sent += 1;
                self.flying.insert((at_ns, self.sent), (to_reader, packet));
            }
        }
    }

    fn write(&mut self, value: u64) {
        let mut out = Packets::new();
        self.outbound.publish(Header { number: value, time_ns: self.now_ns }, &value.to_le_bytes(), self.now_ns, &mut out);
        self.fly(true, out);
    }

    fn push(&mut self, value: u64) -> bool {
        let mut out = Packets::new();
        if !self.outbound.has_room() {
            return false;
        }
        self.outbound.push(value, value.to_le_bytes().to_vec(), self.now_ns, &mut out);
        self.fly(true, out);
        true
    }

    /// Advances by one millisecond: packets arrive, and the reader pops them; every fifth step also does the work that is due.
    fn step(&mut self) {
        self.now_ns += MS;
        while let Some(entry) = self.flying.first_entry().filter(|entry| entry.key().0 <= self.now_ns) {
            let (to_reader, packet) = entry.remove();
            let Ok(repr) = Packet::new_checked(&packet).and_then(Repr::parse) else { continue };
            let mut out = Packets::new();
            if to_reader {
                if let Some((header, group)) = self.inbound.came(repr.content, &mut out) {
                    assert_eq!(group, header.number.to_le_bytes(), "no group is damaged or mixed");
                    self.groups.push(header.number);
                }
            } else {
                self.outbound.came(repr.content, self.now_ns, &mut out);
            }
            self.fly(!to_reader, out);
        }
        while let Some((number, row)) = self.inbound.take() {
            assert_eq!(row, number.to_le_bytes(), "no row is damaged");
            self.rows.push(number);
        }
        self.inbound.popped(self.rows.len() as u64);
        if self.now_ns % (5 * MS) == 0 {
            let (mut there, mut back) = (Packets::new(), Packets::new());
            self.outbound.tick(self.now_ns, &mut there);
            self.inbound.tick(self.now_ns, &mut back);
            self.fly(true, there);
            self.fly(false, back);
        }
    }

    /// Steps until everything is acknowledged, or for at most 20 s.
    fn settle(&mut self) {
        for _ in 0..20_000 {
            if self.outbound.is_idle() && self.flying.is_empty() {
                return;
            }
            self.step();
        }
        panic!("it does not come to rest");
    }
}

proptest! {
    #[test]
    fn groups_never_go_back_and_rows_come_in_order_each_once(
        seed: u64,
        one_in in 3u64..12,
        calls in prop::collection::vec((any::<bool>(), 0u8..8), 1..150),
    ) {
        let mut way = Way::new(seed, one_in);
        let (mut written, mut pushed) = (0, 0);
        for (row, pause) in calls {
            if row {
                pushed += u64::from(way.push(pushed));
            } else {
                written += 1;
                way.write(written);
            }
            (0..pause).for_each(|_| way.step());
        }
        way.settle();
        prop_assert!(way.groups.is_sorted_by(|earlier, later| earlier < later), "{:?}", way.groups);
        prop_assert_eq!(way.groups.last().copied().unwrap_or(0), written);
        prop_assert_eq!(way.rows, (0..pushed).collect::<Vec<_>>());
    }

    #[test]
    fn a_partition_of_any_length_heals_by_itself(seed: u64, partition_ms in 1u64..30_000) {
        let mut way = Way::new(seed, 0);
        prop_assert!(way.push(0));
        way.write(1);
        way.settle();
        way.cut = true;
        let mut pushed = 1;
        for ms in 0..partition_ms {
            way.write(2 + ms);
            pushed += u64::from(way.push(pushed));
            way.step();
        }
        prop_assert!(pushed <= 1 + WINDOW as u64, "a writer that gets no answer is told that there is no room");
        prop_assert_eq!(way.groups.last(), Some(&1));
        way.cut = false;
        let healed_ns = way.now_ns;
        way.settle();
        prop_assert_eq!(way.groups.last(), Some(&(1 + partition_ms)), "the newest group");
        prop_assert_eq!(&way.rows, &(0..pushed).collect::<Vec<_>>());
        prop_assert!(way.now_ns - healed_ns < 1_000 * MS);
    }
}

#[test]
fn a_way_without_faults_carries_nothing_twice() {
    let mut way = Way::new(1, 0);
    for value in 1..=100 {
        way.write(value);
        assert!(way.push(value - 1));
        (0..10).for_each(|_| way.step());
    }
    way.settle();
    assert_eq!((way.groups.len(), way.rows.len()), (100, 100));
    // The packets are group, row, their answers, the room and its answer, plus the reader's initial requests.
    assert!(way.sent <= 100 * 6 + 4, "{} packets", way.sent);
}

#[test]
fn a_reader_that_comes_later_finds_the_newest_group() {
    let mut way = Way::new(1, 0);
    way.cut = true;
    (1..=5).for_each(|value| way.write(value));
    (0..10_000).for_each(|_| way.step());
    way.cut = false;
    way.inbound = Inbound::new(CONNECTION, 8, Some(8), WINDOW);
    // The reader requests at once, and again after 50 ms if the writer's reply was lost.
    (0..70).for_each(|_| way.step());
    assert_eq!(way.groups, [5]);
}

#[test]
fn rows_that_were_lost_are_sent_again_while_groups_go_on() {
    let mut way = Way::new(1, 0);
    way.cut = true;
    (0..WINDOW as u64).for_each(|row| assert!(way.push(row)));
    way.cut = false;
    for value in 1..=200 {
        way.write(value);
        way.step();
    }
    assert_eq!(way.rows, (0..WINDOW as u64).collect::<Vec<_>>());
}

#[test]
fn a_stranger_cannot_make_a_reader_keep_more_than_a_window() {
    let mut inbound = Inbound::new(1, 0, None, WINDOW);
    for sequence in (1..1_000).rev() {
        let content = interconnect::message::packet::Content::Row { sequence, number: 0, bytes: &[0; 100] };
        assert_eq!(inbound.came(content, &mut Packets::new()), None);
    }
    let content = interconnect::message::packet::Content::Row { sequence: 0, number: 0, bytes: &[0; 100] };
    inbound.came(content, &mut Packets::new());
    let kept = std::iter::from_fn(|| inbound.take()).count();
    assert_eq!(kept, WINDOW);
}
