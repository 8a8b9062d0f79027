// SPDX-License-Identifier: Apache-2.0
//! Connections between a process of this host and another host. The two cannot reach each other, but this process can reach both: one of
//! its threads forwards values from one to the other.
//!
//! | | writing source | relay | reading source |
//! |---|---|---|---|
//! | may block another | never | never | never |
//! | if the relay is held up | continues; `Full` when the queue to the relay is full | | continues with its current values |
//! | if the queue of an end is full | | the row stays in the previous queue, and is retried | |
//!
//! A publication keeps its number and its time, so the reader knows its age, as on any other path.
use crate::locked::locked;
use crate::remote::Remote;
use interconnect::{EndError, Receiver, Sender};
use kernel::Way;
use kernel::bell::Bell;
use kernel::clock::monotonic_ns;
use scheduling::Children;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, Weak};
use std::thread::JoinHandle;

/// Period at which the relay polls for groups, whose arrival is not signalled, and for rows that could not be forwarded because a queue
/// was full, ns.
const LOOK_NS: i64 = 1_000_000;

/// Priority below every source and above ordinary programs, if the process has the privilege.
const PRIORITY: u8 = 1;
/// Maximum number of rows of one connection that are forwarded before the other connections get their turn, because the writer may be a
/// process that sends without pause.
const ROWS_MAX: usize = 4096;

/// The relays of a host.
#[derive(Default)]
pub(crate) struct Relays(Mutex<Option<Arc<Thread>>>);

/// State that the relay thread shares with the threads that create connections.
#[derive(Default)]
pub(crate) struct Thread {
    bell: Bell,
    relays: Mutex<Vec<Relay>>,
    closing: AtomicBool,
}

/// Value held in place of the ends of a relayed connection: while one exists, the connection is relayed.
pub(crate) struct RelayDemand(Arc<Thread>);

impl Drop for RelayDemand {
    fn drop(&mut self) {
        self.0.bell.ring();
    }
}

struct Relay {
    receiver: Box<dyn Receiver>,
    sender: Box<dyn Sender>,
    group_len: usize,
    wanted: Weak<RelayDemand>,
}

impl Relays {
    /// Forwards publications of `from` over `way` to `to`, as long as the returned values are held. `epoch_ns`: epoch of the host;
    /// `keep_thread`: joins the thread when the host is closed.
    ///
    /// # Errors
    /// Fails if one of the two cannot be reached, or the thread cannot be created.
    pub(crate) fn relay(
        &self,
        way: &Way,
        from: &dyn Remote,
        to: &dyn Remote,
        epoch_ns: i64,
        keep_thread: impl FnOnce(JoinHandle<()>),
    ) -> Result<Arc<RelayDemand>, EndError> {
        let thread = self.relaying(epoch_ns, keep_thread)?;
        let waking = Arc::downgrade(&thread);
        let raise = move || {
            if let Some(thread) = waking.upgrade() {
                thread.bell.ring();
            }
        };
        let receiver = from.receiver(way.number, &way.spec, Box::new(raise))?;
        let sender = to.sender(way.number, &way.spec)?;
        let wanted = Arc::new(RelayDemand(thread));
        let relay = Relay { receiver, sender, group_len: way.spec.asynchronous_len, wanted: Arc::downgrade(&wanted) };
        locked(&wanted.0.relays).push(relay);
        wanted.0.bell.ring();
        Ok(wanted)
    }

    /// Returns the relay thread, which is started for the first relay.
    fn relaying(&self, epoch_ns: i64, keep_thread: impl FnOnce(JoinHandle<()>)) -> Result<Arc<Thread>, EndError> {
        let mut started = locked(&self.0);
        if let Some(thread) = started.as_ref() {
            return Ok(thread.clone());
        }
        let thread = Arc::<Thread>::default();
        let running = thread.clone();
        let handle = std::thread::Builder::new().name("relays".into()).spawn(move || running.run(epoch_ns));
        keep_thread(handle.map_err(|why| EndError { message: format!("cannot start a thread for the relay: {why}; close other programs") })?);
        Ok(started.insert(thread).clone())
    }

    /// Stops the thread.
    pub(crate) fn close(&self) {
        if let Some(thread) = locked(&self.0).as_ref() {
            thread.closing.store(true, Ordering::Release);
            thread.bell.ring();
        }
    }
}

impl Thread {
    fn run(&self, epoch_ns: i64) {
        // It also works without the right, only later.
        let _given = scheduling::prioritise(PRIORITY, Children::Ordinary);
        while !self.closing.load(Ordering::Acquire) {
            let seen = self.bell.rings();
            let now_ns = monotonic_ns();
            let mut looks = false;
            let mut relays = locked(&self.relays);
            relays.retain(|relay| relay.wanted.strong_count() > 0);
            relays.iter_mut().for_each(|relay| looks |= relay.hand_on(now_ns - epoch_ns));
            drop(relays);
            self.bell.sleep(seen, looks.then_some(now_ns + LOOK_NS));
        }
        locked(&self.relays).clear();
    }
}

impl Relay {
    /// Forwards everything that has arrived; returns true if the relay must poll again soon.
    fn hand_on(&mut self, now_ns: i64) -> bool {
        if let Some(header) = self.receiver.latch(now_ns) {
            self.sender.group().copy_from_slice(self.receiver.group());
            self.sender.publish(header.number, header.time_ns);
        }
        for _ in 0..ROWS_MAX {
            let Some((number, row)) = self.receiver.peek_row() else { return self.group_len > 0 };
            if self.sender.push(number, now_ns, &mut |into| into.copy_from_slice(row)).is_err() {
                return true;
            }
            self.receiver.pop_row();
        }
        true
    }
}
