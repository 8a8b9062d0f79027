// SPDX-License-Identifier: Apache-2.0
//! The bridge: the only thread of a host that serves its ends, and the state that it shares with the threads that receive packets.
use crate::agreement::Ping;
use crate::bell::Bell;
use crate::control::Control;
use crate::network::{Network, NetworkError, Outlet, Subscription, Urgency};
use crate::options::Options;
use crate::peers::{MessageMeaning, Peers};
use crate::slots::{BridgeWork, Slots};
use crate::timebase::Timebase;
use scheduling::Children;
use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Period at which the bridge checks for work that is due, ns.
const TICK_NS: i64 = 10_000_000;
/// Delay of a tick above which the process is assumed to have been suspended, ns.
const STOOD_STILL_NS: i64 = 250_000_000;
/// Period at which a joined host pings the listener for its time, ns.
const PING_NS: i64 = 100_000_000;
/// Number of initial pings, which are sent at every tick.
const QUICK_PINGS: usize = 16;
/// Time limit for sending the last frames when a host leaves.
const GOODBYE: Duration = Duration::from_secs(1);

/// State of a host, without its thread.
pub(crate) struct Core {
    pub(crate) options: Options,
    pub(crate) wire: Arc<dyn Network>,
    /// Number of this host.
    pub(crate) id: u64,
    /// Number of the listening host.
    listener: u64,
    pub(crate) time: Arc<Timebase>,
    pub(crate) bell: Arc<Bell>,
    pub(crate) slots: Slots,
    peers: Mutex<Peers>,
    peers_changed: Condvar,
    /// Outlets for the control packets to each host.
    outlets: Mutex<HashMap<u64, Arc<dyn Outlet>>>,
    subscriptions: Mutex<Vec<Subscription>>,
    whole_again: AtomicBool,
    stops: AtomicBool,
}

/// Returns the prefix of all keys of a system.
pub(crate) fn root(system: &str) -> String {
    format!("opengpac/{system}")
}

impl Core {
    pub(crate) fn new(options: Options, wire: Arc<dyn Network>, id: u64, listener: u64) -> Self {
        let time = Arc::new(Timebase::new(options.clocks.clone()));
        Core {
            options,
            wire,
            id,
            listener,
            time,
            bell: Arc::new(Bell::new()),
            slots: Slots::default(),
            peers: Mutex::default(),
            peers_changed: Condvar::new(),
            outlets: Mutex::default(),
            subscriptions: Mutex::default(),
            whole_again: AtomicBool::new(false),
            stops: AtomicBool::new(false),
        }
    }

    pub(crate) fn root(&self) -> String {
        root(&self.options.system)
    }

    /// Returns the key prefix of this run of the system. It differs from that of earlier runs because a listener draws a new random
    /// number each time.
    pub(crate) fn base(&self) -> String {
        format!("{}/{:x}", self.root(), self.listener)
    }

    pub(crate) fn peers(&self) -> MutexGuard<'_, Peers> {
        self.peers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Keeps a subscription for as long as this host exists.
    pub(crate) fn keep(&self, subscription: Subscription) {
        self.subscriptions.lock().unwrap_or_else(PoisonError::into_inner).push(subscription);
    }

    /// Waits until a condition on the other hosts holds; returns false if it does not hold by `until`.
    pub(crate) fn wait_for_peers(&self, until: Instant, holds: impl Fn(&Peers) -> bool) -> bool {
        let mut peers = self.peers();
        loop {
            if holds(&peers) {
                return true;
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return false;
            }
            peers = self.peers_changed.wait_timeout(peers, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    fn say(&self, to: u64, control: &Control) {
        let outlet = {
            let mut outlets = self.outlets.lock().unwrap_or_else(PoisonError::into_inner);
            match outlets.get(&to) {
                Some(outlet) => outlet.clone(),
                None => {
                    // Without a connection nothing is sent; important messages are repeated anyway.
                    let Ok(outlet) = self.wire.outlet(&format!("{}/host/{to:x}", self.base()), Urgency::Clock) else { return };
                    outlets.entry(to).or_insert(outlet.into()).clone()
                }
            }
        };
        outlet.send(control.emit());
    }

    /// Handles a control packet.
    fn heard(&self, bytes: &[u8]) {
        let (now_ns, now_wall_ns) = (self.time.steady_ns(), self.time.wall_ns());
        match Control::parse(bytes) {
            Some(Control::Ping { from, left_ns, left_wall_ns, offset }) => {
                let offset = offset.map(|offset| offset.reversed());
                let heard = self.peers().heard(from, offset, None, self.options.clock_limit_ns, now_ns);
                // An unknown or replaced host gets no answer, and learns by this that it no longer belongs to the system.
                if heard.is_some() {
                    self.say(from, &Control::Pong { from: self.id, left_ns, left_wall_ns, answered_ns: now_ns, answered_wall_ns: now_wall_ns });
                }
                self.act_on(heard);
            }
            Some(Control::Pong { from, left_ns, left_wall_ns, answered_ns, answered_wall_ns }) => {
                self.wire.answered();
                let ping = Ping { left_ns, came_ns: now_ns, left_wall_ns, answered_ns, answered_wall_ns };
                let heard = {
                    let mut peers = self.peers();
                    let heard = peers.heard(from, None, Some(ping), self.options.clock_limit_ns, now_ns);
                    if let Some(offset) = peers.offset(from).filter(|_| from == self.listener) {
                        self.time.set_offset(offset.clock_offset_ns);
                    }
                    heard
                };
                self.act_on(heard);
            }
            Some(Control::Bye { from }) => {
                self.peers().remove(from);
                self.outlets.lock().unwrap_or_else(PoisonError::into_inner).remove(&from);
                self.slots.each(|served| served.lose(from));
                self.peers_changed.notify_all();
            }
            Some(Control::Hello(_) | Control::Welcome { .. } | Control::Refusal { .. }) | None => {}
        }
    }

    fn act_on(&self, heard: Option<MessageMeaning>) {
        let Some(MessageMeaning { whole_again, clock }) = heard else { return };
        self.peers_changed.notify_all();
        if whole_again {
            self.whole_again.store(true, Ordering::Release);
        }
        if let (Some(report), Some(watch)) = (clock, &self.options.clock_watch) {
            watch(&report);
        }
    }

    /// Serves the ends until the host stops.
    fn serve(&self) {
        let mut tick_ns = self.time.steady_ns();
        let mut ping_ns = tick_ns;
        while !self.stops.load(Ordering::Acquire) {
            let left_ns = (tick_ns - self.time.steady_ns()).clamp(0, TICK_NS);
            if left_ns > 0 {
                self.bell.wait(Duration::from_nanos(left_ns.unsigned_abs()));
            }
            let now_ns = self.time.steady_ns();
            self.bell.take(|slot| {
                if let Some(served) = self.slots.at(slot) {
                    served.rung(now_ns);
                }
            });
            if now_ns >= tick_ns {
                if now_ns - tick_ns > STOOD_STILL_NS {
                    self.peers().stood_still(now_ns - tick_ns, now_ns);
                    // Packets that arrived meanwhile may have found no room.
                    self.whole_again.store(true, Ordering::Release);
                }
                tick_ns = now_ns + TICK_NS;
                self.tick(now_ns);
                let quick = self.id != self.listener && self.peers().pings(self.listener) < QUICK_PINGS;
                if self.id != self.listener && (quick || now_ns >= ping_ns) {
                    ping_ns = now_ns + PING_NS;
                    self.ping();
                }
            }
        }
    }

    fn tick(&self, now_ns: i64) {
        if self.whole_again.swap(false, Ordering::AcqRel) {
            self.slots.each(|served| served.again(now_ns));
        }
        let silent_max_ns = i64::try_from(self.options.silent_max.as_nanos()).unwrap_or(i64::MAX);
        let gone = self.peers().take_gone(silent_max_ns, now_ns);
        for host in gone {
            self.slots.each(|served| served.lose(host));
            self.peers_changed.notify_all();
        }
        self.slots.keep(|served| served.tick(now_ns));
    }

    fn ping(&self) {
        let offset = self.peers().offset(self.listener);
        self.say(self.listener, &Control::Ping { from: self.id, left_ns: self.time.steady_ns(), left_wall_ns: self.time.wall_ns(), offset });
    }

    /// Returns true if everything that was sent has been acknowledged.
    fn is_idle(&self) -> bool {
        let idle = AtomicBool::new(true);
        self.slots.each(|served: &dyn BridgeWork| {
            idle.fetch_and(served.is_idle(), Ordering::Relaxed);
        });
        idle.into_inner()
    }

    /// Notifies all other hosts that this host is leaving.
    fn bye(&self) {
        let others: Vec<u64> = self.outlets.lock().unwrap_or_else(PoisonError::into_inner).keys().copied().collect();
        others.into_iter().for_each(|host| self.say(host, &Control::Bye { from: self.id }));
    }
}

/// A host with its thread.
pub(crate) struct Bridge {
    pub(crate) core: Arc<Core>,
    thread: Option<JoinHandle<()>>,
}

impl Bridge {
    pub(crate) fn start(core: Core) -> Result<Arc<Self>, NetworkError> {
        let core = Arc::new(core);
        let hearing = Arc::downgrade(&core);
        let hear = move |bytes: &[u8]| {
            if let Some(core) = hearing.upgrade() {
                core.heard(bytes);
            }
        };
        let subscription = core.wire.subscribe(&format!("{}/host/{:x}", core.base(), core.id), Arc::new(hear))?;
        core.keep(subscription);
        let serving = core.clone();
        let thread = std::thread::Builder::new().name("hosts".to_owned()).spawn(move || {
            // Ahead of ordinary programs and behind every source, if permitted, because values wait for this thread, which sleeps whenever
            // there is nothing to send.
            let _granted = scheduling::prioritise(1, Children::Ordinary);
            serving.serve();
        });
        let thread = thread.map_err(|error| NetworkError { message: format!("cannot start a thread for the bridge: {error}") })?;
        Ok(Arc::new(Bridge { core, thread: Some(thread) }))
    }
}

impl Drop for Bridge {
    fn drop(&mut self) {
        // The last frames and values of ends that are already closed get this time, and no more.
        let until = Instant::now() + GOODBYE;
        while !self.core.is_idle() && Instant::now() < until && self.core.peers().all(0).iter().any(|peer| !peer.gone) {
            std::thread::park_timeout(Duration::from_millis(1));
        }
        self.core.stops.store(true, Ordering::Release);
        self.core.bell.ring(0);
        if let Some(thread) = self.thread.take() {
            // A panic there has been printed; there is nothing left to stop.
            let _ = thread.join();
        }
        self.core.bye();
        let now_ns = self.core.time.steady_ns();
        for peer in self.core.peers().take_gone(-1, now_ns) {
            self.core.slots.each(|served| served.lose(peer));
        }
        let subscriptions = std::mem::take(&mut *self.core.subscriptions.lock().unwrap_or_else(PoisonError::into_inner));
        drop(subscriptions);
    }
}
