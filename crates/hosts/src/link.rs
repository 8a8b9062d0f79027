// SPDX-License-Identifier: Apache-2.0
//! The link between a supervisor and a processor on another host: the row protocol, once in each direction. A frame is sent in parts, so
//! that no part is too large for the queues on the path, and values never wait behind a code module.
use crate::inbound::Inbound;
use crate::network::{Outlet, Subscription};
use crate::outbound::{Outbound, Packets};
use crate::slots::BridgeWork;
use crate::timebase::Timebase;
use interconnect::message::packet::{Packet, Repr};
use interconnect::{Link, LinkClosed};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Size of a frame part, bytes.
const PART_BYTES: usize = 16 * 1024;
/// Maximum number of parts in transit: the capacity of the wire's queues.
const WINDOW: usize = 32;
/// Maximum number of parts that may be waiting for the program to receive them.
const DEPTH: usize = 1024;
/// Maximum size of a frame. Limits the memory that a peer can occupy with a frame that never ends.
const FRAME_BYTES_MAX: usize = 1 << 28;
/// Time for which a dropped link is kept in order to deliver its last frames, ns.
const LINGER_NS: i64 = 5_000_000_000;

/// Flag: more parts of the frame follow.
const MORE: u8 = 0;
/// Flag: this is the last part of the frame.
const LAST: u8 = 1;
/// Flag: no more frames follow.
const CLOSES: u8 = 2;

/// One side of a link.
pub(crate) struct LinkState {
    number: u64,
    /// Number of the host on the other side.
    host: u64,
    time: Arc<Timebase>,
    outlets: Outlets,
    out: Mutex<Outbox>,
    room: Condvar,
    inbox: Mutex<Inbox>,
    arrived: Condvar,
    /// True if nothing more can be sent: either side has closed the link, or the other host has left.
    closed: AtomicBool,
    /// True if the other host has left.
    lost: AtomicBool,
    /// True if this side was dropped.
    dropped: AtomicBool,
    /// Serializes senders, so that one frame is sent at a time.
    sending: Mutex<()>,
}

/// Outlets for this side's parts, and for its answers to the other side's parts.
pub(crate) struct Outlets {
    pub(crate) parts: Box<dyn Outlet>,
    pub(crate) answers: Box<dyn Outlet>,
}

struct Outbox {
    outbound: Outbound,
    until_ns: Option<i64>,
    subscriptions: Vec<Subscription>,
}

struct Inbox {
    inbound: Inbound,
    parts: VecDeque<Vec<u8>>,
    frame: Vec<u8>,
    /// Number of parts that the program has taken.
    taken: u64,
    /// True if the closing part was received.
    ended: bool,
}

impl LinkState {
    pub(crate) fn new(number: u64, host: u64, outlets: Outlets, time: Arc<Timebase>) -> Self {
        let outbound = Outbound::new(number, DEPTH, WINDOW);
        let inbound = Inbound::new(number, 0, None, WINDOW);
        LinkState {
            number,
            host,
            time,
            outlets,
            out: Mutex::new(Outbox { outbound, until_ns: None, subscriptions: Vec::new() }),
            room: Condvar::new(),
            inbox: Mutex::new(Inbox { inbound, parts: VecDeque::new(), frame: Vec::new(), taken: 0, ended: false }),
            arrived: Condvar::new(),
            closed: AtomicBool::new(false),
            lost: AtomicBool::new(false),
            dropped: AtomicBool::new(false),
            sending: Mutex::new(()),
        }
    }

    pub(crate) fn subscribed(&self, subscriptions: Vec<Subscription>) {
        self.outbox().subscriptions = subscriptions;
    }

    /// Handles a part from the other side.
    pub(crate) fn part_came(&self, bytes: &[u8]) {
        let Some(repr) = self.parse(bytes) else { return };
        let mut out = Packets::new();
        {
            let mut inbox = self.inbox();
            inbox.inbound.came(repr.content, &mut out);
            while let Some((_, part)) = inbox.inbound.take() {
                if part.first() == Some(&CLOSES) {
                    self.shut();
                }
                inbox.parts.push_back(part);
            }
        }
        self.arrived.notify_all();
        self.answer(out);
    }

    /// Handles an answer from the other side.
    pub(crate) fn answer_came(&self, bytes: &[u8]) {
        let Some(repr) = self.parse(bytes) else { return };
        let now_ns = self.time.steady_ns();
        if self.post(|outbound, out| outbound.came(repr.content, now_ns, out)) {
            self.room.notify_all();
        }
    }

    fn parse<'a>(&self, bytes: &'a [u8]) -> Option<Repr<'a>> {
        let repr = Repr::parse(Packet::new_checked(bytes).ok()?).ok()?;
        (repr.connection == self.number).then_some(repr)
    }

    /// Lets the writing side create packets, and sends them after unlocking it.
    fn post<R>(&self, make: impl FnOnce(&mut Outbound, &mut Packets) -> R) -> R {
        let mut out = Packets::new();
        let made = make(&mut self.outbox().outbound, &mut out);
        out.into_iter().for_each(|packet| self.outlets.parts.send(packet));
        made
    }

    fn answer(&self, packets: Packets) {
        packets.into_iter().for_each(|packet| self.outlets.answers.send(packet));
    }

    /// Sends one part; blocks until there is space.
    fn send_part(&self, part: Vec<u8>) -> Result<(), LinkClosed> {
        let mut packets = Packets::new();
        let mut outbox = self.outbox();
        while !outbox.outbound.has_room() {
            if self.closed.load(Ordering::Acquire) {
                return Err(LinkClosed);
            }
            outbox = self.room.wait(outbox).unwrap_or_else(PoisonError::into_inner);
        }
        if self.closed.load(Ordering::Acquire) {
            return Err(LinkClosed);
        }
        outbox.outbound.push(0, part, self.time.steady_ns(), &mut packets);
        drop(outbox);
        packets.into_iter().for_each(|packet| self.outlets.parts.send(packet));
        Ok(())
    }

    /// Stops sending, and wakes threads that wait for space. Returns true for the first caller.
    fn shut(&self) -> bool {
        let first = !self.closed.swap(true, Ordering::AcqRel);
        // A thread that has checked but does not wait yet holds the lock, and must not miss this.
        drop(self.outbox());
        self.room.notify_all();
        first
    }

    fn close(&self) {
        if self.shut() {
            let now_ns = self.time.steady_ns();
            self.post(|outbound, out| outbound.push(0, vec![CLOSES], now_ns, out));
        }
        drop(self.inbox());
        self.arrived.notify_all();
    }

    fn outbox(&self) -> MutexGuard<'_, Outbox> {
        self.out.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn inbox(&self) -> MutexGuard<'_, Inbox> {
        self.inbox.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Inbox {
    /// Returns the next frame if it is complete; fails with `LinkClosed` after the last one.
    fn frame(&mut self) -> Result<Option<Vec<u8>>, LinkClosed> {
        while let Some(part) = self.parts.pop_front() {
            self.taken += 1;
            let Some((kind, bytes)) = part.split_first() else { continue };
            self.frame.extend_from_slice(bytes);
            match *kind {
                MORE if self.frame.len() <= FRAME_BYTES_MAX => {}
                LAST => return Ok(Some(std::mem::take(&mut self.frame))),
                _ => self.ended = true,
            }
        }
        if self.ended { Err(LinkClosed) } else { Ok(None) }
    }
}

impl BridgeWork for LinkState {
    fn rung(&self, _now_ns: i64) {}

    fn tick(&self, now_ns: i64) -> bool {
        self.post(|outbound, out| outbound.tick(now_ns, out));
        let mut answers = Packets::new();
        {
            let mut inbox = self.inbox();
            let taken = inbox.taken;
            inbox.inbound.popped(taken);
            inbox.inbound.tick(now_ns, &mut answers);
        }
        self.answer(answers);
        if !self.dropped.load(Ordering::Acquire) {
            return true;
        }
        let mut outbox = self.outbox();
        let until_ns = *outbox.until_ns.get_or_insert(now_ns + LINGER_NS);
        let stays = !outbox.outbound.is_idle() && now_ns < until_ns && !self.lost.load(Ordering::Acquire);
        let subscriptions = if stays { Vec::new() } else { std::mem::take(&mut outbox.subscriptions) };
        // The outlets are dropped outside the lock, because a packet that is arriving may delay them.
        drop(outbox);
        drop(subscriptions);
        stays
    }

    fn again(&self, now_ns: i64) {
        self.post(|outbound, out| outbound.again(now_ns, out));
        let mut answers = Packets::new();
        self.inbox().inbound.ask(now_ns, &mut answers);
        self.answer(answers);
    }

    fn lose(&self, host: u64) {
        if host == self.host {
            self.lost.store(true, Ordering::Release);
            self.shut();
            drop(self.inbox());
            self.arrived.notify_all();
        }
    }

    fn is_idle(&self) -> bool {
        self.lost.load(Ordering::Acquire) || self.outbox().outbound.is_idle()
    }
}

/// A program's handle on a link. Dropping it closes the link.
pub(crate) struct HostLink(pub(crate) Arc<LinkState>);

impl Link for HostLink {
    fn send(&self, frame: &[u8]) -> Result<(), LinkClosed> {
        let _one_at_a_time = self.0.sending.lock().unwrap_or_else(PoisonError::into_inner);
        let parts = frame.len().div_ceil(PART_BYTES).max(1);
        for at in 0..parts {
            let bytes = &frame[at * PART_BYTES..frame.len().min((at + 1) * PART_BYTES)];
            let mut part = Vec::with_capacity(1 + bytes.len());
            part.push(if at + 1 == parts { LAST } else { MORE });
            part.extend_from_slice(bytes);
            self.0.send_part(part)?;
        }
        Ok(())
    }

    fn receive(&self, limit: Duration) -> Result<Option<Vec<u8>>, LinkClosed> {
        let until = Instant::now().checked_add(limit);
        let mut inbox = self.0.inbox();
        loop {
            if let Some(frame) = inbox.frame()? {
                return Ok(Some(frame));
            }
            // This side has closed it, or the other host has left; all complete frames were received above.
            if self.0.lost.load(Ordering::Acquire) || self.0.dropped.load(Ordering::Acquire) || self.0.closed_here(&inbox) {
                return Err(LinkClosed);
            }
            let left = until.map_or(Duration::from_secs(3600), |until| until.saturating_duration_since(Instant::now()));
            if left.is_zero() {
                return Ok(None);
            }
            inbox = self.0.arrived.wait_timeout(inbox, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    fn close(&self) {
        self.0.close();
    }
}

impl LinkState {
    /// Returns true if this side has closed the link and expects no more data from the other side.
    fn closed_here(&self, inbox: &Inbox) -> bool {
        self.closed.load(Ordering::Acquire) && inbox.parts.is_empty()
    }
}

impl Drop for HostLink {
    fn drop(&mut self) {
        self.0.close();
        self.0.dropped.store(true, Ordering::Release);
    }
}
