// SPDX-License-Identifier: Apache-2.0
//! Slots of connections. A client that has not said who it is has a slot for a short time, and gives way to the next that
//! comes; a client that is known keeps its slot. So a client without a token cannot keep out one that has a token: those that say nothing
//! give way before those whose handshake is going on, and addresses from which callers have been let in have slots apart.
use api::Role;
use daemon::Failure;
use daemon::{Caller, Gate, Pass};
use model::refusal::Class;
use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::net::{IpAddr, Ipv6Addr};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;
use tokio::sync::Notify;
use tokio::time::Instant;

/// Connections that have not authenticated yet.
pub(crate) const STRANGERS_MAX: usize = 256;
/// Maximum of strangers from one address.
pub(crate) const STRANGERS_EACH_MAX: usize = 128;
/// Time for which a handshake that is going on keeps its slot against all newcomers: some round trips of a slow network, and what a busy machine
/// needs.
pub(crate) const HANDSHAKE_MAX: Duration = Duration::from_secs(2);
/// Addresses from which callers have been let in: strangers from there have as many slots, apart from all others.
const REMEMBERED_MAX: usize = 256;
/// Time limit of a stranger for its TLS handshake and its first head, and after each head until the next.
pub(crate) const STRANGER_MAX: Duration = Duration::from_secs(5);
/// Connections of callers who are known.
pub(crate) const KNOWN_MAX: usize = 256;
/// Maximum of known connections of one caller.
pub(crate) const KNOWN_EACH_MAX: usize = 64;
/// Number of slots of the known that are kept for roles that may command and stop.
pub(crate) const RESERVED: usize = 64;
/// Number of further slots for requests that stop, of one caller and of all.
const STOPS: usize = 16;

/// Origins of connections that gave way which are told one by one.
const ORIGINS_MAX: usize = 64;

/// The caller of a connection.
#[derive(Debug)]
enum CallerStanding {
    /// `spoke`: since when it has sent something, a handshake or a head.
    Stranger { until: Instant, spoke: Option<Instant> },
    /// `doubted`: the caller was let in no longer when it was looked last.
    Known { caller: Caller, pass: Pass, doubted: bool },
}

/// Origin of strangers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Origin {
    /// The Unix socket.
    Socket,
    /// An address; of IPv6 its network: one machine has as many addresses there as it likes.
    Network(IpAddr),
}

#[derive(Debug)]
struct ConnectionSlot {
    origin: Origin,
    standing: CallerStanding,
    end: Arc<Notify>,
}

/// The connections, oldest first.
#[derive(Debug, Default)]
struct Table {
    next: u64,
    held: BTreeMap<u64, ConnectionSlot>,
    /// Where callers who were let in have come from, with when the last one was.
    remembered: HashMap<Origin, Instant>,
    /// Number of connections that gave way to others since it was told last, by origin.
    gave_way: HashMap<Origin, u64>,
}

/// The slots of both listeners: connections from the network take none of the Unix socket's.
#[derive(Clone, Debug, Default)]
pub(crate) struct Doors {
    pub socket: Arc<Slots>,
    pub network: Arc<Slots>,
}

impl Doors {
    /// Ends the connections of callers who are let in no longer, at the second look: what runs on them has had time to say so itself.
    pub fn look_again(&self, gate: &Gate) {
        [&self.socket, &self.network].into_iter().for_each(|slots| slots.look_again(gate));
    }

    /// Returns the origins that gave way since the last time, those with most first.
    pub fn gave_way(&self) -> Vec<(Origin, u64)> {
        let mut gave: Vec<_> = [&self.socket, &self.network].into_iter().flat_map(|slots| std::mem::take(&mut slots.locked().gave_way)).collect();
        gave.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        gave
    }
}

/// Slots of one listener.
#[derive(Debug, Default)]
pub(crate) struct Slots(Mutex<Table>);

/// The slot of one connection, from its being accepted to its end.
#[derive(Debug)]
pub(crate) struct Slot {
    slots: Arc<Slots>,
    number: u64,
    end: Arc<Notify>,
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

/// A stranger in the table.
#[derive(Clone, Copy)]
struct Stranger {
    number: u64,
    origin: Origin,
    spoke: Option<Instant>,
}

/// Result of admitting a stranger.
#[derive(Debug, PartialEq, Eq)]
enum Admission {
    Free,
    /// The connection of this number gives way to it.
    InPlaceOf(u64),
    /// The connection is refused: all others are in the middle of their handshakes, and it may come again.
    Refused,
}

impl Table {
    /// Strangers from remembered addresses, or those from all others, oldest first.
    fn strangers(&self, are_returning: bool) -> Vec<Stranger> {
        let of = |(number, held): (&u64, &ConnectionSlot)| match held.standing {
            CallerStanding::Stranger { spoke, .. } => Some(Stranger { number: *number, origin: held.origin, spoke }),
            CallerStanding::Known { .. } => None,
        };
        self.held.iter().filter_map(of).filter(|stranger| self.remembered.contains_key(&stranger.origin) == are_returning).collect()
    }

    /// Admits one more stranger from there. Where its address has too many, its oldest gives way; where all together are too many,
    /// first one that has sent nothing, of the address with the most of them; then one whose handshake lasts too long; then the oldest of an
    /// address that has more than this one will have.
    fn admit(&self, origin: Origin, now: Instant) -> Admission {
        let strangers = self.strangers(self.remembered.contains_key(&origin));
        let own: Vec<Stranger> = strangers.iter().copied().filter(|stranger| stranger.origin == origin).collect();
        let silent = |stranger: &Stranger| stranger.spoke.is_none();
        let late = |stranger: &Stranger| stranger.spoke.is_some_and(|since| now.duration_since(since) >= HANDSHAKE_MAX);
        let gives_way = if own.len() >= STRANGERS_EACH_MAX {
            own.iter().find(|own| silent(own)).or_else(|| own.iter().find(|own| late(own))).or(own.first()).map(|own| own.number)
        } else if strangers.len() >= STRANGERS_MAX {
            (oldest_of_most(strangers.iter().filter(|stranger| silent(stranger))).map(|(number, _)| number))
                .or_else(|| strangers.iter().find(|stranger| late(stranger)).map(|stranger| stranger.number))
                .or_else(|| oldest_of_most(strangers.iter()).filter(|(_, count)| *count > own.len() + 1).map(|(number, _)| number))
        } else {
            return Admission::Free;
        };
        gives_way.map_or(Admission::Refused, Admission::InPlaceOf)
    }

    /// Remembers an address from which a caller was let in.
    fn remember(&mut self, origin: Origin) {
        if self.remembered.len() >= REMEMBERED_MAX && !self.remembered.contains_key(&origin) {
            let oldest = self.remembered.iter().min_by_key(|(_, at)| **at).map(|(origin, _)| *origin);
            oldest.map(|oldest| self.remembered.remove(&oldest));
        }
        self.remembered.insert(origin, Instant::now());
    }

    fn count(&mut self, origin: Origin) {
        if self.gave_way.len() < ORIGINS_MAX || self.gave_way.contains_key(&origin) {
            *self.gave_way.entry(origin).or_default() += 1;
        }
    }

    /// Refuses a caller one more slot among the known. `more`: slots there are beyond the usual ones.
    fn check_known(&self, caller: &Caller, more: usize) -> Result<(), Failure> {
        let known = || self.held.values().filter_map(|held| if let CallerStanding::Known { caller, .. } = &held.standing { Some(&caller.who) } else { None });
        let own = known().filter(|who| **who == caller.who).count();
        let kept = if caller.role >= Role::Operate { 0 } else { RESERVED };
        let full = if own >= KNOWN_EACH_MAX + more {
            format!("{} has {own} connections already", caller.who)
        } else if known().count() >= KNOWN_MAX - kept + more {
            format!("there are {} connections already", known().count())
        } else {
            return Ok(());
        };
        Err(Failure::new(Class::LimitExceeded, full, "close one").again_in(1))
    }
}

/// Returns the oldest of the address that has the most of these, and how many it has.
fn oldest_of_most<'a>(strangers: impl Iterator<Item = &'a Stranger> + Clone) -> Option<(u64, usize)> {
    let mut of_each: HashMap<Origin, usize> = HashMap::new();
    strangers.clone().for_each(|stranger| *of_each.entry(stranger.origin).or_default() += 1);
    let most = of_each.values().max().copied()?;
    strangers.into_iter().find(|stranger| of_each[&stranger.origin] == most).map(|stranger| (stranger.number, most))
}

impl Slots {
    fn locked(&self) -> MutexGuard<'_, Table> {
        self.0.lock().expect("nobody panics with this lock")
    }

    /// Returns the slot of a connection that has just come: that of a stranger.
    pub fn enter(self: &Arc<Slots>, from: impl Into<Origin>) -> Arc<Slot> {
        let (origin, end, now) = (from.into(), Arc::new(Notify::new()), Instant::now());
        let mut table = self.locked();
        let number = table.next;
        table.next += 1;
        let slot = Arc::new(Slot { slots: self.clone(), number, end: end.clone() });
        match table.admit(origin, now) {
            Admission::Free => {}
            Admission::InPlaceOf(other) => {
                if let Some(held) = table.held.remove(&other) {
                    held.end.notify_one();
                    table.count(held.origin);
                }
            }
            Admission::Refused => {
                end.notify_one();
                table.count(origin);
                return slot;
            }
        }
        let standing = CallerStanding::Stranger { until: now + STRANGER_MAX, spoke: None };
        table.held.insert(number, ConnectionSlot { origin, standing, end });
        slot
    }

    fn look_again(&self, gate: &Gate) {
        for ConnectionSlot { standing, end, .. } in self.locked().held.values_mut() {
            let CallerStanding::Known { caller, pass, doubted } = standing else { continue };
            let is_out = gate.look_again(caller, pass).is_err();
            if is_out && *doubted {
                end.notify_one();
            }
            *doubted = is_out;
        }
    }
}

impl Slot {
    /// Notes that the first bytes have come: a handshake, or a request, is going on.
    pub fn spoke(&self) {
        if let Some(ConnectionSlot { standing: CallerStanding::Stranger { spoke, .. }, .. }) = self.slots.locked().held.get_mut(&self.number) {
            spoke.get_or_insert_with(Instant::now);
        }
    }

    /// Notes that a request arrived on a connection that is still not authenticated: its time begins again.
    pub fn heard(&self) {
        if let Some(ConnectionSlot { standing: CallerStanding::Stranger { until, .. }, .. }) = self.slots.locked().held.get_mut(&self.number) {
            *until = Instant::now() + STRANGER_MAX;
        }
    }

    /// Notes whose the connection is: it keeps its slot. `stops`: it carries what stops, for which there is always room.
    /// Errors: `LimitExceeded`.
    pub fn know(&self, caller: &Caller, pass: &Pass, stops: bool) -> Result<(), Failure> {
        let mut table = self.slots.locked();
        let before = table.held.get(&self.number).map(|held| &held.standing);
        if matches!(before, Some(CallerStanding::Known { caller: before, pass: by, .. }) if before == caller && by == pass) {
            return Ok(());
        }
        table.check_known(caller, if stops { STOPS } else { 0 })?;
        // One that has just given way has no slot any more, and its request ends with it.
        if let Some(held) = table.held.get_mut(&self.number) {
            let origin = held.origin;
            held.standing = CallerStanding::Known { caller: caller.clone(), pass: pass.clone(), doubted: false };
            table.remember(origin);
        }
        Ok(())
    }

    /// Returns when the connection is to end: a stranger's time is up, or another has its slot.
    pub async fn over(&self) {
        while let Some(until) = self.until() {
            if until <= Instant::now() {
                return;
            }
            tokio::select! {
                () = self.end.notified() => return,
                () = tokio::time::sleep_until(until) => {}
            }
        }
        self.end.notified().await;
    }

    /// Returns until when it may stay; without an end if it is known, or has given way and is told so.
    fn until(&self) -> Option<Instant> {
        match self.slots.locked().held.get(&self.number)?.standing {
            CallerStanding::Stranger { until, .. } => Some(until),
            CallerStanding::Known { .. } => None,
        }
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        self.slots.locked().held.remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn caller(who: &str, role: Role) -> Caller {
        Caller { who: who.to_owned(), role, from: String::new() }
    }

    fn address(last: u8) -> IpAddr {
        IpAddr::from([10, 0, 0, last])
    }

    /// Returns true if a connection is to end now.
    fn is_over(slot: &Slot) -> bool {
        let mut over = std::pin::pin!(slot.over());
        let mut context = std::task::Context::from_waker(std::task::Waker::noop());
        over.as_mut().poll(&mut context).is_ready()
    }

    #[tokio::test(start_paused = true)]
    async fn strangers_of_one_address_give_way_to_each_other_only() {
        let slots: Arc<Slots> = Arc::default();
        let other = slots.enter(address(1));
        let crowd: Vec<_> = (0..STRANGERS_EACH_MAX + 3).map(|_| slots.enter(address(2))).collect();
        assert!(crowd.iter().take(3).all(|slot| is_over(slot)), "the oldest give way");
        let doors = Doors { network: slots, ..Doors::default() };
        assert_eq!(doors.gave_way(), [(address(2).into(), 3)], "they are counted");
        assert_eq!(doors.gave_way(), [], "and told once");
        assert!(!crowd.iter().skip(3).any(|slot| is_over(slot)) && !is_over(&other));
    }

    #[tokio::test(start_paused = true)]
    async fn where_all_are_too_many_the_largest_crowd_gives_way() {
        let slots = Arc::new(Slots::default());
        let few: Vec<_> = (0..100).map(|_| slots.enter(address(1))).collect();
        let many: Vec<_> = (0..120).map(|_| slots.enter(address(2))).collect();
        let others: Vec<_> = (0..36).map(|last| slots.enter(address(100 + last))).collect();
        let newest = slots.enter(address(3));
        assert!(is_over(&many[0]) && !is_over(&many[1]) && !is_over(&newest));
        assert!(!few.iter().chain(&others).any(|slot| is_over(slot)));
    }

    /// Connections from so many addresses, one each; `speak`: with a handshake that is going on.
    fn crowd(slots: &Arc<Slots>, addresses: u16, speak: bool) -> Vec<Arc<Slot>> {
        let knock = |number: u16| {
            let slot = slots.enter(IpAddr::from([10, 1, (number >> 8) as u8, number as u8]));
            if speak {
                slot.spoke();
            }
            slot
        };
        (0..addresses).map(knock).collect()
    }

    #[tokio::test(start_paused = true)]
    async fn who_knocks_and_says_nothing_ends_no_handshake() {
        let slots = Arc::new(Slots::default());
        let _first = crowd(&slots, 500, false);
        let panel = slots.enter(address(1));
        panel.spoke();
        for _ in 0..20 {
            tokio::time::advance(Duration::from_millis(50)).await;
            drop(crowd(&slots, 500, false));
            let _others = crowd(&slots, 500, false);
            assert!(!is_over(&panel));
        }
        panel.know(&caller("token panel", Role::Operate), &Pass::Lasting, false).expect("there is room");
        assert!(!is_over(&panel));
    }

    #[tokio::test(start_paused = true)]
    async fn a_handshake_that_is_going_on_ends_only_when_it_lasts_too_long() {
        let slots = Arc::new(Slots::default());
        let speaking = crowd(&slots, STRANGERS_MAX as u16, true);
        let late = slots.enter(address(1));
        assert!(is_over(&late) && !speaking.iter().any(|slot| is_over(slot)), "who comes while all slots are in use comes again");
        tokio::time::advance(HANDSHAKE_MAX).await;
        let next = slots.enter(address(1));
        assert!(is_over(&speaking[0]) && !is_over(&speaking[1]) && !is_over(&next));
    }

    #[tokio::test(start_paused = true)]
    async fn who_has_been_let_in_before_finds_a_place_whoever_knocks() {
        let slots = Arc::new(Slots::default());
        let before = slots.enter(address(1));
        before.know(&caller("token panel", Role::Operate), &Pass::Lasting, false).expect("there is room");
        drop(before);
        let _speaking = crowd(&slots, 500, true);
        let again = slots.enter(address(1));
        assert!(!is_over(&again), "it came back");
        let _more = crowd(&slots, 500, true);
        assert!(!is_over(&again));
        let own: Vec<_> = (0..STRANGERS_EACH_MAX).map(|_| slots.enter(address(1))).collect();
        assert!(is_over(&again) && !own.iter().any(|slot| is_over(slot)), "its address has so many places and no more");
    }

    #[tokio::test(start_paused = true)]
    async fn addresses_of_one_network_of_ipv6_are_one() {
        let of = |last: u16| IpAddr::from([0x2001, 0xdb8, 0, 1, 0, 0, 0, last]);
        assert_eq!(Origin::from(of(1)), Origin::from(of(2)));
        assert_ne!(Origin::from(of(1)), Origin::from(IpAddr::from([0x2001, 0xdb8, 0, 2, 0, 0, 0, 1])));
        assert_eq!(Origin::from(IpAddr::from([0, 0, 0, 0, 0, 0xffff, 0x0a00, 1])), Origin::from(address(1)), "one of IPv4, as a socket of IPv6 says it");
    }

    #[tokio::test(start_paused = true)]
    async fn a_stranger_has_a_short_time_and_who_is_known_has_not() {
        let slots = Arc::new(Slots::default());
        let (silent, read, known) = (slots.enter(address(1)), slots.enter(address(1)), slots.enter(address(1)));
        known.know(&caller("token panel", Role::Operate), &Pass::Lasting, false).expect("there is room");
        tokio::time::advance(STRANGER_MAX - Duration::from_millis(1)).await;
        read.heard();
        assert!(!is_over(&silent));
        tokio::time::advance(Duration::from_millis(1)).await;
        assert!(is_over(&silent) && !is_over(&read) && !is_over(&known));
        tokio::time::advance(STRANGER_MAX).await;
        assert!(is_over(&read) && !is_over(&known));
    }

    #[test]
    fn there_is_always_room_for_an_emergency_stop() {
        let slots = Arc::new(Slots::default());
        let enter = |caller: &Caller, stops| {
            let slot = slots.enter(address(1));
            slot.know(caller, &Pass::Lasting, stops).map(|()| slot)
        };
        let fill = |caller: &Caller| std::iter::from_fn(|| enter(caller, false).ok()).collect::<Vec<_>>();
        let observers: Vec<_> = (0..4).map(|number| fill(&caller(&format!("token o{number}"), Role::Observe))).collect();
        assert_eq!(observers.iter().map(Vec::len).collect::<Vec<_>>(), [KNOWN_EACH_MAX, KNOWN_EACH_MAX, KNOWN_EACH_MAX, 0]);
        let panel = caller("token panel", Role::Operate);
        let own = fill(&panel);
        assert_eq!(own.len(), RESERVED, "observers do not take those of who may stop");
        let refused = enter(&panel, false).expect_err("it has too many").refusals;
        assert_eq!(refused[0].message, "token panel has 64 connections already");
        let another = caller("token panel 2", Role::Operate);
        assert!(enter(&another, false).is_err() && enter(&another, true).is_ok() && enter(&panel, true).is_ok());
    }
}
