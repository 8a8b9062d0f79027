// SPDX-License-Identifier: Apache-2.0
//! Zenoh sessions: one per host. The listening side routes and the joining sides are its clients, so only one host needs an address even
//! if there are three. Multicast and gossip are disabled, so hosts that were not configured are never discovered.
use crate::endpoint::Endpoint;
use crate::options::{Options, Security};
use crate::refused::JoinError;
use crate::threads;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use zenoh::{Config, Session, Wait};

/// Side of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Listens,
    Joins,
}

/// Duration of silence after which a connection is abandoned and replaced, ms.
const LEASE_MS: u32 = 2_000;
/// Time limit for a connection attempt, ms.
const OPEN_MS: u32 = 1_000;
/// User name that all holders of the token share.
const USER: &str = "opengpac";

/// Explanation that is added if a host that joins on loopback is not admitted.
const ANOTHER_SECRET: &str = "; if a system listens there, it belongs to another user: join it with the token with which it listens";

/// Opens a session; a joining side succeeds only if the listening side admits it.
pub(crate) fn open(options: &Options, endpoint: &Endpoint, side: Side) -> Result<Session, JoinError> {
    // The file is deleted when this returns; zenoh has read it by then.
    let dictionary = match (&options.security, side) {
        (Security::Token { token, .. } | Security::Loopback { secret: token }, Side::Listens) => Some(Dictionary::write(token)?),
        _ => None,
    };
    threads::one_for_links();
    let no_way = |reason: String| JoinError::NoWay { endpoint: endpoint.to_string(), reason };
    let mut config = Config::default();
    for (key, value) in settings(options, endpoint, side)? {
        config.insert_json5(&key, &value).map_err(|error| no_way(format!("{key}: {error}")))?;
    }
    if let Some(Dictionary(path)) = &dictionary {
        config.insert_json5("transport/auth/usrpwd/dictionary_file", &text(path)).map_err(|error| no_way(error.to_string()))?;
    }
    let hint = if options.security.secret().is_some() && side == Side::Joins { ANOTHER_SECRET } else { "" };
    zenoh::open(config).wait().map_err(|error| no_way(plain(&error.to_string()) + hint))
}

/// Returns the keys and values of zenoh's configuration.
fn settings(options: &Options, endpoint: &Endpoint, side: Side) -> Result<Vec<(String, String)>, JoinError> {
    let endpoints = format!("[{:?}]", endpoint.to_string());
    let mut settings = match side {
        Side::Listens => vec![("mode", "\"router\"".to_owned()), ("listen/endpoints", endpoints), ("connect/endpoints", "[]".to_owned())],
        Side::Joins => vec![
            ("mode", "\"client\"".to_owned()),
            ("connect/endpoints", endpoints),
            ("connect/timeout_ms", options.join_max.as_millis().to_string()),
            ("connect/retry", r#"{ period_init_ms: 100, period_max_ms: 300, period_increase_factor: 1.5 }"#.to_owned()),
        ],
    };
    settings.extend([
        ("scouting/multicast/enabled", "false".to_owned()),
        ("scouting/gossip/enabled", "false".to_owned()),
        ("timestamping/enabled", "false".to_owned()),
        ("transport/shared_memory/enabled", "false".to_owned()),
        ("transport/unicast/open_timeout", OPEN_MS.to_string()),
        ("transport/unicast/accept_timeout", (2 * OPEN_MS).to_string()),
        ("transport/link/tx/lease", LEASE_MS.to_string()),
        ("transport/link/tx/keep_alive", "4".to_owned()),
        // The queue is bounded and never waited for: packets that do not fit are lost and retransmitted.
        ("transport/link/tx/queue/size/real_time", "4".to_owned()),
        ("transport/link/tx/queue/size/interactive_high", "16".to_owned()),
        ("transport/link/tx/queue/size/data", "16".to_owned()),
        ("transport/link/tx/queue/congestion_control/drop/wait_before_drop", "100".to_owned()),
        ("transport/link/rx/max_message_size", MESSAGE_BYTES_MAX.to_string()),
    ]);
    settings.extend(secrets(&options.security, side)?);
    Ok(settings.into_iter().map(|(key, value)| (key.to_owned(), value)).collect())
}

/// Maximum size of a group, row or frame part, bytes.
const MESSAGE_BYTES_MAX: usize = 1 << 26;

fn secrets(security: &Security, side: Side) -> Result<Vec<(&'static str, String)>, JoinError> {
    const ROOT: &str = "transport/link/tls/root_ca_certificate";
    const LISTEN: [&str; 2] = ["transport/link/tls/listen_certificate", "transport/link/tls/listen_private_key"];
    const CONNECT: [&str; 2] = ["transport/link/tls/connect_certificate", "transport/link/tls/connect_private_key"];
    Ok(match (security, side) {
        (Security::Loopback { .. }, Side::Listens) => Vec::new(),
        (Security::Loopback { secret }, Side::Joins) => shown(secret).into(),
        (Security::Certificates { authority, certificate, key }, side) => {
            let [for_certificate, for_key] = if side == Side::Listens { LISTEN } else { CONNECT };
            vec![
                (ROOT, text(authority)),
                (for_certificate, text(certificate)),
                (for_key, text(key)),
                ("transport/link/tls/enable_mtls", "true".to_owned()),
                ("transport/link/tls/close_link_on_expiration", "true".to_owned()),
            ]
        }
        (Security::Token { certificate, .. }, Side::Listens) => {
            let missing = JoinError::TokenAlone { purpose: "listen", needed: "this host's certificate and its key" };
            let (certificate, key) = certificate.as_ref().ok_or(missing)?;
            vec![(LISTEN[0], text(certificate)), (LISTEN[1], text(key))]
        }
        (Security::Token { token, authority, .. }, Side::Joins) => {
            let authority = authority.as_ref().ok_or(JoinError::TokenAlone { purpose: "join", needed: "the authority of the other side's certificate" })?;
            [(ROOT, text(authority))].into_iter().chain(shown(token)).collect()
        }
    })
}

/// Returns the credentials of the joining side: not the secret itself, but values derived from it and from a number drawn by the
/// listening side.
fn shown(secret: &str) -> [(&'static str, String); 2] {
    [("transport/auth/usrpwd/user", format!("{USER:?}")), ("transport/auth/usrpwd/password", format!("{secret:?}"))]
}

/// Returns a path as a JSON string.
fn text(path: &Path) -> String {
    format!("{:?}", path.to_string_lossy())
}

/// File in which zenoh looks up tokens. It exists only while a session is being opened, and only its owner can read it.
struct Dictionary(PathBuf);

impl Dictionary {
    fn write(token: &str) -> Result<Self, JoinError> {
        use std::os::unix::fs::OpenOptionsExt;
        let path = std::env::temp_dir().join(format!("opengpac-{:016x}", crate::random::number()));
        let refused = |error: std::io::Error| JoinError::File { what: "token file", path: path.clone(), reason: error.to_string() };
        let mut file = std::fs::OpenOptions::new().write(true).create_new(true).mode(0o600).open(&path).map_err(refused)?;
        let written = Dictionary(path.clone());
        writeln!(file, "{USER}:{token}").map_err(refused)?;
        Ok(written)
    }
}

impl Drop for Dictionary {
    fn drop(&mut self) {
        // The file was created here; it does not matter if it has been deleted already.
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Returns a message of the library without the source locations that it adds, ` at FILE.rs:LINE`.
fn plain(words: &str) -> String {
    let mut text = String::new();
    let mut rest = words;
    while let Some(at) = rest.find(" at /") {
        let (before, after) = rest.split_at(at);
        text.push_str(before);
        let end = after.find(".rs:").map_or(after.len(), |found| {
            let digits = after[found + 4..].chars().take_while(char::is_ascii_digit).count();
            found + 4 + digits
        });
        rest = &after[end..];
    }
    text + rest
}
