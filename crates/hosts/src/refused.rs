// SPDX-License-Identifier: Apache-2.0
//! Reasons why a host does not listen, join or make an end.
use std::path::PathBuf;

/// Reason why a host does not take part. Nothing was started.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum JoinError {
    /// The endpoint has no known form.
    #[error("'{endpoint}' is no endpoint; write tcp/HOST:PORT or tls/HOST:PORT")]
    Endpoint {
        /// Endpoint as it was given.
        endpoint: String,
    },
    /// A name that does not fit.
    #[error("'{name}' cannot name a {what}; use letters, digits, '-', '_' and '.', at most 64")]
    Name {
        /// A system or a host.
        what: &'static str,
        /// Name as it was given.
        name: String,
    },
    /// Values and commands would travel for all to read and change.
    #[error("'{endpoint}' can be reached from other hosts, so it needs TLS; use tls/HOST:PORT with certificates or a token, or tcp/127.0.0.1:PORT")]
    PlainOutside {
        /// Endpoint as it was given.
        endpoint: String,
    },
    /// TLS without certificates.
    #[error("'{endpoint}' needs certificates: give authority, certificate and key, or a token with the listening side's certificate")]
    NoCertificates {
        /// Endpoint as it was given.
        endpoint: String,
    },
    /// Certificates that would have no effect.
    #[error("certificates have no effect on '{endpoint}'; write tls/HOST:PORT")]
    CertificatesUnused {
        /// Endpoint as it was given.
        endpoint: String,
    },
    /// A token that could be guessed, or none.
    #[error("the token is too weak; use 16 characters or more, without white space")]
    WeakToken,
    /// A token was given without what it needs besides.
    #[error("a token alone does not do to {purpose}; give {needed} too")]
    TokenAlone {
        /// To listen or to join.
        purpose: &'static str,
        /// Thing that is missing.
        needed: &'static str,
    },
    /// A file that cannot be used.
    #[error("the {what} '{}' cannot be used: {reason}", path.display())]
    File {
        /// Authority, certificate, private key.
        what: &'static str,
        /// Path of the file.
        path: PathBuf,
        /// Reason of the failure.
        reason: String,
    },
    /// The network, or the other side's security, says no.
    #[error("no way to '{endpoint}': {reason}")]
    NoWay {
        /// Endpoint as it was given.
        endpoint: String,
        /// Answer of the other side.
        reason: String,
    },
    /// There was no answer at the endpoint.
    #[error("no system '{system}' answered at '{endpoint}' within {seconds} s; is it running there, under this name?")]
    NoAnswer {
        /// The system.
        system: String,
        /// Endpoint as it was given.
        endpoint: String,
        /// Time for which it was tried, s.
        seconds: u64,
    },
    /// The listening side said no.
    #[error("system '{system}' at '{endpoint}' does not take host '{name}' in: {reason}")]
    ByListener {
        /// The system.
        system: String,
        /// Endpoint as it was given.
        endpoint: String,
        /// Name of this host.
        name: String,
        /// Reason in the listening side's words.
        reason: String,
    },
}
