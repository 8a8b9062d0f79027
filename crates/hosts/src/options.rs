// SPDX-License-Identifier: Apache-2.0
//! Options of a host that listens or joins.
use crate::agreement::ClockReport;
use crate::endpoint::{Endpoint, Scheme};
use crate::refused::JoinError;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Function that is called when the clocks no longer agree within the limit, and when they agree again.
pub type ClockWatch = Arc<dyn Fn(&ClockReport) + Send + Sync>;

/// Options of a host in a real-time system.
#[derive(Clone)]
pub struct Options {
    /// Name of the real-time system: at most 64 letters, digits, `-`, `_` and `.`.
    pub system: String,
    /// Name of this host, with the same allowed characters as `system`; unique in the system.
    pub name: String,
    /// Endpoint at which the listening host (this one or the other) listens: `tcp/HOST:PORT` or `tls/HOST:PORT`.
    pub endpoint: String,
    /// Security, which determines the hosts that are admitted.
    pub security: Security,
    /// Version of the block interface that this build's code modules use.
    pub abi_version: u32,
    /// Maximum silence of a host before it is considered lost and its links are closed. The default is 5 s.
    pub silent_max: Duration,
    /// Time for which [`Hosts::join`](crate::Hosts::join) tries to connect. The default is 10 s.
    pub join_max: Duration,
    /// Maximum difference between the clocks, ns; `None`, the default, for no limit.
    pub clock_limit_ns: Option<i64>,
    /// Function to call when the limit is crossed, in either direction.
    pub clock_watch: Option<ClockWatch>,
    /// Clocks used by this host.
    pub clocks: Clocks,
}

impl Options {
    /// Creates the options of a host. All have their defaults except the secret, which must be set: without one, no host is admitted.
    pub fn new(system: &str, name: &str, endpoint: &str) -> Self {
        Options {
            system: system.to_owned(),
            name: name.to_owned(),
            endpoint: endpoint.to_owned(),
            security: Security::Loopback { secret: String::new() },
            abi_version: 0,
            silent_max: Duration::from_secs(5),
            join_max: Duration::from_secs(10),
            clock_limit_ns: None,
            clock_watch: None,
            clocks: Clocks::default(),
        }
    }

    /// Checks that these options are permitted for their endpoint, and returns the endpoint.
    pub(crate) fn check(&self) -> Result<Endpoint, JoinError> {
        for (what, name) in [("system", &self.system), ("host", &self.name)] {
            let fits = !name.is_empty() && name.len() <= 64 && name.chars().all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c));
            if !fits {
                return Err(JoinError::Name { what, name: name.clone() });
            }
        }
        let endpoint: Endpoint = self.endpoint.parse()?;
        self.security.check(&endpoint)?;
        Ok(endpoint)
    }
}

/// Security, which determines the hosts that are admitted. The key file of a certificate must be readable by its owner only.
#[derive(Clone)]
pub enum Security {
    /// Admits programs on this host that have a secret. The secret is never transmitted: each side proves that it has it. Permitted only
    /// for loopback addresses, `tcp/127.0.0.1:PORT`, because other users of this host can also reach them.
    Loopback {
        /// Secret of at least 16 characters without white space; [`secret_of_user`](crate::secret_of_user) provides one for all programs
        /// of a user.
        secret: String,
    },
    /// TLS; each side presents a certificate from an authority that the other accepts.
    Certificates {
        /// PEM file of the certificate authority.
        authority: PathBuf,
        /// PEM file of this host's certificate.
        certificate: PathBuf,
        /// PEM file of the certificate's private key.
        key: PathBuf,
    },
    /// TLS; the listening side presents a certificate, the joining side a token that both sides share.
    Token {
        /// Secret of at least 16 characters without white space.
        token: String,
        /// PEM file of the certificate authority; required to join.
        authority: Option<PathBuf>,
        /// PEM files of the certificate and private key; required to listen.
        certificate: Option<(PathBuf, PathBuf)>,
    },
}

impl Security {
    fn check(&self, endpoint: &Endpoint) -> Result<(), JoinError> {
        let plain = matches!(self, Security::Loopback { .. });
        match endpoint.scheme {
            Scheme::Tcp if !plain => return Err(JoinError::CertificatesUnused { endpoint: endpoint.to_string() }),
            Scheme::Tcp if !endpoint.is_loopback() => return Err(JoinError::PlainOutside { endpoint: endpoint.to_string() }),
            Scheme::Tls if plain => return Err(JoinError::NoCertificates { endpoint: endpoint.to_string() }),
            Scheme::Tcp | Scheme::Tls => {}
        }
        if let Security::Token { token, .. } | Security::Loopback { secret: token } = self
            && (token.len() < 16 || token.contains(char::is_whitespace))
        {
            return Err(JoinError::WeakToken);
        }
        self.files().try_for_each(|(what, path, secret)| check_file(what, path, secret))
    }

    /// Returns the secret that both sides of a plain connection share.
    pub(crate) fn secret(&self) -> Option<&str> {
        match self {
            Security::Loopback { secret } => Some(secret),
            Security::Certificates { .. } | Security::Token { .. } => None,
        }
    }

    /// Returns each file with its purpose, its path, and whether it is secret.
    fn files(&self) -> impl Iterator<Item = (&'static str, &Path, bool)> {
        let (authority, certificate, key) = match self {
            Security::Loopback { .. } => (None, None, None),
            Security::Certificates { authority, certificate, key } => (Some(authority), Some(certificate), Some(key)),
            Security::Token { authority, certificate, .. } => {
                (authority.as_ref(), certificate.as_ref().map(|(certificate, _)| certificate), certificate.as_ref().map(|(_, key)| key))
            }
        };
        let files = [("authority", authority, false), ("certificate", certificate, false), ("private key", key, true)];
        files.into_iter().filter_map(|(what, path, secret)| path.map(|path| (what, path.as_path(), secret)))
    }
}

fn check_file(what: &'static str, path: &Path, secret: bool) -> Result<(), JoinError> {
    use std::os::unix::fs::PermissionsExt;
    let refused = |reason: String| JoinError::File { what, path: path.to_owned(), reason };
    let found = std::fs::metadata(path).map_err(|error| refused(error.to_string()))?;
    if secret && found.permissions().mode() & 0o077 != 0 {
        return Err(refused("others may read it; chmod 600 it".to_owned()));
    }
    Ok(())
}

impl fmt::Debug for Security {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // A secret must not reach a log.
        f.write_str(match self {
            Security::Loopback { .. } => "Loopback",
            Security::Certificates { .. } => "Certificates",
            Security::Token { .. } => "Token",
        })
    }
}

/// A host's clocks, ns. Tests may replace them.
#[derive(Clone)]
pub struct Clocks {
    /// Clock of published times: CLOCK_MONOTONIC.
    pub steady: Arc<dyn Fn() -> i64 + Send + Sync>,
    /// Clock that PTP or NTP synchronises with other hosts: CLOCK_REALTIME.
    pub wall: Arc<dyn Fn() -> i64 + Send + Sync>,
}

impl Default for Clocks {
    fn default() -> Self {
        Clocks { steady: Arc::new(|| clock_ns(libc::CLOCK_MONOTONIC)), wall: Arc::new(|| clock_ns(libc::CLOCK_REALTIME)) }
    }
}

fn clock_ns(clock: libc::clockid_t) -> i64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` is a timespec of our own; both clocks always exist.
    unsafe { libc::clock_gettime(clock, &mut time) };
    time.tv_sec * 1_000_000_000 + time.tv_nsec
}
