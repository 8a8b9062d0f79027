// SPDX-License-Identifier: Apache-2.0
//! The two ends of a connection between hosts. Real-time threads access only memory of this process: the triple buffer and the queue of
//! `interconnect`, and the bell. The bridge and the threads that receive packets do the rest.
//!
//! | | real-time writer | bridge | real-time reader |
//! |---|---|---|---|
//! | may block another | never | never a real-time thread | never |
//! | steps | those of memory, then the bell | locks, sends, allocates | those of memory; the bell if the writer waits for space |
//! | if another is stopped or killed anywhere | continues; `Full` when the queue is full | continues | continues with the last complete group |
use crate::bell::Bell;
use crate::inbound::Inbound;
use crate::network::{Outlet, Subscription};
use crate::outbound::{Outbound, Packets};
use crate::slots::BridgeWork;
use crate::timebase::Timebase;
use interconnect::message::packet::{Packet, Repr};
use interconnect::{Carrier, ConnectionSpec, Full, Header, Memory, Receiver, Sender};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Minimum number of rows of a connection that may be in transit, in addition to the rows pending at the reader.
const WINDOW_MIN: usize = 64;
/// Time for which a dropped writing end is kept in order to deliver its last values, ns.
const LINGER_NS: i64 = 5_000_000_000;

/// Returns the number of rows of a connection that may be in transit: as many as may be pending at the reader, so that a delayed network,
/// or a delayed network thread, causes no more loss than a delayed reader. Both sides compute the same number.
fn window(spec: &ConnectionSpec) -> usize {
    if spec.queue_depth == 0 { 0 } else { spec.queue_depth.max(WINDOW_MIN) }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// State of an end, shared by its two sides in this process.
struct SharedEnd {
    /// Writing end: number of rows that may have been pushed. Reading end: number of rows popped.
    count: AtomicU64,
    /// True if the real-time end was dropped.
    gone: AtomicBool,
    /// True if the writer waits for space, so the reader rings the bell when it pops rows.
    starved: AtomicBool,
}

impl SharedEnd {
    fn new(count: u64) -> Arc<Self> {
        Arc::new(SharedEnd { count: AtomicU64::new(count), gone: AtomicBool::new(false), starved: AtomicBool::new(false) })
    }
}

/// The bridge's side of a writing end.
pub(crate) struct Writing {
    state: Mutex<WritingState>,
    shared: Arc<SharedEnd>,
    outlet: Box<dyn Outlet>,
    time: Arc<Timebase>,
    connection: u64,
}

struct WritingState {
    local: Box<dyn Receiver>,
    outbound: Outbound,
    /// Time until which the end is kept after it was dropped.
    until_ns: Option<i64>,
    /// Subscription to packets for this end, held for as long as the end exists.
    subscription: Option<Subscription>,
}

/// The real-time side of a writing end.
struct HostSender {
    local: Box<dyn Sender>,
    pushed: u64,
    shared: Arc<SharedEnd>,
    bell: Arc<Bell>,
    slot: usize,
}

pub(crate) fn writing(
    connection: u64,
    spec: &ConnectionSpec,
    outlet: Box<dyn Outlet>,
    time: Arc<Timebase>,
    bell: Arc<Bell>,
    slot: usize,
) -> (Arc<Writing>, Box<dyn Sender>) {
    let (near, far) = Memory.connect(&ConnectionSpec { queue_depth: window(spec), ..*spec });
    let outbound = Outbound::new(connection, spec.queue_depth, window(spec));
    let shared = SharedEnd::new(outbound.room_until());
    let state = Mutex::new(WritingState { local: far, outbound, until_ns: None, subscription: None });
    let served = Arc::new(Writing { state, shared: shared.clone(), outlet, time, connection });
    (served, Box::new(HostSender { local: near, pushed: 0, shared, bell, slot }))
}

impl Writing {
    pub(crate) fn subscribed(&self, subscription: Subscription) {
        locked(&self.state).subscription = Some(subscription);
    }

    /// Handles a packet from the reading end.
    pub(crate) fn came(&self, bytes: &[u8]) {
        let Some(repr) = parse(bytes, self.connection) else { return };
        self.send(|state, out| {
            if state.outbound.came(repr.content, self.time.steady_ns(), out) {
                self.shared.count.store(state.outbound.room_until(), Ordering::Release);
            }
        });
    }

    /// Creates packets from the state, and sends them after unlocking it, because their receiver may answer immediately, on this thread.
    fn send(&self, make: impl FnOnce(&mut WritingState, &mut Packets)) {
        let mut out = Packets::new();
        make(&mut locked(&self.state), &mut out);
        out.into_iter().for_each(|packet| self.outlet.send(packet));
    }
}

impl WritingState {
    /// Takes the values and rows that the real-time end has published.
    fn drain(&mut self, time: &Timebase, now_ns: i64, out: &mut Packets) {
        if let Some(header) = self.local.latch(now_ns) {
            let header = Header { time_ns: time.travelling(header.time_ns), ..header };
            self.outbound.publish(header, self.local.group(), now_ns, out);
        }
        while let Some((number, row)) = self.local.peek_row().map(|(number, row)| (number, row.to_vec())) {
            self.outbound.push(number, row, now_ns, out);
            self.local.pop_row();
        }
    }
}

impl BridgeWork for Writing {
    fn rung(&self, now_ns: i64) {
        self.send(|state, out| state.drain(&self.time, now_ns, out));
    }

    fn tick(&self, now_ns: i64) -> bool {
        let gone = self.shared.gone.load(Ordering::Acquire);
        let mut stays = true;
        self.send(|state, out| {
            state.drain(&self.time, now_ns, out);
            state.outbound.tick(now_ns, out);
            if gone {
                let until_ns = *state.until_ns.get_or_insert(now_ns + LINGER_NS);
                stays = !state.outbound.is_idle() && now_ns < until_ns;
            }
        });
        if !stays {
            // The subscription is dropped outside the lock, because a packet that is arriving may delay it.
            let subscription = locked(&self.state).subscription.take();
            drop(subscription);
        }
        stays
    }

    fn again(&self, now_ns: i64) {
        self.send(|state, out| state.outbound.again(now_ns, out));
    }

    fn is_idle(&self) -> bool {
        locked(&self.state).outbound.is_idle()
    }
}

impl Sender for HostSender {
    fn group(&mut self) -> &mut [u8] {
        self.local.group()
    }

    fn publish(&mut self, number: u64, now_ns: i64) {
        self.local.publish(number, now_ns);
        self.bell.ring(self.slot);
    }

    fn push(&mut self, number: u64, now_ns: i64, fill: &mut dyn FnMut(&mut [u8])) -> Result<(), Full> {
        if self.pushed >= self.shared.count.load(Ordering::Acquire) {
            return Err(Full);
        }
        self.local.push(number, now_ns, fill)?;
        self.pushed += 1;
        self.bell.ring(self.slot);
        Ok(())
    }

    fn arrived(&self) -> bool {
        false
    }
}

impl Drop for HostSender {
    fn drop(&mut self) {
        self.shared.gone.store(true, Ordering::Release);
        self.bell.ring(self.slot);
    }
}

/// The bridge's side of a reading end.
pub(crate) struct Reading {
    state: Mutex<ReadingState>,
    shared: Arc<SharedEnd>,
    outlet: Box<dyn Outlet>,
    raise: Box<dyn Fn() + Send + Sync>,
    time: Arc<Timebase>,
    connection: u64,
    depth: u64,
}

struct ReadingState {
    local: Box<dyn Sender>,
    inbound: Inbound,
    subscription: Option<Subscription>,
}

/// The real-time side of a reading end.
struct HostReceiver {
    local: Box<dyn Receiver>,
    popped: u64,
    shared: Arc<SharedEnd>,
    bell: Arc<Bell>,
    slot: usize,
}

pub(crate) type Raise = Box<dyn Fn() + Send + Sync>;

pub(crate) fn reading(
    connection: u64,
    spec: &ConnectionSpec,
    raise: Raise,
    outlet: Box<dyn Outlet>,
    time: Arc<Timebase>,
    bell: Arc<Bell>,
    slot: usize,
) -> (Arc<Reading>, Box<dyn Receiver>) {
    // Without a queue no row fits.
    let (far, near) = Memory.connect(&ConnectionSpec { queue_depth: spec.queue_depth + window(spec), ..*spec });
    let inbound = Inbound::new(connection, spec.asynchronous_len, Some(spec.queue_row_len), window(spec));
    let shared = SharedEnd::new(0);
    let state = Mutex::new(ReadingState { local: far, inbound, subscription: None });
    let served = Reading { state, shared: shared.clone(), outlet, raise, time, connection, depth: spec.queue_depth as u64 };
    (Arc::new(served), Box::new(HostReceiver { local: near, popped: 0, shared, bell, slot }))
}

impl Reading {
    pub(crate) fn subscribed(&self, subscription: Subscription) {
        locked(&self.state).subscription = Some(subscription);
    }

    /// Handles a packet from the writing end.
    pub(crate) fn came(&self, bytes: &[u8]) {
        let Some(repr) = parse(bytes, self.connection) else { return };
        let now_ns = self.time.steady_ns();
        let readable = self.send(|state, out| {
            if let Some((header, group)) = state.inbound.came(repr.content, out) {
                state.local.group().copy_from_slice(&group);
                state.local.publish(header.number, self.time.arrived_ns(header.time_ns, now_ns));
            }
            state.give()
        });
        (0..readable).for_each(|_| (self.raise)());
    }

    fn send<R>(&self, make: impl FnOnce(&mut ReadingState, &mut Packets) -> R) -> R {
        let mut out = Packets::new();
        let made = make(&mut locked(&self.state), &mut out);
        out.into_iter().for_each(|packet| self.outlet.send(packet));
        made
    }

    /// Checks how many rows were popped, and whether the writer is waiting for space.
    fn look(&self, state: &mut ReadingState) {
        state.inbound.popped(self.shared.count.load(Ordering::Acquire));
        let starved = self.depth > 0 && state.inbound.waiting() >= self.depth;
        if starved != self.shared.starved.swap(starved, Ordering::AcqRel) && starved {
            // This also counts rows that were popped before the reader could see that it has to ring; any that are still missed are
            // found at the next tick.
            state.inbound.popped(self.shared.count.load(Ordering::Acquire));
        }
    }
}

impl ReadingState {
    /// Passes the received rows to the real-time end; returns their number.
    fn give(&mut self) -> usize {
        let mut given = 0;
        while let Some((number, row)) = self.inbound.oldest() {
            let pushed = self.local.push(*number, 0, &mut |bytes| bytes.copy_from_slice(row));
            if pushed.is_err() {
                break;
            }
            self.inbound.take();
            given += 1;
        }
        given
    }
}

impl BridgeWork for Reading {
    fn rung(&self, now_ns: i64) {
        self.send(|state, out| {
            self.look(state);
            state.inbound.tell_room(now_ns, out);
        });
    }

    fn tick(&self, now_ns: i64) -> bool {
        if self.shared.gone.load(Ordering::Acquire) {
            // The subscription is dropped outside the lock, because a packet that is arriving may delay it.
            let subscription = locked(&self.state).subscription.take();
            drop(subscription);
            return false;
        }
        let readable = self.send(|state, out| {
            self.look(state);
            state.inbound.tick(now_ns, out);
            state.give()
        });
        (0..readable).for_each(|_| (self.raise)());
        true
    }

    fn again(&self, now_ns: i64) {
        self.send(|state, out| state.inbound.ask(now_ns, out));
    }
}

impl Receiver for HostReceiver {
    fn latch(&mut self, now_ns: i64) -> Option<Header> {
        self.local.latch(now_ns)
    }

    fn group(&self) -> &[u8] {
        self.local.group()
    }

    fn peek_row(&mut self) -> Option<(u64, &[u8])> {
        self.local.peek_row()
    }

    fn pop_row(&mut self) -> bool {
        let popped = self.local.pop_row();
        if popped {
            self.popped += 1;
            self.shared.count.store(self.popped, Ordering::Release);
            if self.shared.starved.load(Ordering::Acquire) {
                self.bell.ring(self.slot);
            }
        }
        popped
    }

    fn rows(&self) -> usize {
        self.local.rows()
    }
}

impl Drop for HostReceiver {
    fn drop(&mut self) {
        self.shared.gone.store(true, Ordering::Release);
    }
}

/// Parses a packet of this connection; returns `None` if it is corrupted or belongs to another connection.
fn parse(bytes: &[u8], connection: u64) -> Option<Repr<'_>> {
    let repr = Repr::parse(Packet::new_checked(bytes).ok()?).ok()?;
    (repr.connection == connection).then_some(repr)
}
