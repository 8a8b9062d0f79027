// SPDX-License-Identifier: Apache-2.0
//! A host of a system that consists of several hosts: it either listens or has joined.
use crate::agreement::ClockOffset;
use crate::bridge::{Bridge, Core};
use crate::control::{Control, Hello, PROTOCOL_VERSION};
use crate::ends;
use crate::link::{HostLink, LinkState, Outlets};
use crate::network::{Network, NetworkError, Outlet, Urgency};
use crate::options::Options;
use crate::peers::{KnownPeer, Peer};
use crate::refused::JoinError;
use crate::renewing::ZenohWire;
use crate::secret;
use crate::session::Side;
use interconnect::{ConnectionSpec, EndError, Ends, Link, Receiver, Sender};
use std::sync::mpsc;
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

/// Target platform of this build.
pub const TARGET: &str = env!("OPENGPAC_TARGET");

/// Number of ping answers that a joining host waits for, because it has no usable clock offset before.
const PINGS_TO_JOIN: usize = 4;
/// Period at which a joining host sends hellos, ms.
const HELLO_MS: u64 = 100;

/// A host's membership in a system of several hosts. Clones share it; the host leaves when the last clone is dropped.
#[derive(Clone)]
pub struct Hosts(Arc<Bridge>);

impl Hosts {
    /// Listens for other hosts. The supervisor's host does this.
    ///
    /// # Errors
    /// Fails with [`JoinError`] if the endpoint is in use, or is not secured as its address requires.
    pub fn listen(options: Options) -> Result<Hosts, JoinError> {
        let wire = wire_to_listen(&options)?;
        Hosts::listen_over(options, wire)
    }

    /// Listens as [`listen`](Self::listen) does, over an existing wire.
    ///
    /// # Errors
    /// Fails as [`listen`](Self::listen) does.
    pub fn listen_over(options: Options, wire: Arc<dyn Network>) -> Result<Hosts, JoinError> {
        let endpoint = options.check()?.to_string();
        let no_way = |error: NetworkError| JoinError::NoWay { endpoint: endpoint.clone(), reason: error.message };
        let id = crate::random::number();
        let core = Core::new(options, wire, id, id);
        let bridge = Bridge::start(core).map_err(no_way)?;
        let greeting = Arc::downgrade(&bridge.core);
        let root = bridge.core.root();
        let greet = bridge.core.wire.subscribe(&format!("{root}/hello"), Arc::new(move |bytes| greet(&greeting, bytes))).map_err(no_way)?;
        bridge.core.keep(greet);
        Ok(Hosts(bridge))
    }

    /// Joins the host that listens at the endpoint.
    ///
    /// # Errors
    /// Fails with [`JoinError`] if no host answers, this host is not admitted, or the two builds do not match.
    pub fn join(options: Options) -> Result<Hosts, JoinError> {
        let wire = wire_to_join(&options)?;
        Hosts::join_over(options, wire)
    }

    /// Joins as [`join`](Self::join) does, over an existing wire.
    ///
    /// # Errors
    /// Fails as [`join`](Self::join) does.
    pub fn join_over(options: Options, wire: Arc<dyn Network>) -> Result<Hosts, JoinError> {
        let endpoint = options.check()?.to_string();
        let no_way = |error: NetworkError| JoinError::NoWay { endpoint: endpoint.clone(), reason: error.message };
        let no_answer = || JoinError::NoAnswer { system: options.system.clone(), endpoint: endpoint.clone(), seconds: options.join_max.as_secs() };
        let until = Instant::now() + options.join_max;
        let id = crate::random::number();
        let answer = knock(&options, wire.as_ref(), (id, port_of(&endpoint)), until).map_err(no_way)?.ok_or_else(no_answer)?;
        let (listener, name, target) = match answer {
            Control::Welcome { id, name, target, .. } => (id, name, target),
            Control::Refusal { reason } => return Err(JoinError::ByListener { system: options.system, endpoint, name: options.name, reason }),
            _ => return Err(no_answer()),
        };
        let core = Core::new(options.clone(), wire, id, listener);
        let known = KnownPeer::new(listener, name, target, core.time.steady_ns());
        core.peers().admit(known, core.time.steady_ns()).expect("the first host is let in");
        let bridge = Bridge::start(core).map_err(no_way)?;
        if !bridge.core.wait_for_peers(until, |peers| peers.pings(listener) >= PINGS_TO_JOIN) {
            return Err(no_answer());
        }
        Ok(Hosts(bridge))
    }

    /// Returns the other hosts: all hosts that have joined if this host listens, otherwise only the listening host.
    pub fn peers(&self) -> Vec<Peer> {
        let now_ns = self.0.core.time.steady_ns();
        self.0.core.peers().all(now_ns)
    }

    /// Waits until a host has joined and its clock has been measured, but at most for `limit`; returns false if this did not happen.
    pub fn wait_for(&self, name: &str, limit: Duration) -> bool {
        let measured = |peers: &crate::peers::Peers| peers.id(name).is_some_and(|id| peers.offset(id).is_some());
        self.0.core.wait_for_peers(Instant::now() + limit, measured)
    }

    /// Opens the link with this number to a host, for commands. Each side opens it once, in any order.
    ///
    /// # Errors
    /// Fails if no such host has joined, or if it has left.
    pub fn link(&self, host: &str, number: u64) -> Result<Box<dyn Link>, EndError> {
        let core = &self.0.core;
        let missing = || EndError { message: format!("host '{host}' has not joined system '{}'; start `opengpac join` there", core.options.system) };
        let far = core.peers().id(host).ok_or_else(missing)?;
        let key = |from: u64, to: u64, what: &str| format!("{}/link/{number:x}/{from:x}/{to:x}/{what}", core.base());
        let outlet = |key: String| core.wire.outlet(&key, Urgency::Commands).map_err(no_end);
        let outlets = Outlets { parts: outlet(key(core.id, far, "parts"))?, answers: outlet(key(far, core.id, "answers"))? };
        let state = core.slots.take(|_| Arc::new(LinkState::new(number, far, outlets, core.time.clone())))?;
        let (parts, answers) = (Arc::downgrade(&state), Arc::downgrade(&state));
        let part_came = Arc::new(move |bytes: &[u8]| with(&parts, |state| state.part_came(bytes)));
        let answer_came = Arc::new(move |bytes: &[u8]| with(&answers, |state| state.answer_came(bytes)));
        let link = HostLink(state);
        let subscriptions = [core.wire.subscribe(&key(far, core.id, "parts"), part_came), core.wire.subscribe(&key(core.id, far, "answers"), answer_came)];
        link.0.subscribed(subscriptions.into_iter().collect::<Result<_, _>>().map_err(no_end)?);
        Ok(Box::new(link))
    }

    /// Sets the origin of the system's times, ns on this host's CLOCK_MONOTONIC; the default is 0.
    pub fn set_epoch(&self, epoch_ns: i64) {
        self.0.core.time.set_epoch(epoch_ns);
    }

    /// Converts a time of the listening host's CLOCK_MONOTONIC to this host's, ns, so that the timers of all hosts share one epoch.
    pub fn here_ns(&self, listener_ns: i64) -> i64 {
        self.0.core.time.here_ns(listener_ns)
    }

    /// Returns the offset of another host's clocks from this one's; `None` if the host is unknown or has not been measured yet.
    pub fn clock_offset(&self, host: &str) -> Option<ClockOffset> {
        let peers = self.0.core.peers();
        peers.id(host).and_then(|id| peers.offset(id))
    }

    fn outlet(&self, key: &str) -> Result<Box<dyn Outlet>, EndError> {
        self.0.core.wire.outlet(key, Urgency::Values).map_err(no_end)
    }

    fn key(&self, number: u64, to: &str) -> String {
        format!("{}/connection/{number:x}/{to}", self.0.core.base())
    }
}

impl Ends for Hosts {
    fn sender(&mut self, number: u64, spec: &ConnectionSpec) -> Result<Box<dyn Sender>, EndError> {
        let core = &self.0.core;
        let outlet = self.outlet(&self.key(number, "reader"))?;
        let mut near = None;
        let served = core.slots.take(|slot| {
            let (served, sender) = ends::writing(number, spec, outlet, core.time.clone(), core.bell.clone(), slot);
            near = Some(sender);
            served
        })?;
        let far = Arc::downgrade(&served);
        let subscription = core.wire.subscribe(&self.key(number, "writer"), Arc::new(move |bytes| with(&far, |served| served.came(bytes))));
        served.subscribed(subscription.map_err(no_end)?);
        Ok(near.expect("it was made with the slot"))
    }

    fn receiver(&mut self, number: u64, spec: &ConnectionSpec, raise: Box<dyn Fn() + Send + Sync>) -> Result<Box<dyn Receiver>, EndError> {
        let core = &self.0.core;
        let outlet = self.outlet(&self.key(number, "writer"))?;
        let mut near = None;
        let served = core.slots.take(|slot| {
            let (served, receiver) = ends::reading(number, spec, raise, outlet, core.time.clone(), core.bell.clone(), slot);
            near = Some(receiver);
            served
        })?;
        let far = Arc::downgrade(&served);
        let subscription = core.wire.subscribe(&self.key(number, "reader"), Arc::new(move |bytes| with(&far, |served| served.came(bytes))));
        served.subscribed(subscription.map_err(no_end)?);
        Ok(near.expect("it was made with the slot"))
    }
}

/// Returns the zenoh wire of a listening host. Pass it to [`Hosts::listen_over`], wrapped if needed.
///
/// # Errors
/// Fails as [`Hosts::listen`] does.
pub fn wire_to_listen(options: &Options) -> Result<Arc<dyn Network>, JoinError> {
    Ok(Arc::new(ZenohWire::open(options, &options.check()?, Side::Listens)?))
}

/// Returns the zenoh wire of a joining host. Pass it to [`Hosts::join_over`], wrapped if needed.
///
/// # Errors
/// Fails as [`Hosts::join`] does.
pub fn wire_to_join(options: &Options) -> Result<Arc<dyn Network>, JoinError> {
    Ok(Arc::new(ZenohWire::open(options, &options.check()?, Side::Joins)?))
}

/// Returns the port of a validated endpoint.
fn port_of(endpoint: &str) -> u16 {
    endpoint.rsplit(':').next().and_then(|port| port.parse().ok()).unwrap_or_default()
}

fn no_end(error: NetworkError) -> EndError {
    EndError { message: format!("there is no connection to the other hosts: {}", error.message) }
}

fn with<T>(far: &Weak<T>, act: impl FnOnce(&T)) {
    if let Some(there) = far.upgrade() {
        act(&there);
    }
}

/// Sends hellos until the listening side answers. Returns `None` if it does not answer by `until`.
fn knock(options: &Options, wire: &dyn Network, (id, port): (u64, u16), until: Instant) -> Result<Option<Control>, NetworkError> {
    let root = crate::bridge::root(&options.system);
    let (heard, answers) = mpsc::channel();
    let hear = move |bytes: &[u8]| {
        if let Some(control) = Control::parse(bytes) {
            // The waiting thread may have received an answer already.
            let _ = heard.send(control);
        }
    };
    let _listening = wire.subscribe(&format!("{root}/hello/{id:x}"), Arc::new(hear))?;
    let door = wire.outlet(&format!("{root}/hello"), Urgency::Clock)?;
    let (name, target) = (options.name.clone(), TARGET.to_owned());
    let drawn = secret::drawn().map_err(|error| NetworkError { message: format!("cannot generate a random number: {error}") })?;
    let hello = Hello { protocol: PROTOCOL_VERSION, abi: options.abi_version, little_endian: cfg!(target_endian = "little"), id, name, target, drawn };
    let hello = Control::Hello(hello).emit();
    while Instant::now() < until {
        door.send(hello.clone());
        match answers.recv_timeout(Duration::from_millis(HELLO_MS)) {
            // A peer without the secret is not a listener of this system.
            Ok(Control::Welcome { proof, .. }) if options.security.secret().is_some_and(|secret| !secret::is_proof(secret, &drawn, port, id, &proof)) => {
                return Err(NetworkError {
                    message: "the program that listens there does not have the secret: it is not the system, or it belongs to another user".to_owned(),
                });
            }
            Ok(control) => {
                wire.answered();
                return Ok(Some(control));
            }
            Err(_) => {}
        }
    }
    Ok(None)
}

/// Handles the hello of a host: admits it, or sends the reason for refusing it.
fn greet(core: &Weak<Core>, bytes: &[u8]) {
    let Some(Control::Hello(hello)) = Control::parse(bytes) else { return };
    with(core, |core| {
        let answer = match admit(core, &hello) {
            Ok(()) => {
                let port = port_of(&core.options.endpoint);
                let proof = core.options.security.secret().map_or([0; _], |secret| secret::proof(secret, &hello.drawn, port, hello.id));
                Control::Welcome { id: core.id, name: core.options.name.clone(), target: TARGET.to_owned(), proof }
            }
            Err(reason) => Control::Refusal { reason },
        };
        // Without a connection back the host receives nothing and repeats its request.
        if let Ok(outlet) = core.wire.outlet(&format!("{}/hello/{:x}", core.root(), hello.id), Urgency::Clock) {
            outlet.send(answer.emit());
        }
    });
}

fn admit(core: &Core, hello: &Hello) -> Result<(), String> {
    let here = &core.options;
    if hello.protocol != PROTOCOL_VERSION {
        return Err(format!(
            "it speaks version {} of the protocol between hosts, but this side speaks version {PROTOCOL_VERSION}; install the same OpenGPAC on both",
            hello.protocol
        ));
    }
    if hello.abi != here.abi_version {
        let (theirs, ours) = (hello.abi, here.abi_version);
        return Err(format!("its block interface (ABI) has version {theirs}, but this side's has version {ours}; install the same OpenGPAC on both"));
    }
    if hello.little_endian != cfg!(target_endian = "little") {
        return Err(format!("it is a {} and this side a {TARGET}, whose byte order differs, so that values could not be read", hello.target));
    }
    if hello.name == here.name {
        return Err(format!("the host that listens is also named '{}'; give this one another name", here.name));
    }
    let now_ns = core.time.steady_ns();
    let replaced = core.peers().admit(KnownPeer::new(hello.id, hello.name.clone(), hello.target.clone(), now_ns), now_ns)?;
    if let Some(replaced) = replaced {
        core.slots.each(|served| served.lose(replaced));
    }
    Ok(())
}
