// SPDX-License-Identifier: Apache-2.0
//! Admission of a request: checks its host, its origin and its token.
use axum::http::{HeaderMap, header};
use daemon::tokens::TokenRejection;
use daemon::{Caller, Failure, Gate, Pass, Peer};
use model::refusal::Class;
use std::net::IpAddr;

/// Hosts and origins from which requests are accepted.
#[derive(Clone, Debug, Default)]
pub struct Site {
    /// Accepted host names in the `Host` header, in addition to addresses and `localhost`.
    pub hosts: Vec<String>,
    /// Origins of pages that may make calls, as browsers send them.
    pub origins: Vec<String>,
}

impl Site {
    /// Authenticates a request. Returns its caller and the credential with which the gate admitted it, or the reason for the rejection.
    pub fn let_in(&self, gate: &Gate, peer: &Peer, headers: &HeaderMap) -> Result<(Caller, Pass), Failure> {
        self.check(peer, headers)?;
        gate.let_in(peer, bearer(headers)?)
    }

    /// Refuses a request made by a page of another origin, for any caller. The studio's files are public and need no further check.
    pub fn check(&self, peer: &Peer, headers: &HeaderMap) -> Result<(), Failure> {
        self.check_host(headers)?;
        self.check_origin(peer, headers)
    }

    /// Checks the host. A page of another origin can make its own name resolve to our address, but cannot change the `Host` header that
    /// its browser then sends.
    fn check_host(&self, headers: &HeaderMap) -> Result<(), Failure> {
        let host = headers.get(header::HOST).and_then(|host| host.to_str().ok()).unwrap_or("");
        let name = name_of(host);
        let ours = name == "localhost" || name.parse::<IpAddr>().is_ok() || self.hosts.iter().any(|known| known.eq_ignore_ascii_case(name));
        if ours && headers.get_all(header::HOST).iter().count() == 1 {
            return Ok(());
        }
        Err(Failure::new(Class::NotAllowed, format!("the host '{host}' is not a name of this daemon"), format!("start the daemon with --host {name}")))
    }

    /// Checks the origin. A page in a browser may make calls only if its origin is listed in the options or it was loaded from the
    /// address that it calls. The host has already been checked.
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
        Err(Failure::new(Class::NotAllowed, format!("pages of '{origin}' may not call this daemon"), format!("start the daemon with --origin {origin}")))
    }
}

/// Returns the name in a `Host` header, without port or brackets.
fn name_of(host: &str) -> &str {
    if let Some(rest) = host.strip_prefix('[') {
        return rest.split(']').next().unwrap_or("");
    }
    host.rsplit_once(':').map_or(host, |(name, _)| name)
}

/// Returns the token of a request. A malformed header counts as a wrong token.
fn bearer(headers: &HeaderMap) -> Result<Option<&str>, Failure> {
    let Some(given) = headers.get(header::AUTHORIZATION) else { return of_protocols(headers) };
    let token = given.to_str().ok().and_then(|text| text.strip_prefix("Bearer ")).map(str::trim);
    token.filter(|token| !token.is_empty()).map(Some).ok_or_else(|| Failure::from(TokenRejection::Wrong))
}

/// Returns the token among the subprotocols of a WebSocket, `bearer.TOKEN`. Browsers send it there, because they cannot send an
/// `Authorization` header when they open a WebSocket. Subprotocols of any other request are ignored.
fn of_protocols(headers: &HeaderMap) -> Result<Option<&str>, Failure> {
    let opens = headers.get(header::UPGRADE).is_some_and(|to| to.as_bytes().eq_ignore_ascii_case(b"websocket"));
    if !opens {
        return Ok(None);
    }
    let mut tokens = Vec::new();
    for named in headers.get_all(header::SEC_WEBSOCKET_PROTOCOL).iter() {
        let named = named.to_str().map_err(|_| Failure::from(TokenRejection::Wrong))?;
        tokens.extend(named.split(',').filter_map(|name| name.trim().strip_prefix("bearer.")));
    }
    match tokens[..] {
        [] => Ok(None),
        [token] if !token.is_empty() => Ok(Some(token)),
        _ => Err(Failure::from(TokenRejection::Wrong)),
    }
}
