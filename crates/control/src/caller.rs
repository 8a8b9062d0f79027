// SPDX-License-Identifier: Apache-2.0
//! Caller of a request, its address and its role: tokens, client certificates, the user of a Unix socket; the host and origin of a request.
use crate::failure::Failure;
use crate::tokens::{Rejected, RunToken, Tokens, digest, now_s};
use api::Role;
use axum::http::{HeaderMap, StatusCode, header};
use model::refusal::Class;
use std::net::{IpAddr, SocketAddr};

/// The other end of a connection.
#[derive(Clone, Debug)]
pub enum Peer {
    /// A Unix socket, with the user of the process there.
    Unix {
        uid: u32,
    },
    Tcp {
        from: SocketAddr,
    },
    /// `certificate`: SHA-256 of the client certificate's DER, which our authority has signed.
    Tls {
        from: SocketAddr,
        certificate: Option<[u8; 32]>,
    },
}

impl Peer {
    /// Returns the machine at the other end.
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
    /// `user 1000`, `token panel`, `certificate panel`, `studio` (the token of this run), `anybody`.
    pub who: String,
    pub role: Role,
    pub from: String,
}

/// Credential by which a caller was let in, so that it can be looked at again.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Pass {
    /// Credential that lasts as long as the daemon: the user of a Unix socket, the token of this run, any caller if authentication is off.
    Lasting,
    /// SHA-256 of a token.
    Token([u8; 32]),
    /// SHA-256 of a client certificate.
    Certificate([u8; 32]),
}

/// Gate that lets callers in.
pub struct Gate {
    pub tokens: Option<Tokens>,
    /// The token that was made for this run.
    pub run: Option<RunToken>,
    /// The user that the daemon runs as.
    pub uid: u32,
    /// Callers without a token may observe from loopback.
    pub insecure_loopback: bool,
    /// Names that a `Host` may have, besides addresses and `localhost`.
    pub hosts: Vec<String>,
    /// Pages that may call; a browser names them.
    pub origins: Vec<String>,
}

impl Gate {
    /// Returns the caller of a request, or why it is not admitted.
    pub fn admit(&self, peer: &Peer, headers: &HeaderMap) -> Result<Caller, Failure> {
        Ok(self.let_in(peer, headers)?.0)
    }

    /// Returns the caller, and the credential by which it was let in.
    pub fn let_in(&self, peer: &Peer, headers: &HeaderMap) -> Result<(Caller, Pass), Failure> {
        self.check_site(peer, headers)?;
        let from = match peer {
            Peer::Unix { .. } => "unix".to_owned(),
            Peer::Tcp { from } | Peer::Tls { from, .. } => from.to_string(),
        };
        if let Some(token) = bearer(headers)? {
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
                Err(Failure::new(Class::NotAllowed, "there is no token", "send the header 'Authorization: Bearer TOKEN'").status(StatusCode::UNAUTHORIZED))
            }
        }
    }

    /// Looks again at a caller that was let in: its token or certificate still holds, and gives it the same role. What lasts longer than
    /// a request looks each second.
    pub fn look_again(&self, caller: &Caller, pass: &Pass) -> Result<(), Failure> {
        let now = match pass {
            Pass::Lasting => return Ok(()),
            Pass::Token(sha256) => self.of_token(*sha256, String::new())?,
            Pass::Certificate(sha256) => self.of_certificate(*sha256, String::new())?,
        };
        if (&now.who, now.role) == (&caller.who, caller.role) {
            return Ok(());
        }
        let message = format!("{} has the role {} no longer", caller.who, caller.role.word());
        Err(Failure::new(Class::NotAllowed, message, "connect again").status(StatusCode::UNAUTHORIZED))
    }

    fn of_token(&self, sha256: [u8; 32], from: String) -> Result<Caller, Failure> {
        let tokens = self.tokens.as_ref().ok_or_else(|| rejected(Rejected::Wrong))?;
        let entry = tokens.verify_digest(sha256, now_s()).map_err(rejected)?;
        Ok(Caller { who: format!("token {}", entry.name), role: entry.role, from })
    }

    /// Refuses a request that a page of another site makes, for any caller. The studio's files, which are public, need no more.
    pub fn check_site(&self, peer: &Peer, headers: &HeaderMap) -> Result<(), Failure> {
        self.check_host(headers)?;
        self.check_origin(peer, headers)
    }

    /// Returns the caller of a certificate; one that is signed but not listed may observe.
    fn of_certificate(&self, sha256: [u8; 32], from: String) -> Result<Caller, Failure> {
        let known = self.tokens.as_ref().map_or(Err(Rejected::Wrong), |tokens| tokens.verify_certificate(sha256, now_s()));
        match known {
            Ok(entry) => Ok(Caller { who: format!("certificate {}", entry.name), role: entry.role, from }),
            Err(Rejected::Wrong) => Ok(Caller { who: format!("certificate {}", &crate::requests::hex(&sha256)[..16]), role: Role::Observe, from }),
            Err(other) => Err(rejected(other)),
        }
    }

    /// Checks the host: a page of another site can make its own name mean our address, not the `Host` that its browser then sends.
    fn check_host(&self, headers: &HeaderMap) -> Result<(), Failure> {
        let host = headers.get(header::HOST).and_then(|host| host.to_str().ok()).unwrap_or("");
        let name = name_of(host);
        let ours = name == "localhost" || name.parse::<IpAddr>().is_ok() || self.hosts.iter().any(|known| known.eq_ignore_ascii_case(name));
        if ours && headers.get_all(header::HOST).iter().count() == 1 {
            return Ok(());
        }
        Err(Failure::new(Class::NotAllowed, format!("the host '{host}' is not ours"), format!("start the daemon with --host {name}")))
    }

    /// Checks the origin: no page of a browser calls, unless it is named at the start or came from the very address that it calls. That its host is
    /// ours
    /// was looked at before.
    fn check_origin(&self, peer: &Peer, headers: &HeaderMap) -> Result<(), Failure> {
        let Some(origin) = headers.get(header::ORIGIN) else { return Ok(()) };
        let origin = origin.to_str().unwrap_or("?");
        let host = headers.get(header::HOST).and_then(|host| host.to_str().ok()).unwrap_or("");
        let own = match peer {
            Peer::Unix { .. } => None,
            Peer::Tcp { .. } => Some(format!("http://{host}")),
            Peer::Tls { .. } => Some(format!("https://{host}")),
        };
        let only = headers.get_all(header::ORIGIN).iter().count() == 1;
        if only && own.is_some_and(|own| own.eq_ignore_ascii_case(origin)) {
            return Ok(());
        }
        if self.origins.iter().any(|known| known == origin) {
            return Ok(());
        }
        Err(Failure::new(Class::NotAllowed, format!("pages of '{origin}' may not call"), format!("start the daemon with --origin {origin}")))
    }
}

/// Returns the name of a `Host`, without its port and brackets.
fn name_of(host: &str) -> &str {
    if let Some(rest) = host.strip_prefix('[') {
        return rest.split(']').next().unwrap_or("");
    }
    host.rsplit_once(':').map_or(host, |(name, _)| name)
}

/// Returns the token of a request. What is there and cannot be read is a wrong one.
fn bearer(headers: &HeaderMap) -> Result<Option<&str>, Failure> {
    let Some(given) = headers.get(header::AUTHORIZATION) else { return of_protocols(headers) };
    let token = given.to_str().ok().and_then(|text| text.strip_prefix("Bearer ")).map(str::trim);
    token.filter(|token| !token.is_empty()).map(Some).ok_or_else(|| rejected(Rejected::Wrong))
}

/// Returns the token among the subprotocols of a WebSocket, `bearer.TOKEN`: a browser sends no other header of ours with one. A request that
/// opens no WebSocket has none there.
fn of_protocols(headers: &HeaderMap) -> Result<Option<&str>, Failure> {
    let opens = headers.get(header::UPGRADE).is_some_and(|to| to.as_bytes().eq_ignore_ascii_case(b"websocket"));
    if !opens {
        return Ok(None);
    }
    let mut tokens = Vec::new();
    for named in headers.get_all(header::SEC_WEBSOCKET_PROTOCOL).iter() {
        let named = named.to_str().map_err(|_| rejected(Rejected::Wrong))?;
        tokens.extend(named.split(',').filter_map(|name| name.trim().strip_prefix("bearer.")));
    }
    match tokens[..] {
        [] => Ok(None),
        [token] if !token.is_empty() => Ok(Some(token)),
        _ => Err(rejected(Rejected::Wrong)),
    }
}

fn rejected(why: Rejected) -> Failure {
    let (message, remedy) = match why {
        Rejected::Wrong => ("the token is wrong", "ask the operator of the system for one: opengpac token new"),
        Rejected::Expired => ("the token has expired", "ask for a new one: opengpac token new"),
        Rejected::Revoked => ("the token was revoked", "ask for a new one: opengpac token new"),
    };
    Failure::new(Class::NotAllowed, message, remedy).status(StatusCode::UNAUTHORIZED)
}
