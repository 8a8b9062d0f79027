// SPDX-License-Identifier: Apache-2.0
//! Unauthenticated connections by origin, and the rule by which they give way if there are too many.
//!
//! Slots are shared fairly between addresses: as long as there are fewer addresses than slots, the only connection from an address does
//! not give way to another address. Clients that connect from hundreds of addresses, silently or with unfinished handshakes, therefore
//! cannot interrupt the handshake of a panel.
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt;
use std::net::{IpAddr, Ipv6Addr};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::Notify;
use tokio::time::Instant;

/// Maximum number of unauthenticated connections; fewer if the descriptor limit is low.
pub(crate) const STRANGERS_MAX: usize = 1024;
/// Maximum number of strangers from one address.
pub(crate) const STRANGERS_EACH_MAX: usize = 128;
/// Time for which a handshake keeps its slot against all newcomers: several round trips of a slow network, plus a margin for a busy
/// machine.
pub(crate) const HANDSHAKE_MAX: Duration = Duration::from_secs(2);
/// Time limit of a stranger for its TLS handshake and first request header, and between two request headers.
pub(crate) const STRANGER_MAX: Duration = Duration::from_secs(5);

/// Origin of an unauthenticated connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Origin {
    /// The Unix socket.
    Socket,
    /// An address; for IPv6 its network, because one machine can use any number of addresses in it.
    Network(IpAddr),
}

impl From<IpAddr> for Origin {
    fn from(from: IpAddr) -> Origin {
        Origin::Network(match from.to_canonical() {
            IpAddr::V6(address) => IpAddr::V6(Ipv6Addr::from_bits(address.to_bits() & (u128::MAX << 64))),
            four => four,
        })
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Origin::Socket => f.write_str("the Unix socket"),
            Origin::Network(address) => address.fmt(f),
        }
    }
}

/// A connection that has not been authenticated yet.
#[derive(Debug)]
pub(crate) struct Stranger {
    pub origin: Origin,
    pub until: Instant,
    /// Time at which the client first sent data (a handshake or a request header).
    spoke: Option<Instant>,
    pub end: Arc<Notify>,
}

impl Stranger {
    pub fn new(origin: Origin, end: Arc<Notify>) -> Stranger {
        Stranger { origin, until: Instant::now() + STRANGER_MAX, spoke: None, end }
    }

    fn is_late(&self) -> bool {
        self.spoke.is_some_and(|since| since.elapsed() >= HANDSHAKE_MAX)
    }
}

/// Connections of one origin, by number.
#[derive(Debug, Default)]
struct Crowd {
    silent: BTreeSet<u64>,
    speaking: BTreeSet<u64>,
}

/// Size of a crowd, its oldest connection, and its origin. The largest crowd sorts last; among crowds of equal size, the one with the
/// oldest connection.
type Rank = (usize, Reverse<u64>, Origin);

impl Crowd {
    fn size(&self) -> usize {
        self.silent.len() + self.speaking.len()
    }

    fn oldest(&self) -> Option<u64> {
        self.silent.first().into_iter().chain(self.speaking.first()).min().copied()
    }

    fn rank(&self, origin: Origin) -> Option<Rank> {
        self.oldest().map(|oldest| (self.size(), Reverse(oldest), origin))
    }
}

/// Result of admitting a stranger.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Admission {
    Free,
    /// The connection with this number gives way to the new one.
    InPlaceOf(u64),
    /// The new connection is refused because all others are in the middle of a handshake; the client may retry.
    Refused,
}

/// Strangers by number, oldest first.
#[derive(Debug)]
pub(crate) struct Strangers {
    most: usize,
    held: BTreeMap<u64, Stranger>,
    crowds: HashMap<Origin, Crowd>,
    /// Ranks of all crowds; `silent_ranks` contains only those of crowds that have silent connections.
    ranks: BTreeSet<Rank>,
    silent_ranks: BTreeSet<Rank>,
}

impl Strangers {
    /// Creates `most` slots.
    pub fn new(most: usize) -> Strangers {
        Strangers { most, held: BTreeMap::new(), crowds: HashMap::new(), ranks: BTreeSet::new(), silent_ranks: BTreeSet::new() }
    }

    /// Applies a change to the crowd of an origin and updates its ranks.
    fn change(&mut self, origin: Origin, change: impl FnOnce(&mut Crowd)) {
        let crowd = self.crowds.entry(origin).or_default();
        if let Some(rank) = crowd.rank(origin) {
            self.ranks.remove(&rank);
            self.silent_ranks.remove(&rank);
        }
        change(crowd);
        match crowd.rank(origin) {
            Some(rank) => {
                self.ranks.insert(rank);
                if !crowd.silent.is_empty() {
                    self.silent_ranks.insert(rank);
                }
            }
            None => {
                self.crowds.remove(&origin);
            }
        }
    }

    pub fn insert(&mut self, number: u64, stranger: Stranger) {
        self.change(stranger.origin, |crowd| {
            crowd.silent.insert(number);
        });
        self.held.insert(number, stranger);
    }

    pub fn remove(&mut self, number: u64) -> Option<Stranger> {
        let stranger = self.held.remove(&number)?;
        self.change(stranger.origin, |crowd| {
            crowd.silent.remove(&number);
            crowd.speaking.remove(&number);
        });
        Some(stranger)
    }

    /// Records that a stranger has sent data.
    pub fn spoke(&mut self, number: u64) {
        let Some(stranger) = self.held.get_mut(&number).filter(|stranger| stranger.spoke.is_none()) else { return };
        stranger.spoke = Some(Instant::now());
        let origin = stranger.origin;
        self.change(origin, |crowd| {
            crowd.silent.remove(&number);
            crowd.speaking.insert(number);
        });
    }

    pub fn get_mut(&mut self, number: u64) -> Option<&mut Stranger> {
        self.held.get_mut(&number)
    }

    pub fn get(&self, number: u64) -> Option<&Stranger> {
        self.held.get(&number)
    }

    /// Admits one more stranger from an origin. If its address has too many, the oldest connection of that address gives way. If there
    /// are too many in total, a connection of the largest crowd gives way, silent connections first, provided that this crowd would still
    /// be larger than the new connection's. If no address has more connections, the new one's address already has its share, and only its
    /// own connections give way. If every connection is the only one of its address, the oldest that is silent, or whose handshake takes
    /// too long, gives way.
    pub fn admit(&self, origin: Origin) -> Admission {
        let own = self.crowds.get(&origin);
        let size = own.map_or(0, Crowd::size);
        let gives_way = if size >= STRANGERS_EACH_MAX {
            own.and_then(|own| self.idle_of(own).or(own.oldest()))
        } else if self.held.len() < self.most {
            return Admission::Free;
        } else {
            let has_more = |ranks: &BTreeSet<Rank>| ranks.last().filter(|(crowd, ..)| *crowd > size + 1).and_then(|(.., of)| self.crowds.get(of));
            let silent = has_more(&self.silent_ranks).and_then(|crowd| crowd.silent.first().copied());
            silent.or_else(|| has_more(&self.ranks).and_then(Crowd::oldest)).or_else(|| own.map_or_else(|| self.idle(), |own| self.idle_of(own)))
        };
        gives_way.map_or(Admission::Refused, Admission::InPlaceOf)
    }

    /// Returns a connection of a crowd that is silent, or else one whose handshake takes too long.
    fn idle_of(&self, crowd: &Crowd) -> Option<u64> {
        let late = || crowd.speaking.iter().find(|number| self.held.get(number).is_some_and(Stranger::is_late));
        crowd.silent.first().or_else(late).copied()
    }

    /// Returns a connection of any crowd that is silent, or else one whose handshake takes too long.
    fn idle(&self) -> Option<u64> {
        let silent = self.silent_ranks.last().and_then(|(.., of)| self.crowds.get(of)?.silent.first().copied());
        silent.or_else(|| self.held.iter().find(|(_, stranger)| stranger.is_late()).map(|(number, _)| *number))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn origin(number: u16) -> Origin {
        IpAddr::from([10, 1, (number >> 8) as u8, number as u8]).into()
    }

    /// Admits one more stranger, as a listener does. Returns the number of the connection if it was admitted.
    fn enter(strangers: &mut Strangers, number: u64, from: Origin, speaks: bool) -> Option<u64> {
        match strangers.admit(from) {
            Admission::Free => {}
            Admission::InPlaceOf(other) => drop(strangers.remove(other).expect("it is there")),
            Admission::Refused => return None,
        }
        strangers.insert(number, Stranger::new(from, Arc::default()));
        if speaks {
            strangers.spoke(number);
        }
        Some(number)
    }

    #[test]
    fn addresses_of_one_network_of_ipv6_are_one() {
        let of = |last: u16| IpAddr::from([0x2001, 0xdb8, 0, 1, 0, 0, 0, last]);
        assert_eq!(Origin::from(of(1)), Origin::from(of(2)));
        assert_ne!(Origin::from(of(1)), Origin::from(IpAddr::from([0x2001, 0xdb8, 0, 2, 0, 0, 0, 1])));
        let four = IpAddr::from([10, 0, 0, 1]);
        assert_eq!(Origin::from(IpAddr::from([0, 0, 0, 0, 0, 0xffff, 0x0a00, 1])), Origin::from(four), "one of IPv4, as a socket of IPv6 says it");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Checks that, if there are fewer addresses than slots, the only connection of an address never loses its slot to another
        /// address, whether it is silent or not.
        #[test]
        fn one_connection_of_an_address_keeps_its_slot(
            knocks in proptest::collection::vec((0_u16..15, any::<bool>(), 0_u64..3000), 0..400), before in 0_usize..40, speaks: bool,
        ) {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build().expect("a runtime");
            runtime.block_on(async {
                let mut strangers = Strangers::new(16);
                let panel = 1_000_000;
                for (number, (from, speaks_too, pause_ms)) in knocks.iter().enumerate() {
                    if number == before {
                        prop_assert_eq!(enter(&mut strangers, panel, origin(100), speaks), Some(panel));
                    }
                    tokio::time::advance(Duration::from_millis(*pause_ms)).await;
                    enter(&mut strangers, number as u64, origin(*from), *speaks_too);
                    prop_assert!(strangers.held.len() <= 16);
                    prop_assert!(number < before || strangers.get(panel).is_some(), "knock {}", number);
                    let counted: usize = strangers.ranks.iter().map(|(size, ..)| size).sum();
                    prop_assert_eq!(counted, strangers.held.len());
                }
                Ok(())
            })?;
        }
    }

    #[tokio::test(start_paused = true)]
    async fn addresses_without_end_end_no_handshake_that_is_going_on() {
        let mut strangers = Strangers::new(STRANGERS_MAX);
        (0..STRANGERS_MAX as u64).for_each(|number| assert!(enter(&mut strangers, number, origin(number as u16), true).is_some()));
        assert_eq!(enter(&mut strangers, 5000, origin(5000), false), None, "who comes while all slots are in use comes again");
        tokio::time::advance(HANDSHAKE_MAX).await;
        assert_eq!(strangers.admit(origin(5000)), Admission::InPlaceOf(0), "a handshake that lasts too long gives way");
        strangers.remove(7);
        strangers.insert(7000, Stranger::new(origin(7), Arc::default()));
        assert_eq!(strangers.admit(origin(5000)), Admission::InPlaceOf(7000), "one that says nothing gives way before it");
    }
}
