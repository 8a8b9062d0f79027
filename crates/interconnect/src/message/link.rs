// SPDX-License-Identifier: Apache-2.0
//! The faulty link: delays, drops, repeats, reorders and corrupts packets, as determined by a seed.
use std::collections::BTreeMap;

/// Faults of a link. Probabilities are from 0 to 1, drawn for each packet; if `drop` or `corrupt` is 1, nothing ever arrives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Faults {
    /// Minimum delay, ns.
    pub delay_ns_min: i64,
    /// Maximum delay, ns. A varying delay alone does not reorder packets; see `reorder`.
    pub delay_ns_max: i64,
    /// Probability that a packet is lost.
    pub drop: f64,
    /// Probability that a packet arrives twice.
    pub repeat: f64,
    /// Probability that a packet is held back, so that later ones overtake it.
    pub reorder: f64,
    /// Probability that one to three bits of a packet are flipped.
    pub corrupt: f64,
    /// Time without an answer after which a packet is retransmitted, ns; at least 1. Should exceed a round trip, to avoid duplicates.
    pub retransmit_ns: i64,
    /// Maximum number of rows of a connection in transit (pushed but not acknowledged), in addition to those that wait for the reader.
    pub window: usize,
}

impl Faults {
    /// Returns the faults of a perfect link: everything arrives immediately.
    pub fn none() -> Self {
        let (delay_ns_min, delay_ns_max) = (0, 0);
        Faults { delay_ns_min, delay_ns_max, drop: 0.0, repeat: 0.0, reorder: 0.0, corrupt: 0.0, retransmit_ns: 1_000_000, window: 64 }
    }

    /// Returns the faults of a link that only delays packets.
    pub fn delay(delay_ns_min: i64, delay_ns_max: i64) -> Self {
        Faults { delay_ns_min, delay_ns_max, retransmit_ns: 2 * delay_ns_max + 1, ..Faults::none() }
    }

    /// Returns the faults of a link with every kind of fault: 20 to 100 µs of delay, and one packet in ten each lost, repeated, reordered
    /// and corrupted.
    pub fn every() -> Self {
        Faults { drop: 0.1, repeat: 0.1, reorder: 0.1, corrupt: 0.1, ..Faults::delay(20_000, 100_000) }
    }

    /// Panics if a field is out of its range.
    pub(super) fn check(&self) {
        assert!(0 <= self.delay_ns_min && self.delay_ns_min <= self.delay_ns_max, "delays are 0 or more, the least first: {self:?}");
        assert!(self.retransmit_ns >= 1 && self.window >= 1, "retransmit_ns and window are 1 or more: {self:?}");
        for probability in [self.drop, self.repeat, self.reorder, self.corrupt] {
            assert!((0.0..=1.0).contains(&probability), "probabilities are from 0 to 1: {self:?}");
        }
    }
}

/// Counters of packet events.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Packets sent over the link, including retransmissions.
    pub sent: u64,
    /// Packets lost by the link.
    pub dropped: u64,
    /// Packets damaged by the link.
    pub corrupted: u64,
    /// Packets duplicated by the link.
    pub repeated: u64,
    /// Packets held back by the link.
    pub reordered: u64,
    /// Packets retransmitted by an end that received no answer.
    pub retransmitted: u64,
    /// Packets that arrived damaged and were discarded.
    pub refused: u64,
    /// Packets that arrived intact.
    pub delivered: u64,
}

/// Direction of a packet: its connection, and true if it is sent to the reading end.
pub(super) type Way = (u32, bool);

pub(super) struct Link {
    pub(super) faults: Faults,
    pub(super) counters: Counters,
    random: Random,
    /// Packets in transit, ordered by time of arrival, then by order of sending.
    flying: BTreeMap<(i64, u64), (Way, Vec<u8>)>,
    sent: u64,
    /// Earliest possible arrival of a packet that keeps its order, per direction.
    floors: BTreeMap<Way, i64>,
}

impl Link {
    pub(super) fn new(seed: u64, faults: Faults) -> Self {
        faults.check();
        let (flying, floors) = (BTreeMap::new(), BTreeMap::new());
        Link { faults, counters: Counters::default(), random: Random(seed), flying, sent: 0, floors }
    }

    /// Sends a packet at `now_ns`, subject to the faults.
    pub(super) fn send(&mut self, way: Way, now_ns: i64, packet: Vec<u8>) {
        self.counters.sent += 1;
        if self.random.chance(self.faults.drop) {
            self.counters.dropped += 1;
            return;
        }
        if self.random.chance(self.faults.repeat) {
            self.counters.repeated += 1;
            self.fly(way, now_ns, packet.clone());
        }
        self.fly(way, now_ns, packet);
    }

    /// Returns the next packet to arrive, with its time and direction; `None` if none arrives by `now_ns`.
    pub(super) fn arrival(&mut self, now_ns: i64) -> Option<(i64, Way, Vec<u8>)> {
        let entry = self.flying.first_entry().filter(|entry| entry.key().0 <= now_ns)?;
        let at_ns = entry.key().0;
        let (way, packet) = entry.remove();
        Some((at_ns, way, packet))
    }

    /// Returns the time at which the next packet arrives.
    pub(super) fn next_arrival(&self) -> Option<i64> {
        self.flying.first_key_value().map(|(&(at_ns, _), _)| at_ns)
    }

    /// Discards all packets of a connection that are in transit.
    pub(super) fn forget(&mut self, connection: u32) {
        self.flying.retain(|_, ((of, _), _)| *of != connection);
        self.floors.remove(&(connection, false));
        self.floors.remove(&(connection, true));
    }

    /// Returns true if nothing is in transit and no state of any connection is kept.
    #[cfg(test)]
    pub(super) fn is_empty(&self) -> bool {
        self.flying.is_empty() && self.floors.is_empty()
    }

    fn fly(&mut self, way: Way, now_ns: i64, mut packet: Vec<u8>) {
        let Faults { delay_ns_min, delay_ns_max, reorder, corrupt, .. } = self.faults;
        if self.random.chance(corrupt) {
            self.counters.corrupted += 1;
            self.damage(&mut packet);
        }
        let floor_ns = self.floors.get(&way).copied().unwrap_or(i64::MIN);
        let mut at_ns = floor_ns.max(now_ns + delay_ns_min + self.random.below((delay_ns_max - delay_ns_min) as u64 + 1) as i64);
        if self.random.chance(reorder) {
            self.counters.reordered += 1;
            at_ns += 1 + self.random.below(2 * delay_ns_max as u64 + 1000) as i64;
        } else {
            self.floors.insert(way, at_ns);
        }
        self.flying.insert((at_ns, self.sent), (way, packet));
        self.sent += 1;
    }

    /// Flips one to three different bits.
    fn damage(&mut self, packet: &mut [u8]) {
        let bits = packet.len() as u64 * 8;
        let first = self.random.below(bits);
        for step in 0..=self.random.below(3) {
            // Different bits, so that none is flipped back.
            let bit = ((first + step * 13) % bits) as usize;
            packet[bit / 8] ^= 1 << (bit % 8);
        }
    }
}

/// SplitMix64 (Steele, Lea, Flood 2014): one sequence per seed.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a number from 0 to `bound` − 1; the bias of the remainder does not matter here.
    fn below(&mut self, bound: u64) -> u64 {
        self.next() % bound
    }

    fn chance(&mut self, probability: f64) -> bool {
        ((self.next() >> 11) as f64) < probability * (1u64 << 53) as f64
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    const WAY: Way = (0, true);

    /// Sends 1,000 packets, 1 µs apart, and returns the arrivals (times and bytes in order of arrival) and the counters.
    fn fates(seed: u64, faults: Faults) -> (Vec<(i64, Vec<u8>)>, Counters) {
        let mut link = Link::new(seed, faults);
        for index in 0..1000i64 {
            link.send(WAY, index * 1000, index.to_le_bytes().to_vec());
        }
        let arrivals = std::iter::from_fn(|| link.arrival(i64::MAX)).map(|(at_ns, _, packet)| (at_ns, packet)).collect();
        (arrivals, link.counters)
    }

    fn indices(arrivals: &[(i64, Vec<u8>)]) -> Vec<i64> {
        arrivals.iter().map(|(_, packet)| i64::from_le_bytes(packet[..].try_into().expect("8 bytes were sent"))).collect()
    }

    #[test]
    fn a_seed_names_one_run() {
        assert_eq!(fates(1, Faults::every()), fates(1, Faults::every()));
        assert_ne!(fates(1, Faults::every()), fates(2, Faults::every()));
    }

    #[test]
    fn a_perfect_link_delivers_at_once_and_in_order() {
        let (arrivals, counters) = fates(1, Faults::none());
        assert_eq!(indices(&arrivals), (0..1000).collect::<Vec<_>>());
        assert!(arrivals.iter().zip(0..).all(|((at_ns, _), index)| *at_ns == index * 1000));
        assert_eq!(counters, Counters { sent: 1000, ..Counters::default() });
    }

    #[test]
    fn a_delay_is_in_its_range_and_keeps_the_order() {
        let (arrivals, _) = fates(1, Faults::delay(500, 5000));
        assert_eq!(indices(&arrivals), (0..1000).collect::<Vec<_>>());
        let delays: Vec<i64> = arrivals.iter().zip(0..).map(|((at_ns, _), index)| at_ns - index * 1000).collect();
        assert!(delays.iter().all(|delay| (500..=5000).contains(delay)));
        assert!(delays.iter().any(|delay| *delay != delays[0]));
    }

    #[test]
    fn each_fault_does_what_it_says() {
        let (arrivals, counters) = fates(1, Faults { drop: 0.3, ..Faults::none() });
        assert!((200..400).contains(&counters.dropped));
        assert_eq!(arrivals.len() as u64, 1000 - counters.dropped);

        let (arrivals, counters) = fates(1, Faults { repeat: 0.3, ..Faults::none() });
        assert!((200..400).contains(&counters.repeated));
        assert_eq!(arrivals.len() as u64, 1000 + counters.repeated);

        let (arrivals, counters) = fates(1, Faults { reorder: 0.3, ..Faults::delay(5000, 5000) });
        assert!((200..400).contains(&counters.reordered));
        assert!(!indices(&arrivals).is_sorted());

        let (arrivals, counters) = fates(1, Faults { corrupt: 0.3, ..Faults::none() });
        assert!((200..400).contains(&counters.corrupted));
        let damaged = indices(&arrivals).iter().zip(0..).filter(|(got, sent)| **got != *sent).count();
        assert_eq!(damaged as u64, counters.corrupted);
    }
}
