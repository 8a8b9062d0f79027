// SPDX-License-Identifier: Apache-2.0
//! The zenoh wire, on a session that is replaced if the listening side does not answer over it.
//!
//! A joining session normally reconnects by itself, but zenoh (1.10) can fail permanently in two ways. If a connection breaks at the
//! instant at which it is established, it has no owner yet, and no part of zenoh establishes another. If a connection is opened or
//! accepted more slowly than the time limit (on a busy machine), it may remain without its reader: both sides count as connected and
//! exchange keep-alives, one of them receives nothing, and no second connection of the same session is accepted. The state that the
//! session reports is therefore ignored. Only answers from the listening side count, and every long silence leads to a new session.
use crate::endpoint::Endpoint;
use crate::network::{Arrival, Network, NetworkError, Outlet, Subscription, Urgency};
use crate::options::Options;
use crate::refused::JoinError;
use crate::session::{self, Side};
use crate::threads;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock, Weak};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::{Session, Wait};

/// Period at which the wire checks for answers.
const LOOK: Duration = Duration::from_secs(1);
/// Number of consecutive periods without an answer after which the session is replaced. This is longer than a session takes to reconnect
/// by itself, if it can (2 s for the lease and less than 1 s for the new connection), and shorter than the silence of 5 s after which a
/// host is considered lost.
const LOOKS_MAX: u32 = 3;
/// Time limit for a session to connect, after which another one is tried. Closing the host may take as long.
const OPENING: Duration = Duration::from_secs(2);

/// A connection between hosts over zenoh.
pub(crate) struct ZenohWire {
    shared: Arc<SharedSession>,
    /// Watcher of a joining side; its thread ends when the sender is dropped.
    watching: Option<(mpsc::Sender<()>, JoinHandle<()>)>,
}

struct SharedSession {
    open: RwLock<Open>,
    /// Number of answers from the listening side.
    answers: AtomicU64,
    /// Subscribers to packets of a key.
    subscribed: Mutex<Vec<Weak<SubscribedKey>>>,
}

/// A session, and the number of sessions before it.
struct Open {
    session: Session,
    renewals: u64,
}

/// Number of consecutive checks without an answer.
#[derive(Default)]
struct Silence {
    looks: u32,
    answers: u64,
}

impl Silence {
    /// Returns true if the number of answers has not changed for too many consecutive checks.
    fn lasts(&mut self, answers: u64) -> bool {
        let is_answered = std::mem::replace(&mut self.answers, answers) != answers;
        self.looks = if is_answered { 0 } else { self.looks + 1 };
        self.looks >= LOOKS_MAX
    }
}

struct SubscribedKey {
    key: String,
    came: Arrival,
    declared: Mutex<Option<Subscriber<()>>>,
}

struct ZenohOutlet {
    shared: Arc<SharedSession>,
    key: String,
    priority: Priority,
    /// Publisher, and the number of the session in which it was declared.
    declared: Mutex<(u64, Publisher<'static>)>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn no_way(error: impl ToString) -> NetworkError {
    NetworkError { message: error.to_string() }
}

impl ZenohWire {
    pub(crate) fn open(options: &Options, endpoint: &Endpoint, side: Side) -> Result<Self, JoinError> {
        if side == Side::Listens {
            return Ok(ZenohWire { shared: SharedSession::new(session::open(options, endpoint, side)?), watching: None });
        }
        let (short, to) = (Options { join_max: OPENING.min(options.join_max), ..options.clone() }, endpoint.clone());
        let open = move || session::open(&short, &to, side);
        let shared = SharedSession::new(until(Instant::now() + options.join_max, &open)?);
        let (alive, ended) = mpsc::channel();
        let watched = shared.clone();
        let thread = std::thread::Builder::new().name("hosts-way".to_owned()).spawn(move || watched.watch(&ended, LOOK, open));
        let no_thread = |error| JoinError::NoWay { endpoint: endpoint.to_string(), reason: format!("cannot start a thread for the connection: {error}") };
        let thread = thread.map_err(no_thread)?;
        Ok(ZenohWire { shared, watching: Some((alive, thread)) })
    }
}

impl Drop for ZenohWire {
    fn drop(&mut self) {
        if let Some((alive, thread)) = self.watching.take() {
            drop(alive);
            // A panic there has been printed; there is nothing left to stop.
            let _ = thread.join();
        }
        // The session is closed now or was already; no further action is needed.
        let _ = self.shared.session().close().wait();
    }
}

/// Opens sessions until one is connected. Returns the last error if none is connected by `limit`, and returns any error other than a
/// timeout immediately.
fn until<E>(limit: Instant, open: impl Fn() -> Result<Session, E>) -> Result<Session, E> {
    loop {
        let begun = Instant::now();
        match open() {
            Err(_) if begun.elapsed() >= OPENING && Instant::now() < limit => {}
            opened => return opened,
        }
    }
}

impl SharedSession {
    fn new(session: Session) -> Arc<Self> {
        Arc::new(SharedSession { open: RwLock::new(Open { session, renewals: 0 }), answers: AtomicU64::new(0), subscribed: Mutex::default() })
    }

    fn session(&self) -> Session {
        self.open.read().unwrap_or_else(PoisonError::into_inner).session.clone()
    }

    fn renewals(&self) -> u64 {
        self.open.read().unwrap_or_else(PoisonError::into_inner).renewals
    }

    /// Watches the connection until `ended` is signalled.
    fn watch(&self, ended: &mpsc::Receiver<()>, look: Duration, open: impl Fn() -> Result<Session, JoinError>) {
        let mut silence = Silence::default();
        while ended.recv_timeout(look) == Err(RecvTimeoutError::Timeout) {
            // If no new session can be opened, the old one stays, because it may still reconnect. If a subscriber could not be declared in
            // the new one, it would hear nothing: the next look opens another.
            if silence.lasts(self.answers.load(Ordering::Relaxed))
                && let Ok(session) = open()
                && self.renew(session)
            {
                silence.looks = 0;
            }
        }
    }

    /// Replaces the session; all traffic moves to the new one. Returns false if a subscriber could not be declared in it.
    fn renew(&self, session: Session) -> bool {
        let before = {
            let mut open = self.open.write().unwrap_or_else(PoisonError::into_inner);
            let before = std::mem::replace(&mut open.session, session.clone());
            open.renewals += 1;
            before
        };
        let subscribed: Vec<Arc<SubscribedKey>> = {
            let mut subscribed = locked(&self.subscribed);
            subscribed.retain(|one| one.strong_count() > 0);
            subscribed.iter().filter_map(Weak::upgrade).collect()
        };
        let mut whole = true;
        for one in subscribed {
            let declared = one.declared(&session).ok();
            whole &= declared.is_some();
            let earlier = std::mem::replace(&mut *locked(&one.declared), declared);
            drop(earlier);
        }
        let _ = before.close().wait();
        whole
    }

    fn publisher(&self, key: &str, priority: Priority) -> Result<(u64, Publisher<'static>), NetworkError> {
        let (session, renewals) = {
            let open = self.open.read().unwrap_or_else(PoisonError::into_inner);
            (open.session.clone(), open.renewals)
        };
        let declared = session.declare_publisher(key.to_owned()).congestion_control(CongestionControl::Drop).priority(priority).express(true).wait();
        Ok((renewals, declared.map_err(no_way)?))
    }
}

impl SubscribedKey {
    fn declared(&self, session: &Session) -> Result<Subscriber<()>, NetworkError> {
        let came = self.came.clone();
        let declared = session.declare_subscriber(self.key.clone()).callback(move |sample| {
            threads::hasten();
            came(&sample.payload().to_bytes());
        });
        declared.wait().map_err(no_way)
    }
}

impl Network for ZenohWire {
    fn outlet(&self, key: &str, urgency: Urgency) -> Result<Box<dyn Outlet>, NetworkError> {
        let priority = match urgency {
            Urgency::Clock => Priority::RealTime,
            Urgency::Values => Priority::InteractiveHigh,
            Urgency::Commands => Priority::Data,
        };
        let declared = Mutex::new(self.shared.publisher(key, priority)?);
        Ok(Box::new(ZenohOutlet { shared: self.shared.clone(), key: key.to_owned(), priority, declared }))
    }

    fn subscribe(&self, key: &str, came: Arrival) -> Result<Subscription, NetworkError> {
        let one = Arc::new(SubscribedKey { key: key.to_owned(), came, declared: Mutex::new(None) });
        // The key is registered first and then declared: a renewal between the two declares it too, and the later declaration remains.
        locked(&self.shared.subscribed).push(Arc::downgrade(&one));
        let declared = one.declared(&self.shared.session())?;
        let mut standing = locked(&one.declared);
        if standing.is_none() {
            *standing = Some(declared);
        }
        drop(standing);
        Ok(Box::new(one))
    }

    fn answered(&self) {
        self.shared.answers.fetch_add(1, Ordering::Relaxed);
    }
}

impl Outlet for ZenohOutlet {
    fn send(&self, packet: Vec<u8>) {
        let mut declared = locked(&self.declared);
        if declared.0 != self.shared.renewals() {
            // Without a publisher this packet is lost; the protocol retransmits it.
            let Ok(renewed) = self.shared.publisher(&self.key, self.priority) else { return };
            *declared = renewed;
        }
        // A packet that zenoh rejects is lost, as on any wire; the protocol retransmits it.
        let _ = declared.1.put(packet).wait();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::Security;

    /// Returns a wire that listens, the options of a host that joins it, and its endpoint.
    fn listening() -> (ZenohWire, Options, Endpoint) {
        let port = std::net::TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr()).expect("a port is free").port();
        let security = Security::Loopback { secret: "a-secret-of-the-tests".to_owned() };
        let options = |name: &str| Options { security: security.clone(), ..Options::new("renewed", name, &format!("tcp/127.0.0.1:{port}")) };
        let endpoint = options("a").check().expect("loopback");
        (ZenohWire::open(&options("a"), &endpoint, Side::Listens).expect("the port is free"), options("b"), endpoint)
    }

    /// Returns a packet handler, and the variable in which it stores the first byte of the latest packet.
    fn last_arrival() -> (Arrival, Arc<AtomicU64>) {
        let last = Arc::new(AtomicU64::new(0));
        let noted = last.clone();
        (Arc::new(move |bytes| noted.store(u64::from(bytes[0]), Ordering::Release)), last)
    }

    fn send_until_it_arrives(outlet: &dyn Outlet, round: u8, last: &AtomicU64) {
        let until = Instant::now() + Duration::from_secs(60);
        while last.load(Ordering::Acquire) != u64::from(round) {
            assert!(Instant::now() < until, "round {round}: nothing comes");
            outlet.send(vec![round]);
            std::thread::park_timeout(Duration::from_millis(1));
        }
    }

    #[test]
    fn what_was_declared_goes_over_the_session_that_is_made_anew() {
        let (listening, there, endpoint) = listening();
        let joining = ZenohWire::open(&there, &endpoint, Side::Joins).expect("it listens");
        let ((forth, came_forth), (back, came_back)) = (last_arrival(), last_arrival());
        let _kept = (listening.subscribe("forth", forth).expect("open"), joining.subscribe("back", back).expect("open"));
        let ended = joining.subscribe("back", Arc::new(|_: &[u8]| panic!("it has ended"))).expect("open");
        drop(ended);
        let outlets = (joining.outlet("forth", Urgency::Values).expect("open"), listening.outlet("back", Urgency::Values).expect("open"));
        for round in 1..=3 {
            send_until_it_arrives(outlets.0.as_ref(), round, &came_forth);
            send_until_it_arrives(outlets.1.as_ref(), round, &came_back);
            assert!(joining.shared.renew(session::open(&there, &endpoint, Side::Joins).expect("it listens")));
        }
        // Nothing is answered here, so that a slow run may have seen more of them.
        assert!(joining.shared.renewals() >= 3);
        drop(outlets);
    }

    #[test]
    fn a_session_that_counts_as_connected_and_hears_nothing_is_replaced_until_one_hears() {
        let (listening, there, endpoint) = listening();
        let open = || session::open(&there, &endpoint, Side::Joins);
        let joining = ZenohWire { shared: SharedSession::new(open().expect("it listens")), watching: None };
        let (back, came_back) = last_arrival();
        let _kept = joining.subscribe("back", back).expect("open");
        let outlet = listening.outlet("back", Urgency::Values).expect("open");
        send_until_it_arrives(outlet.as_ref(), 1, &came_back);

        // The first new session is closed before anything can be declared in it.
        let opened = AtomicU64::new(0);
        let open_closed_first = || -> Result<Session, JoinError> {
            let session = open()?;
            if opened.fetch_add(1, Ordering::Relaxed) == 0 {
                session.close().wait().expect("it is open");
            }
            Ok(session)
        };
        locked(&joining.shared.subscribed)[0].upgrade().expect("it is kept").declared.lock().expect("no holder panics").take();
        assert_eq!(joining.shared.session().info().routers_zid().wait().count(), 1, "zenoh calls it connected");
        let ((alive, ended), shared) = (mpsc::channel::<()>(), joining.shared.clone());
        std::thread::scope(|scope| {
            scope.spawn(move || shared.watch(&ended, Duration::from_millis(10), open_closed_first));
            send_until_it_arrives(outlet.as_ref(), 2, &came_back);
            drop(alive);
        });
        assert!(opened.into_inner() >= 2);
    }

    #[test]
    fn only_a_silence_of_several_looks_is_long() {
        let mut silence = Silence::default();
        for answers in 1..100 {
            assert!((1..LOOKS_MAX).all(|_| !silence.lasts(answers)) && !silence.lasts(answers + 1));
        }
        assert!((1..LOOKS_MAX).all(|_| !silence.lasts(100)) && silence.lasts(100) && silence.lasts(100), "it lasts until there is an answer");
        assert!(!silence.lasts(101));
    }
}
