// SPDX-License-Identifier: Apache-2.0
//! Caller of a request, with its address and role, identified by a token, a client certificate, or the user of a Unix socket.
use crate::failure::{Failure, Ground};
use crate::tokens::{RunToken, TokenRejection, Tokens, digest, now_s};
use api::Role;
use model::refusal::Class;
use std::net::SocketAddr;

/// Other end of a connection.
#[derive(Clone, Debug)]
pub enum Peer {
    /// A Unix socket, with the user of the peer process.
    Unix {
        uid: u32,
    },
    Tcp {
        from: SocketAddr,
    },
    /// TLS. `certificate` is the SHA-256 digest of the DER encoding of the client certificate, which is signed by the daemon's
    /// certificate authority.
    Tls {
        from: SocketAddr,
        certificate: Option<[u8; 32]>,
    },
}

impl Peer {
    /// Returns the address of the peer machine.
    pub fn address(&self) -> String {
        match self {
            Peer::Unix { .. } => "unix".to_owned(),
            Peer::Tcp { from } | Peer::Tls { from, .. } => from.ip().to_string(),
        }
    }
}

/// Caller of a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Caller {
    /// Name of the caller: `user 1000`, `token panel`, `certificate panel`, `studio` (the token of this run), or `anybody`.
    pub who: String,
    pub role: Role,
    pub from: String,
}

/// Credential with which a caller was authenticated, kept so that it can be rechecked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Pass {
    /// Credential that is valid as long as the daemon runs: the user of a Unix socket, the token of this run, or none if authentication
    /// is off.
    Lasting,
    /// SHA-256 digest of a token.
    Token([u8; 32]),
    /// SHA-256 digest of a client certificate.
    Certificate([u8; 32]),
}

/// Gate that authenticates callers.
pub struct Gate {
    pub tokens: Option<Tokens>,
    /// Token generated for this run.
    pub run: Option<RunToken>,
    /// User as which the daemon runs.
    pub uid: u32,
    /// True if callers without a token may observe from loopback.
    pub insecure_loopback: bool,
}

impl Gate {
    /// Authenticates the caller of a request: by the token or, if there is none, by the user or client certificate of the connection.
    /// Returns the caller and the credential used; fails if the caller is not admitted.
    pub fn let_in(&self, peer: &Peer, token: Option<&str>) -> Result<(Caller, Pass), Failure> {
        let from = match peer {
            Peer::Unix { .. } => "unix".to_owned(),
            Peer::Tcp { from } | Peer::Tls { from, .. } => from.to_string(),
        };
        if let Some(token) = token {
            if let Some(run) = self.run.as_ref().filter(|run| run.is(token)) {
                return Ok((Caller { who: "studio".to_owned(), role: run.role, from }, Pass::Lasting));
            }
            let sha256 = digest(token);
            return Ok((self.of_token(sha256, from)?, Pass::Token(sha256)));
        }
        match peer {
            Peer::Unix { uid } if *uid == self.uid || *uid == 0 => Ok((Caller { who: format!("user {uid}"), role: Role::Download, from }, Pass::Lasting)),
            Peer::Unix { uid } => Err(Failure::new(Class::NotAllowed, format!("user {uid} may not use this socket"), "give a token")),
            Peer::Tls { certificate: Some(sha256), .. } => Ok((self.of_certificate(*sha256, from)?, Pass::Certificate(*sha256))),
            Peer::Tcp { from: address } if self.insecure_loopback && address.ip().is_loopback() => {
                Ok((Caller { who: "anybody".to_owned(), role: Role::Observe, from }, Pass::Lasting))
            }
            Peer::Tcp { .. } | Peer::Tls { .. } => {
                Err(Failure::new(Class::NotAllowed, "there is no token", "send the header 'Authorization: Bearer TOKEN'").ground(Ground::UnknownCaller))
            }
        }
    }

    /// Rechecks an authenticated caller: its token or certificate must still be valid and must still have the same role. Anything that
    /// lasts longer than a request is rechecked every second.
    pub fn look_again(&self, caller: &Caller, pass: &Pass) -> Result<(), Failure> {
        let now = match pass {
            Pass::Lasting => return Ok(()),
            Pass::Token(sha256) => self.of_token(*sha256, String::new())?,
            Pass::Certificate(sha256) => self.of_certificate(*sha256, String::new())?,
        };
        if (&now.who, now.role) == (&caller.who, caller.role) {
            return Ok(());
        }
        let message = format!("{} no longer has the role {}", caller.who, caller.role.word());
        Err(Failure::new(Class::NotAllowed, message, "connect again").ground(Ground::UnknownCaller))
    }

    fn of_token(&self, sha256: [u8; 32], from: String) -> Result<Caller, Failure> {
        let tokens = self.tokens.as_ref().ok_or_else(|| Failure::from(TokenRejection::Wrong))?;
        let entry = tokens.verify_digest(sha256, now_s()).map_err(Failure::from)?;
        Ok(Caller { who: format!("token {}", entry.name), role: entry.role, from })
    }

    /// Returns the caller identified by a certificate; the holder of a certificate that is signed but not listed may observe.
    fn of_certificate(&self, sha256: [u8; 32], from: String) -> Result<Caller, Failure> {
        let known = self.tokens.as_ref().map_or(Err(TokenRejection::Wrong), |tokens| tokens.verify_certificate(sha256, now_s()));
        match known {
            Ok(entry) => Ok(Caller { who: format!("certificate {}", entry.name), role: entry.role, from }),
            Err(TokenRejection::Wrong) => Ok(Caller { who: format!("certificate {}", &crate::requests::hex(&sha256)[..16]), role: Role::Observe, from }),
            Err(other) => Err(other.into()),
        }
    }
}

impl From<TokenRejection> for Failure {
    fn from(why: TokenRejection) -> Failure {
        let (message, remedy) = match why {
            TokenRejection::Wrong => ("the token is wrong", "ask the operator of the system for one: opengpac token new"),
            TokenRejection::Expired => ("the token has expired", "ask for a new one: opengpac token new"),
            TokenRejection::Revoked => ("the token was revoked", "ask for a new one: opengpac token new"),
        };
        Failure::new(Class::NotAllowed, message, remedy).ground(Ground::UnknownCaller)
    }
}
