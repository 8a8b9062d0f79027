// SPDX-License-Identifier: Apache-2.0
//! Reasons why a host cannot listen, join or create an end.
use std::path::PathBuf;

/// Reason why a host cannot join or listen. Nothing was started.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum JoinError {
    /// The endpoint is malformed.
    #[error("'{endpoint}' is not an endpoint; write tcp/HOST:PORT or tls/HOST:PORT")]
    Endpoint {
        /// Endpoint that was passed.
        endpoint: String,
    },
    /// The name is malformed.
    #[error("'{name}' cannot name a {what}; use letters, digits, '-', '_' and '.', at most 64")]
    Name {
        /// Kind of the name: a system or a host.
        what: &'static str,
        /// Name that was passed.
        name: String,
    },
    /// A plain connection outside loopback was requested, on which anyone could read and change values and commands.
    #[error("'{endpoint}' can be reached from other hosts, so it needs TLS; use tls/HOST:PORT with certificates or a token, or tcp/127.0.0.1:PORT")]
    PlainOutside {
        /// Endpoint that was passed.
        endpoint: String,
    },
    /// TLS was requested without certificates.
    #[error("'{endpoint}' needs certificates: give authority, certificate and key, or a token with the listening side's certificate")]
    NoCertificates {
        /// Endpoint that was passed.
        endpoint: String,
    },
    /// Certificates were passed for an endpoint on which they have no effect.
    #[error("certificates have no effect on '{endpoint}'; write tls/HOST:PORT")]
    CertificatesUnused {
        /// Endpoint that was passed.
        endpoint: String,
    },
    /// The token is empty or too easy to guess.
    #[error("the token is too weak; use 16 characters or more, without white space")]
    WeakToken,
    /// A token was passed without the files that it requires.
    #[error("a token alone is not enough to {purpose}; give {needed} too")]
    TokenAlone {
        /// Purpose: to listen or to join.
        purpose: &'static str,
        /// Missing option.
        needed: &'static str,
    },
    /// A file cannot be used.
    #[error("the {what} '{}' cannot be used: {reason}", path.display())]
    File {
        /// Kind of the file: authority, certificate, or private key.
        what: &'static str,
        /// Path of the file.
        path: PathBuf,
        /// Reason why it cannot be used.
        reason: String,
    },
    /// The network or the security settings of the other side refuse the connection.
    #[error("cannot connect to '{endpoint}': {reason}")]
    NoWay {
        /// Endpoint that was passed.
        endpoint: String,
        /// Answer of the other side.
        reason: String,
    },
    /// No answer from the endpoint.
    #[error("no system '{system}' answered at '{endpoint}' within {seconds} s; check that it is running there under this name")]
    NoAnswer {
        /// Name of the system.
        system: String,
        /// Endpoint that was passed.
        endpoint: String,
        /// Duration of the attempt, s.
        seconds: u64,
    },
    /// The listening side refuses this host.
    #[error("system '{system}' at '{endpoint}' does not admit host '{name}': {reason}")]
    ByListener {
        /// Name of the system.
        system: String,
        /// Endpoint that was passed.
        endpoint: String,
        /// Name of this host.
        name: String,
        /// Reason given by the listening side.
        reason: String,
    },
}
