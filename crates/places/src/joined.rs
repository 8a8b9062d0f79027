// SPDX-License-Identifier: Apache-2.0
//! Joined hosts, on which processors are to run, and the life cycle of a process that lends its host.
//!
//! The listening host announces the link of each new processor to the joined host over link 0; a thread of the joined host serves it. All
//! processors of a joined host are threads of one process.
use crate::telling::Telling;
use crate::text;
use hosts::{Hosts, Options, Security};
use interconnect::{Ends, Link};
use modules::Probe;
use process_kit::run_folder;
use rtp::{ProcessorProcess, Reaches, Service, StartedProcessor, Terms};
use serde::Deserialize;
use shared_memory::SharedMemory;
use std::collections::HashMap;
use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, mpsc};
use std::time::Duration;

/// Maximum time for which a processor waits for its host to join.
const JOINED_MAX: Duration = Duration::from_secs(15);

/// Maximum silence of a processor on another host; its link is closed earlier if its host disconnects.
const SILENCE: Duration = Duration::from_secs(6);

/// Link that announces new processors to a joined host.
const CONTROL: u64 = 0;

/// Options with which a host listens or joins.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JoinOptions {
    /// `tcp/HOST:PORT` or `tls/HOST:PORT`.
    pub endpoint: String,
    /// Name of the host.
    pub name: String,
    /// PEM files for TLS.
    #[serde(default)]
    pub authority: Option<PathBuf>,
    #[serde(default)]
    pub certificate: Option<PathBuf>,
    #[serde(default)]
    pub key: Option<PathBuf>,
    /// Secret shared by both sides: over TLS it replaces the joining side's certificate; on loopback, it is the common secret of all
    /// programs of a user.
    #[serde(default)]
    pub token: Option<String>,
    /// Maximum difference between the hosts' clocks, ns.
    #[serde(default)]
    pub clock_limit_ns: Option<i64>,
}

impl JoinOptions {
    /// Returns the options of the link. Fails with a message if this user has no secret for programs of this host.
    fn options(self, system: &str, telling: Option<&Telling>) -> Result<Options, String> {
        let pair = self.certificate.clone().zip(self.key.clone());
        let is_plain = self.endpoint.starts_with("tcp/");
        let security = match (self.token, self.authority, pair) {
            // Other users of this host can reach the address too: a joining process needs a secret that only this user can read, or an
            // explicit one.
            (Some(secret), None, None) if is_plain => Security::Loopback { secret },
            (None, None, None) if is_plain => Security::Loopback { secret: hosts::secret_of_user(&run_folder().map_err(text)?).map_err(text)? },
            (Some(token), authority, certificate) => Security::Token { token, authority, certificate },
            (None, Some(authority), Some((certificate, key))) => Security::Certificates { authority, certificate, key },
            _ => Security::Loopback { secret: String::new() },
        };
        let join_max = JOINED_MAX;
        let mut options = Options {
            security,
            abi_version: opengpac::abi::ABI,
            clock_limit_ns: self.clock_limit_ns,
            join_max,
            ..Options::new(system, &self.name, &self.endpoint)
        };
        if let Some(telling) = telling.cloned() {
            options.clock_watch = Some(Arc::new(move |report| {
                let (worst_us, limit_us) = (report.offset.worst_ns() as f64 * 1e-3, report.limit_ns as f64 * 1e-3);
                let how = if report.beyond { "more than" } else { "within" };
                telling.tell("clock_offset", &report.host, format!("its clock is {worst_us:.0} us off, {how} the limit of {limit_us:.0} us"));
            }));
        }
        Ok(options)
    }
}

/// Hosts that have joined a system.
#[derive(Default)]
pub(crate) struct JoinedHosts {
    telling: Telling,
    listening: Mutex<Option<Listening>>,
}

struct Listening {
    hosts: Hosts,
    last_link: u64,
    controls: HashMap<String, Arc<dyn Link>>,
}

impl JoinedHosts {
    pub fn new(telling: Telling) -> JoinedHosts {
        JoinedHosts { telling, listening: Mutex::default() }
    }

    /// Allows other hosts to join. Fails with a message that includes the remedy.
    pub fn listen(&self, system: &str, options: &str, epoch_ns: i64) -> Result<(), String> {
        let mut listening = self.listening.lock().expect("nobody panics with the lock held");
        if listening.is_some() {
            return Err(format!("system '{system}' is already listening"));
        }
        let options: JoinOptions = serde_json::from_str(options).map_err(|why| format!("a host cannot listen with these options: {why}"))?;
        let hosts = Hosts::listen(options.options(system, Some(&self.telling))?).map_err(text)?;
        hosts.set_epoch(epoch_ns);
        *listening = Some(Listening { hosts, last_link: CONTROL, controls: HashMap::new() });
        Ok(())
    }

    /// Disconnects the joined hosts.
    pub fn close(&self) {
        drop(self.listening.lock().expect("nobody panics with the lock held").take());
    }

    pub fn start(&self, system: &str, host: &str, processor: &str) -> Result<StartedProcessor, String> {
        let hosts = {
            let listening = self.listening.lock().expect("nobody panics with the lock held");
            let Some(listening) = listening.as_ref() else { return Err(format!("system '{system}' does not listen for hosts: call listen() first")) };
            listening.hosts.clone()
        };
        if !hosts.wait_for(host, JOINED_MAX) {
            let seconds = JOINED_MAX.as_secs();
            return Err(format!(
                "host '{host}' did not join system '{system}' within {seconds} s; start `opengpac join --system {system} --name {host} --at …` there"
            ));
        }
        let mut listening = self.listening.lock().expect("nobody panics with the lock held");
        let Some(listening) = listening.as_mut() else { return Err(format!("system '{system}' is closed")) };
        listening.last_link += 1;
        let number = listening.last_link;
        let link: Arc<dyn Link> = hosts.link(host, number).map_err(|why| why.message)?.into();
        let call = |control: &Arc<dyn Link>| control.send(&number.to_le_bytes());
        let known = listening.controls.get(host).is_some_and(|control| call(control).is_ok());
        if !known {
            // First processor of the host, or the first since it returned.
            listening.controls.remove(host);
            let control: Arc<dyn Link> = hosts.link(host, CONTROL).map_err(|why| why.message)?.into();
            call(&control).map_err(|_| format!("host '{host}' does not accept processor '{processor}'"))?;
            listening.controls.insert(host.to_owned(), control);
        }
        let running = Arc::new(LentProcessor { host: host.to_owned() });
        Ok(StartedProcessor { link, near: Box::new(hosts) as Box<dyn Ends>, running, silence: SILENCE, is_adopted: false })
    }
}

/// A processor on a lent host.
struct LentProcessor {
    host: String,
}

impl ProcessorProcess for LentProcessor {
    fn cause(&self) -> String {
        format!("or host '{}' is gone, or the network connection to it is interrupted", self.host)
    }

    fn end(&self) {}
}

/// Poll period for `stop`.
const LOOK: Duration = Duration::from_millis(200);

/// Joins; returns `None` if `stop` returned true before an answer arrived.
fn let_in(options: Options, stop: &dyn Fn() -> bool) -> Result<Option<Hosts>, String> {
    let (tell, told) = mpsc::channel();
    // If nobody waits for it any longer, the process exits.
    let knocking = move || drop(tell.send(Hosts::join(options)));
    std::thread::Builder::new().name("joins".into()).spawn(knocking).map_err(text)?;
    loop {
        match told.recv_timeout(LOOK) {
            Ok(joined) => return joined.map(Some).map_err(text),
            Err(mpsc::RecvTimeoutError::Timeout) if stop() => return Ok(None),
            Err(mpsc::RecvTimeoutError::Timeout) => {}
            Err(mpsc::RecvTimeoutError::Disconnected) => return Err("the thread that joins has panicked".to_owned()),
        }
    }
}

/// Lends this host to a system: serves its processors until the system disconnects, or `stop` returns true (polled a few times per
/// second).
///
/// # Errors
/// Fails with a message if no system listens there, or this host is not admitted.
pub fn join(system: &str, options: JoinOptions, python: OsString, stop: &dyn Fn() -> bool) -> Result<(), String> {
    let name = options.name.clone();
    let Some(hosts) = let_in(options.options(system, None)?, stop)? else { return Ok(()) };
    let listener = hosts.peers().first().map(|peer| peer.name.clone()).ok_or("the listening host is gone")?;
    let control = hosts.link(&listener, CONTROL).map_err(|why| why.message)?;
    let run = shared_memory::new_run();
    let mut serving = Vec::new();
    while !stop() {
        match control.receive(LOOK) {
            Ok(None) => {}
            Err(_) => break,
            Ok(Some(frame)) => {
                let number = u64::from_le_bytes(frame.try_into().map_err(|_| "this is not the number of a link".to_owned())?);
                let link: Arc<dyn Link> = hosts.link(&listener, number).map_err(|why| why.message)?.into();
                let shared = SharedMemory::new(&format!("{system}-{name}"), run).map_err(text)?;
                let closing = link.clone();
                let (clocks, probe) = (hosts.clone(), Probe::python(python.clone()));
                let reaches = Reaches { host: Some(Box::new(shared) as Box<dyn Ends>), network: Some(Box::new(hosts.clone()) as Box<dyn Ends>) };
                let epoch = move |listener_ns: i64| {
                    let epoch_ns = clocks.here_ns(listener_ns);
                    clocks.set_epoch(epoch_ns);
                    epoch_ns
                };
                let service = Service { reaches, ..Service::new(Terms { epoch: Arc::new(epoch), ..Terms::new(probe) }) };
                let served = std::thread::Builder::new().name("processor".into()).spawn(move || rtp::serve(&link, service)).map_err(text)?;
                serving.push((number, closing, served));
            }
        }
    }
    control.close();
    serving.iter().for_each(|(_, link, _)| link.close());
    for (number, _, served) in serving {
        match served.join() {
            Ok(Ok(())) => {}
            Ok(Err(why)) => eprintln!("processor of link {number}: {why}"),
            Err(_) => eprintln!("processor of link {number} panicked"),
        }
    }
    Ok(())
}
