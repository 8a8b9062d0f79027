// SPDX-License-Identifier: Apache-2.0
//! Serves a system. All options are checked before any listener is opened; then dedicated threads answer the requests.
use crate::door::Door;
use crate::listen::{self, Listener};
use crate::page::Page;
use crate::site::Site;
use crate::slots::Doors;
use crate::socket;
use crate::tls::Tls;
use api::Role;
use daemon::Audit;
use daemon::Gate;
use daemon::Rates;
use daemon::Service;
use daemon::Sessions;
use daemon::clock::{Looks, now};
use daemon::files::Files;
use daemon::journal::Journal;
use daemon::lanes::{Lanes, Runtimes};
use daemon::requests::is_sha256;
use daemon::tokens::{RunToken, Tokens};
use daemon::{NoWatcher, Watcher, play};
use model::refusal::{Class, Refusal, Refusals};
use serde::Deserialize;
use std::io::ErrorKind;
use std::net::{SocketAddr, ToSocketAddrs};
use std::os::unix::net::UnixListener;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use supervisor::System;

/// Options of a server of the control interface.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Path of the Unix socket, instead of [`socket::default_path`].
    pub socket: Option<PathBuf>,
    /// Disables the Unix socket, and the audit file unless its path is set. Intended for a system within a program that only serves a
    /// studio.
    pub no_socket: bool,
    /// TCP address, `HOST:PORT`, to listen on in addition to the socket.
    pub listen: Option<String>,
    pub tls_cert: Option<PathBuf>,
    pub tls_key: Option<PathBuf>,
    /// Certificate authority that signs client certificates.
    pub client_ca: Option<PathBuf>,
    pub tokens: Option<PathBuf>,
    /// Role of a token that is created for this run. The token is part of [`Server::studio`].
    pub run_token: Option<Role>,
    /// Folder of the studio's page, served at `/` over TCP.
    pub page: Option<PathBuf>,
    /// Path of the audit file; default: a file next to the socket.
    pub audit: Option<PathBuf>,
    /// Allows every program on this machine to observe over TCP without a token.
    pub insecure_loopback: bool,
    /// Accepted host names in the `Host` header.
    pub hosts: Vec<String>,
    /// Origins of pages that may make calls.
    pub origins: Vec<String>,
    /// Python interpreter used to test code modules; default `python3`.
    pub python: Option<String>,
    /// Journal file, which contains the calls that configured the system. They are replayed at startup.
    pub journal: Option<PathBuf>,
    /// Folder in which callers may store recordings.
    pub records: Option<PathBuf>,
    /// SHA-256 digests of the code modules in recordings that are allowed to run.
    pub trust: Vec<String>,
    /// Aborts startup if a call of the journal fails.
    pub journal_strict: bool,
}

/// Period at which sessions are checked.
const LOOK: Duration = Duration::from_millis(100);
/// Number of session checks between two checks of the callers' access, and between two log entries about connections that gave way.
const LOOKS_A_SECOND: u64 = 10;
const TOLD_EVERY: u64 = 100;

/// Server of a system.
pub struct Server {
    runtimes: Option<Runtimes>,
    door: Door,
    addresses: Vec<String>,
    socket: Option<PathBuf>,
    studio: Option<String>,
    tls: Option<Arc<Tls>>,
}

fn refuse(message: impl Into<String>, remedy: &str) -> Refusals {
    vec![Refusal::new(Class::DefinitionError, message).remedy(remedy)]
}

/// TCP address, with its TLS configuration if TLS is used there.
type Tcp = (SocketAddr, Option<Arc<Tls>>);

/// Returns the TCP listener's address after checking the requirements for non-loopback addresses.
fn tcp(options: &Options) -> Result<Option<Tcp>, Refusals> {
    let Some(listen) = &options.listen else {
        let alone = [("--tls-cert", options.tls_cert.is_some()), ("--tls-key", options.tls_key.is_some()), ("--client-ca", options.client_ca.is_some())];
        return match alone.iter().find(|(_, given)| *given) {
            Some((word, _)) => Err(refuse(format!("{word} is given but nothing listens on TCP"), "add --listen HOST:PORT")),
            None => Ok(None),
        };
    };
    let failed = |why: &dyn std::fmt::Display| refuse(format!("cannot listen on '{listen}': {why}"), "write --listen HOST:PORT, for example 127.0.0.1:8777");
    let address = listen.to_socket_addrs().map_err(|why| failed(&why))?.next().ok_or_else(|| failed(&"no such address"))?;
    let knows_callers = options.tokens.is_some() || options.client_ca.is_some() || options.run_token.is_some();
    if !address.ip().is_loopback() {
        if options.insecure_loopback {
            return Err(refuse(format!("--insecure-loopback cannot be used with '{listen}'"), "leave it out: it is only for addresses of this machine"));
        }
        if options.tls_cert.is_none() || options.tls_key.is_none() {
            return Err(refuse(
                format!("'{listen}' can be reached from other machines but has no TLS"),
                "give --tls-cert and --tls-key, or listen on 127.0.0.1",
            ));
        }
        if !knows_callers {
            return Err(refuse(
                format!("'{listen}' can be reached from other machines but has no authentication"),
                "give --tokens (opengpac token new), or --client-ca",
            ));
        }
    } else if !knows_callers && !options.insecure_loopback {
        return Err(refuse(
            format!("'{listen}' can be reached by every user of this machine but has no authentication"),
            "give --tokens (opengpac token new), or --insecure-loopback to let every user observe",
        ));
    }
    let tls = match (&options.tls_cert, &options.tls_key) {
        (Some(certificate), Some(key)) => Some(Arc::new(Tls::open(certificate, key, options.client_ca.as_deref(), options.tokens.is_none())?)),
        (None, None) if options.client_ca.is_some() => return Err(refuse("client certificates need TLS", "give --tls-cert and --tls-key too")),
        (None, None) => None,
        _ => return Err(refuse("TLS needs a certificate and its key", "give --tls-cert and --tls-key")),
    };
    Ok(Some((address, tls)))
}

/// Returns the name of this machine.
fn host_name() -> Option<String> {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname").ok()?;
    Some(name.trim().to_owned()).filter(|name| !name.is_empty())
}

/// Opens the audit file set in the options, or else the file next to the socket.
fn audit(options: &Options, socket: Option<&Path>) -> Result<Audit, Refusals> {
    let path = options.audit.clone().or_else(|| socket.map(|socket| socket.with_extension("audit.jsonl")));
    let Some(path) = path else { return Ok(Audit::none()) };
    Audit::open(&path).map_err(|why| refuse(format!("cannot open the audit file '{}': {why}", path.display()), "give another with --audit"))
}

pub(crate) fn service(
    system: Arc<System>,
    options: &Options,
    audit: Audit,
    run: Option<RunToken>,
    journal: Option<Journal>,
    lanes: Arc<Lanes>,
) -> Result<Service, Refusals> {
    let tokens =
        options.tokens.as_deref().map(Tokens::open).transpose().map_err(|why| refuse(format!("tokens: {why}"), "create the file with opengpac token new"))?;
    Ok(Service {
        system,
        gate: Gate { tokens, run, uid: socket::uid(), insecure_loopback: options.insecure_loopback },
        sessions: Sessions::default(),
        audit,
        rates: Rates::new(20_000.0, 20_000.0),
        lanes,
        files: Files::new().map_err(|why| refuse(format!("cannot create a folder for files: {why}"), "free up space in the folder of temporary files"))?,
        journal,
        records: options.records.clone(),
        trust: digests(&options.trust)?,
        python: options.python.clone().unwrap_or_else(|| "python3".to_owned()),
    })
}

/// Creates the front end of a service.
pub(crate) fn door(service: Service, options: &Options) -> Result<Door, Refusals> {
    let site = Site { hosts: options.hosts.iter().cloned().chain(host_name()).collect(), origins: options.origins.clone() };
    Ok(Door {
        service: Arc::new(service),
        site: Arc::new(site),
        page: options.page.as_deref().map(Page::load).transpose()?.map(Arc::new),
        failures: Arc::new(Rates::new(10.0, 20.0)),
        slots: Doors::default(),
    })
}

/// Converts digests to the format used for comparison. Fails if one of the texts is not a digest.
fn digests(given: &[String]) -> Result<Vec<String>, Refusals> {
    let digest = |text: &String| {
        let lower = text.to_ascii_lowercase();
        let wrong = || refuse(format!("'{text}' is not a SHA-256 digest"), "give the 64 hexadecimal digits that 'opengpac replay' or sha256sum shows");
        if is_sha256(&lower) { Ok(lower) } else { Err(wrong()) }
    };
    given.iter().map(digest).collect()
}

impl Server {
    /// Serves a system. If any option is refused, no listener is opened.
    pub fn start(system: Arc<System>, options: &Options) -> Result<Server, Refusals> {
        Server::start_watched(system, options, &mut NoWatcher)
    }

    /// Starts as [`start`](Self::start) does, with a watcher that follows the replay of the journal and can abort it. The journal is
    /// replayed before any request is answered.
    pub fn start_watched(system: Arc<System>, options: &Options, watcher: &mut dyn Watcher) -> Result<Server, Refusals> {
        if options.journal_strict && options.journal.is_none() {
            return Err(refuse("--journal-strict is given without a journal", "add --journal FILE"));
        }
        let tcp = tcp(options)?;
        if tcp.is_none() && (options.no_socket || options.page.is_some() || options.run_token.is_some()) {
            return Err(refuse("the studio needs a TCP address", "add --listen 127.0.0.1:8777"));
        }
        if options.no_socket {
            return Server::serve(system, options, None, tcp, watcher);
        }
        let path = options.socket.clone().unwrap_or_else(|| socket::default_path(system.name()));
        let bound = socket::bind(&path, options.socket.is_none())?;
        let served = Server::serve(system, options, Some((bound, &path)), tcp, watcher);
        if served.is_err() {
            // The bound socket is useless now; only the refusal is reported.
            let _gone = std::fs::remove_file(&path);
        }
        served
    }

    fn serve(
        system: Arc<System>,
        options: &Options,
        bound: Option<(UnixListener, &Path)>,
        tcp: Option<Tcp>,
        watcher: &mut dyn Watcher,
    ) -> Result<Server, Refusals> {
        let (journal, told) = options.journal.as_deref().map(|file| Journal::open(file, system.name())).transpose()?.unzip();
        told.into_iter().flatten().for_each(|text| watcher.tell(&text));
        let failed = |why: std::io::Error| refuse(format!("cannot serve: {why}"), "close other programs and try again");
        let (run, token) = options.run_token.map(RunToken::new).transpose().map_err(failed)?.unzip();
        let audit = audit(options, bound.as_ref().map(|(_, path)| *path))?;
        let runtimes = Runtimes::start().map_err(failed)?;
        let runtime = &runtimes.serving;
        let door = door(service(system, options, audit, run, journal, Lanes::new(Some(&runtimes)))?, options)?;
        let service = &door.service;
        if let Some(journal) = &service.journal {
            play(service, journal, options.journal_strict, watcher)?;
        }
        let (mut addresses, mut listeners, mut studio) = (Vec::new(), Vec::new(), None);
        let socket = bound.as_ref().map(|(_, path)| path.to_path_buf());
        if let Some((bound, path)) = bound {
            addresses.push(format!("unix://{}", path.display()));
            listeners.push(Listener::unix(runtime, bound).map_err(failed)?);
        }
        let mut spoken = None;
        if let Some((address, tls)) = tcp {
            let cannot = |why: std::io::Error| {
                let class = if why.kind() == ErrorKind::AddrInUse { Class::InUse } else { Class::DefinitionError };
                vec![Refusal::new(class, format!("cannot listen on '{address}': {why}")).remedy("choose another port, or 0 for any free one")]
            };
            let listener = listen::bound(runtime, address).map_err(cannot)?;
            let scheme = if tls.is_some() { "https" } else { "http" };
            let url = format!("{scheme}://{}", listener.local_addr().map_err(cannot)?);
            let fragment = token.map(|token| format!("#token={token}")).unwrap_or_default();
            studio = door.page.is_some().then(|| format!("{url}/{fragment}"));
            spoken.clone_from(&tls);
            addresses.push(url);
            listeners.push(Listener::Tcp(listener, tls));
        }
        let router = crate::http::router(door.clone());
        for listener in listeners {
            runtime.spawn(listen::accept(listener, router.clone(), door.slots.clone()));
        }
        runtime.spawn(look_after(door.clone()));
        Ok(Server { runtimes: Some(runtimes), door, addresses, socket, studio, tls: spoken })
    }

    /// Reopens the audit file, and reloads the TLS and token files. Returns messages for the operator.
    pub fn reread(&self) -> Vec<String> {
        let audit = self.door.service.audit.reopen().map_err(|why| format!("the previous audit file stays in use: {why}"));
        let told = |refusals: Refusals| refusals.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ");
        let tls = self.tls.as_ref().map_or(Ok(()), |tls| tls.reread()).map_err(|why| format!("the previous TLS files stay in use: {}", told(why)));
        self.door.service.tell_of_tokens();
        let failed: Vec<String> = [audit.err(), tls.err()].into_iter().flatten().collect();
        let news = if failed.is_empty() { vec!["the audit file, the tokens and the TLS files were reopened".to_owned()] } else { failed };
        news.iter().for_each(|text| self.door.service.system.log_control(text));
        news
    }

    /// Returns the addresses of the server: `unix://PATH`, `http://HOST:PORT`, `https://HOST:PORT`.
    pub fn addresses(&self) -> &[String] {
        &self.addresses
    }

    /// Returns the address of the studio's page, followed by `#` and the token of this run if there is one; `None` if the page is not
    /// served.
    pub fn studio(&self) -> Option<&str> {
        self.studio.as_deref()
    }

    /// Returns the router of the interface, for use without a connection. Tests and fuzzers identify the caller by a request extension,
    /// [`daemon::Peer`].
    pub fn router(&self) -> axum::Router {
        crate::http::router(self.door.clone())
    }

    /// Stops answering and removes the socket. Idempotent.
    pub fn stop(&mut self) {
        if let Some(runtimes) = self.runtimes.take() {
            if let Some(socket) = &self.socket {
                // The socket may have been deleted with its folder.
                let _gone = std::fs::remove_file(socket);
            }
            runtimes.end(Duration::from_secs(2));
            if let Some(journal) = &self.door.service.journal {
                journal.end(&self.door.service.system);
            }
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.stop();
    }
}

async fn look_after(door: Door) {
    let mut tick = tokio::time::interval(LOOK);
    tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    let mut regular = Looks::new(LOOK);
    for looks in 0_u64.. {
        tick.tick().await;
        if let Some(late) = regular.look() {
            door.service.stood_still(late, now());
        }
        if looks.is_multiple_of(LOOKS_A_SECOND) {
            door.slots.look_again(&door.service.gate);
        }
        let door = door.clone();
        let looked = tokio::task::spawn_blocking(move || {
            door.service.look_after(now());
            if looks.is_multiple_of(TOLD_EVERY) {
                door.tell_who_gave_way();
                door.service.tell_of_tokens();
            }
        });
        if looked.await.is_err() {
            eprintln!("control: the supervision of sessions failed; please report it");
        }
    }
}
