// SPDX-License-Identifier: Apache-2.0
//! The zenoh wire, on a session that is replaced if it has lost its connection permanently. A joining session normally reconnects by
//! itself, unless the new connection breaks at the instant at which it is made: zenoh (1.10) has not yet noted its owner by then, and
//! stops trying. From outside that looks like a long cut, so every long cut is ended with a new session.
use crate::endpoint::Endpoint;
use crate::network::{Arrival, Network, NetworkError, Outlet, Subscription, Urgency};
use crate::options::Options;
use crate::refused::JoinError;
use crate::session::{self, Side};
use crate::threads;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock, Weak};
use std::thread::JoinHandle;
use std::time::Duration;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::{Session, Wait};

/// Period at which the connection is checked.
const LOOK: Duration = Duration::from_secs(1);
/// Number of consecutive failed checks after which the session is replaced: longer than a session takes to reconnect by itself if it can.
const LOOKS_MAX: u32 = 5;
/// Time limit for a new session to connect. Closing the host may have to wait as long.
const RENEWAL: Duration = Duration::from_secs(2);

/// A connection between hosts over zenoh.
pub(crate) struct ZenohWire {
    shared: Arc<SharedSession>,
    /// Watcher of a joining side; its thread ends when the sender is dropped.
    watching: Option<(mpsc::Sender<()>, JoinHandle<()>)>,
}

struct SharedSession {
    open: RwLock<Open>,
    /// Subscribers to packets of a key.
    subscribed: Mutex<Vec<Weak<SubscribedKey>>>,
}

/// A session, and the number of sessions before it.
struct Open {
    session: Session,
    renewals: u64,
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
    /// Publisher, and the number of its session.
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
        let session = session::open(options, endpoint, side)?;
        let shared = Arc::new(SharedSession { open: RwLock::new(Open { session, renewals: 0 }), subscribed: Mutex::default() });
        if side == Side::Listens {
            return Ok(ZenohWire { shared, watching: None });
        }
        let (alive, ended) = mpsc::channel();
        let (watched, options, to) = (shared.clone(), Options { join_max: RENEWAL, ..options.clone() }, endpoint.clone());
        let thread = std::thread::Builder::new().name("hosts-way".to_owned()).spawn(move || watched.watch(&ended, || session::open(&options, &to, side)));
        let no_thread = |error| JoinError::NoWay { endpoint: endpoint.to_string(), reason: format!("no thread for the way: {error}") };
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

impl SharedSession {
    fn session(&self) -> Session {
        self.open.read().unwrap_or_else(PoisonError::into_inner).session.clone()
    }

    fn renewals(&self) -> u64 {
        self.open.read().unwrap_or_else(PoisonError::into_inner).renewals
    }

    /// Watches the connection until `ended` is signalled.
    fn watch(&self, ended: &mpsc::Receiver<()>, open: impl Fn() -> Result<Session, JoinError>) {
        let mut looks = 0;
        while ended.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
            looks = if self.session().info().routers_zid().wait().next().is_some() { 0 } else { looks + 1 };
            if looks >= LOOKS_MAX {
                // If no new session can be opened, the old one stays, because it may still reconnect.
                if let Ok(session) = open() {
                    self.renew(session);
                }
                looks = 0;
            }
        }
    }

    /// Replaces the session; all traffic moves to the new one.
    fn renew(&self, session: Session) {
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
        for one in subscribed {
            // A subscriber that cannot be declared is silent until the next renewal.
            let declared = one.declared(&session).ok();
            let earlier = std::mem::replace(&mut *locked(&one.declared), declared);
            drop(earlier);
        }
        let _ = before.close().wait();
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
    use std::sync::atomic::{AtomicU64, Ordering};

    #[test]
    fn what_was_declared_goes_over_the_session_that_is_made_anew() {
        let port = std::net::TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr()).expect("a port is free").port();
        let security = Security::Loopback { secret: "a-secret-of-the-tests".to_owned() };
        let options = |name: &str| Options { security: security.clone(), ..Options::new("renewed", name, &format!("tcp/127.0.0.1:{port}")) };
        let (here, there) = (options("a"), options("b"));
        let endpoint = here.check().expect("loopback");
        let listening = ZenohWire::open(&here, &endpoint, Side::Listens).expect("the port is free");
        let joining = ZenohWire::open(&there, &endpoint, Side::Joins).expect("it listens");
        let came = [AtomicU64::new(0), AtomicU64::new(0)].map(Arc::new);
        let [forth, back] = came.clone().map(|last| -> Arrival { Arc::new(move |bytes| last.store(u64::from(bytes[0]), Ordering::Release)) });
        let _kept = (listening.subscribe("forth", forth).expect("open"), joining.subscribe("back", back).expect("open"));
        let ended = joining.subscribe("back", Arc::new(|_: &[u8]| panic!("it has ended"))).expect("open");
        drop(ended);
        let outlets = [joining.outlet("forth", Urgency::Values).expect("open"), listening.outlet("back", Urgency::Values).expect("open")];
        for round in 1..=3 {
            let until = std::time::Instant::now() + Duration::from_secs(60);
            for (outlet, last) in outlets.iter().zip(&came) {
                while last.load(Ordering::Acquire) != round {
                    assert!(std::time::Instant::now() < until, "round {round}: nothing comes");
                    outlet.send(vec![round as u8]);
                    std::thread::park_timeout(Duration::from_millis(1));
                }
            }
            joining.shared.renew(session::open(&there, &endpoint, Side::Joins).expect("it listens"));
        }
        assert_eq!(joining.shared.renewals(), 3);
        drop(outlets);
    }
}
