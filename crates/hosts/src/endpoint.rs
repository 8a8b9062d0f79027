// SPDX-License-Identifier: Apache-2.0
//! Endpoints: `tcp/HOST:PORT` and `tls/HOST:PORT`.
use crate::refused::JoinError;
use std::fmt;
use std::net::{IpAddr, ToSocketAddrs};
use std::str::FromStr;

/// Address at which a host listens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Endpoint {
    pub(crate) scheme: Scheme,
    /// Name or address; an IPv6 address is enclosed in brackets.
    pub(crate) host: String,
    pub(crate) port: u16,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scheme {
    Tcp,
    Tls,
}

impl Endpoint {
    /// Returns true if the peer can only be on this host, because every address to which the name resolves is a loopback address.
    pub(crate) fn is_loopback(&self) -> bool {
        let bare = self.host.trim_start_matches('[').trim_end_matches(']');
        if let Ok(address) = bare.parse::<IpAddr>() {
            return address.is_loopback();
        }
        let addresses: Vec<IpAddr> = (bare, self.port).to_socket_addrs().map(|all| all.map(|address| address.ip()).collect()).unwrap_or_default();
        !addresses.is_empty() && addresses.iter().all(IpAddr::is_loopback)
    }
}

impl FromStr for Endpoint {
    type Err = JoinError;

    fn from_str(text: &str) -> Result<Self, JoinError> {
        let refused = || JoinError::Endpoint { endpoint: text.to_owned() };
        let (scheme, address) = text.split_once('/').ok_or_else(refused)?;
        let scheme = match scheme {
            "tcp" => Scheme::Tcp,
            "tls" => Scheme::Tls,
            _ => return Err(refused()),
        };
        let (host, port) = address.rsplit_once(':').ok_or_else(refused)?;
        let bracketed = host.starts_with('[') && host.ends_with(']');
        // Characters that zenoh would read as an option of the endpoint must not reach it.
        let fits = !host.is_empty() && (bracketed || !host.contains(':')) && !host.contains(['/', '?', '#', ';', '=', ' ']);
        let port = port.parse().ok().filter(|_| fits).ok_or_else(refused)?;
        Ok(Endpoint { scheme, host: host.to_owned(), port })
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scheme = if self.scheme == Scheme::Tcp { "tcp" } else { "tls" };
        write!(f, "{scheme}/{}:{}", self.host, self.port)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_endpoint_is_read_as_it_is_written() {
        for text in ["tcp/127.0.0.1:7447", "tls/cell-b.example.org:1", "tcp/[::1]:0", "tls/[fe80::1]:9"] {
            assert_eq!(text.parse::<Endpoint>().expect(text).to_string(), text);
        }
    }

    #[test]
    fn anything_else_is_refused_with_the_form() {
        for text in ["", "tcp", "tcp/", "tcp/:1", "tcp/host", "udp/host:1", "tcp/host:99999", "tcp/::1:1", "tls/host:1?x=y", "tls/a b:1", "tcp/a#b:1"] {
            let refused = text.parse::<Endpoint>().expect_err(text).to_string();
            assert!(refused.contains("tcp/HOST:PORT"), "{refused}");
        }
    }

    #[test]
    fn only_loopback_addresses_are_loopback() {
        let loopback = |text: &str| text.parse::<Endpoint>().expect(text).is_loopback();
        assert!(loopback("tcp/127.0.0.1:1") && loopback("tcp/127.9.9.9:1") && loopback("tcp/[::1]:1") && loopback("tcp/localhost:1"));
        assert!(!loopback("tcp/0.0.0.0:1") && !loopback("tcp/[::]:1") && !loopback("tcp/10.0.0.1:1"));
        assert!(!loopback("tcp/no-such-host.invalid:1"), "a name that stands for nothing");
    }
}
