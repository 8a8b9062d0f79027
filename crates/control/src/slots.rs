// SPDX-License-Identifier: Apache-2.0
//! Connection slots. An unauthenticated client holds a slot for a short time and gives way to new arrivals; an authenticated client keeps
//! its slot. A client without a token therefore cannot lock out one that has a token: silent connections give way before those in a
//! handshake, and addresses from which callers have been authenticated have separate slots.
use crate::strangers::{Admission, Origin, STRANGER_MAX, STRANGERS_MAX, Stranger, Strangers};
use api::Role;
use daemon::Failure;
use daemon::{Caller, Gate, Pass};
use model::refusal::Class;
use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex, MutexGuard};
use tokio::sync::Notify;
use tokio::time::Instant;

/// Maximum number of remembered addresses, that is, addresses from which callers have been authenticated. Strangers from these addresses
/// have separate slots, as many as all other strangers.
const REMEMBERED_MAX: usize = 256;
/// Maximum number of connections of authenticated callers.
pub(crate) const KNOWN_MAX: usize = 256;
/// Maximum number of authenticated connections of one caller.
pub(crate) const KNOWN_EACH_MAX: usize = 64;
/// Number of authenticated slots that are reserved for roles that may command and stop.
pub(crate) const RESERVED: usize = 64;
/// Number of additional slots for requests that stop something, per caller and in total.
const STOPS: usize = 16;

/// Maximum number of origins whose displaced connections are counted for a report.
const ORIGINS_MAX: usize = 64;

/// Connection of an authenticated caller.
#[derive(Debug)]
struct KnownClient {
    origin: Origin,
    caller: Caller,
    pass: Pass,
    /// True if the caller no longer had access at the last check.
    doubted: bool,
    end: Arc<Notify>,
}

/// Connections of a listener.
#[derive(Debug)]
struct Table {
    next: u64,
    /// Strangers from remembered addresses, whose slots are separate from those of all others.
    returning: Strangers,
    newcomers: Strangers,
    known: BTreeMap<u64, KnownClient>,
    /// Origins of authenticated callers, each with the time of the most recent authentication.
    remembered: HashMap<Origin, Instant>,
    /// Number of connections that gave way to others since the last report, by origin.
    gave_way: HashMap<Origin, u64>,
}

/// Slots of both listeners. Network connections do not use slots of the Unix socket.
#[derive(Clone, Debug, Default)]
pub(crate) struct Doors {
    pub socket: Arc<Slots>,
    pub network: Arc<Slots>,
}

impl Doors {
    /// Closes the connections of callers that have lost access. A connection is closed only at the second check, so that requests on it
    /// have had time to report the loss themselves.
    pub fn look_again(&self, gate: &Gate) {
        [&self.socket, &self.network].into_iter().for_each(|slots| slots.look_again(gate));
    }

    /// Returns the origins of connections that gave way since the last call, most frequent first.
    pub fn gave_way(&self) -> Vec<(Origin, u64)> {
        let mut gave: Vec<_> = [&self.socket, &self.network].into_iter().flat_map(|slots| std::mem::take(&mut slots.locked().gave_way)).collect();
        gave.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        gave
    }
}

/// Slots of one listener.
#[derive(Debug)]
pub(crate) struct Slots(Mutex<Table>);

/// Slot of one connection, held from its acceptance until it ends.
#[derive(Debug)]
pub(crate) struct Slot {
    slots: Arc<Slots>,
    number: u64,
    end: Arc<Notify>,
}

/// Returns the maximum number of strangers of a listener: at most half of this process's descriptor limit.
fn strangers_most() -> usize {
    let limits = std::fs::read_to_string("/proc/self/limits").unwrap_or_default();
    let of_files = limits.lines().find_map(|line| line.strip_prefix("Max open files")?.split_whitespace().next()?.parse::<usize>().ok());
    of_files.map_or(STRANGERS_MAX, |files| (files / 2).min(STRANGERS_MAX))
}

impl Table {
    fn new(strangers_most: usize) -> Table {
        let (returning, newcomers) = (Strangers::new(strangers_most), Strangers::new(strangers_most));
        let (remembered, gave_way) = (HashMap::new(), HashMap::new());
        Table { next: 0, returning, newcomers, known: BTreeMap::new(), remembered, gave_way }
    }

    /// Admits a stranger with this number. Returns false if it is refused.
    fn admit(&mut self, number: u64, stranger: Stranger) -> bool {
        let is_returning = self.remembered.contains_key(&stranger.origin);
        let strangers = if is_returning { &mut self.returning } else { &mut self.newcomers };
        let gives_way = match strangers.admit(stranger.origin) {
            Admission::Free => None,
            Admission::InPlaceOf(other) => strangers.remove(other),
            Admission::Refused => {
                self.count(stranger.origin);
                return false;
            }
        };
        strangers.insert(number, stranger);
        if let Some(other) = gives_way {
            other.end.notify_one();
            self.count(other.origin);
        }
        true
    }

    fn stranger(&self, number: u64) -> Option<&Stranger> {
        self.newcomers.get(number).or_else(|| self.returning.get(number))
    }

    fn stranger_mut(&mut self, number: u64) -> Option<&mut Stranger> {
        self.newcomers.get_mut(number).or_else(|| self.returning.get_mut(number))
    }

    fn take_stranger(&mut self, number: u64) -> Option<Stranger> {
        self.newcomers.remove(number).or_else(|| self.returning.remove(number))
    }

    /// Remembers an address from which a caller was authenticated.
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

    /// Checks that a caller may have one more authenticated slot. `more` is the number of slots beyond the usual ones.
    fn check_known(&self, caller: &Caller, more: usize) -> Result<(), Failure> {
        let (all, own) = (self.known.len(), self.known.values().filter(|known| known.caller.who == caller.who).count());
        let kept = if caller.role >= Role::Operate { 0 } else { RESERVED };
        let full = if own >= KNOWN_EACH_MAX + more {
            format!("{} already has {own} connections", caller.who)
        } else if all >= KNOWN_MAX - kept + more {
            format!("there are already {all} connections")
        } else {
            return Ok(());
        };
        Err(Failure::new(Class::LimitExceeded, full, "close one").again_in(1))
    }
}

impl Default for Slots {
    fn default() -> Slots {
        Slots(Mutex::new(Table::new(strangers_most())))
    }
}

impl Slots {
    fn locked(&self) -> MutexGuard<'_, Table> {
        self.0.lock().expect("nobody panics with this lock")
    }

    /// Returns the slot of a newly accepted connection, which starts as a stranger.
    pub fn enter(self: &Arc<Slots>, from: impl Into<Origin>) -> Arc<Slot> {
        let (origin, end) = (from.into(), Arc::new(Notify::new()));
        let mut table = self.locked();
        let number = table.next;
        table.next += 1;
        if !table.admit(number, Stranger::new(origin, end.clone())) {
            end.notify_one();
        }
        Arc::new(Slot { slots: self.clone(), number, end })
    }

    fn look_again(&self, gate: &Gate) {
        for known in self.locked().known.values_mut() {
            let is_out = gate.look_again(&known.caller, &known.pass).is_err();
            if is_out && known.doubted {
                known.end.notify_one();
            }
            known.doubted = is_out;
        }
    }
}

impl Slot {
    /// Records that the first bytes have arrived: a handshake or a request is in progress.
    pub fn spoke(&self) {
        let mut table = self.slots.locked();
        table.newcomers.spoke(self.number);
        table.returning.spoke(self.number);
    }

    /// Records that a request arrived on a connection that is still unauthenticated; this restarts its time limit.
    pub fn heard(&self) {
        if let Some(stranger) = self.slots.locked().stranger_mut(self.number) {
            stranger.until = Instant::now() + STRANGER_MAX;
        }
    }

    /// Marks the connection as authenticated, so that it keeps its slot. `stops` is true if it carries a request that stops something,
    /// for which slots are reserved. Fails with `LimitExceeded`.
    pub fn know(&self, caller: &Caller, pass: &Pass, stops: bool) -> Result<(), Failure> {
        let mut table = self.slots.locked();
        if table.known.get(&self.number).is_some_and(|before| before.caller == *caller && before.pass == *pass) {
            return Ok(());
        }
        table.check_known(caller, if stops { STOPS } else { 0 })?;
        let before = table.take_stranger(self.number).map(|stranger| (stranger.origin, stranger.end));
        let before = before.or_else(|| table.known.remove(&self.number).map(|known| (known.origin, known.end)));
        // A connection that has just given way no longer has a slot, and its request ends with it.
        if let Some((origin, end)) = before {
            table.known.insert(self.number, KnownClient { origin, caller: caller.clone(), pass: pass.clone(), doubted: false, end });
            table.remember(origin);
        }
        Ok(())
    }

    /// Waits until the connection must be closed: its time as a stranger has expired, or its slot was given to another connection.
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

    /// Returns the deadline of the connection; `None` if it is authenticated, or has given way and was notified.
    fn until(&self) -> Option<Instant> {
        self.slots.locked().stranger(self.number).map(|stranger| stranger.until)
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        let mut table = self.slots.locked();
        if table.take_stranger(self.number).is_none() {
            table.known.remove(&self.number);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strangers::STRANGERS_EACH_MAX;
    use std::net::IpAddr;
    use std::time::Duration;

    fn caller(who: &str, role: Role) -> Caller {
        Caller { who: who.to_owned(), role, from: String::new() }
    }

    fn address(last: u8) -> IpAddr {
        IpAddr::from([10, 0, 0, last])
    }

    /// Returns true if a connection must be closed now.
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
        let slots = Arc::new(Slots(Mutex::new(Table::new(256))));
        let few: Vec<_> = (0..100).map(|_| slots.enter(address(1))).collect();
        let many: Vec<_> = (0..120).map(|_| slots.enter(address(2))).collect();
        let others: Vec<_> = (0..36).map(|last| slots.enter(address(100 + last))).collect();
        let newest = slots.enter(address(3));
        assert!(is_over(&many[0]) && !is_over(&many[1]) && !is_over(&newest));
        assert!(!few.iter().chain(&others).any(|slot| is_over(slot)));
    }

    /// Opens one connection from each of `addresses` addresses, and starts a handshake on each if `speak` is true.
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
    async fn who_knocks_ends_no_handshake() {
        for speak in [false, true] {
            let slots = Arc::new(Slots::default());
            let mut crowds: Vec<_> = (0..4).map(|_| crowd(&slots, 500, speak)).collect();
            let (panel, quiet) = (slots.enter(address(1)), slots.enter(address(2)));
            panel.spoke();
            for round in 0..20 {
                tokio::time::advance(Duration::from_millis(50)).await;
                crowds[round % 4] = crowd(&slots, 500, speak);
                assert!(!is_over(&panel) && !is_over(&quiet), "round {round}, {speak}");
            }
            panel.know(&caller("token panel", Role::Operate), &Pass::Lasting, false).expect("there is room");
            assert!(!is_over(&panel));
        }
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
        assert_eq!(refused[0].message, "token panel already has 64 connections");
        let another = caller("token panel 2", Role::Operate);
        assert!(enter(&another, false).is_err() && enter(&another, true).is_ok() && enter(&panel, true).is_ok());
    }
}
