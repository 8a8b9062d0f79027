// SPDX-License-Identifier: Apache-2.0
//! Shared code of the tests of hosts: addresses, certificates, and waits for real-time events.
#![allow(dead_code, reason = "each test uses its part")]
mod authority;
pub use authority::Authority;
use hosts::{Hosts, Options, Security};
use interconnect::{ConnectionSpec, Header, Receiver, Sender};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU16, Ordering};
use std::time::{Duration, Instant};

/// Far longer than any operation here: reaching it is a failure.
pub const LONG: Duration = Duration::from_secs(300);

pub const SPEC: ConnectionSpec = ConnectionSpec { writer: 0, reader: 1, asynchronous_len: 16, queue_row_len: 16, queue_depth: 4 };

/// Secret of the test hosts.
pub const SECRET: &str = "the-secret-of-the-tests";

pub fn loopback() -> Security {
    Security::Loopback { secret: SECRET.to_owned() }
}

/// Returns the options of a loopback host that has the secret; joining may take long on a busy machine.
pub fn options_of(system: &str, name: &str, endpoint: &str) -> Options {
    Options { security: loopback(), join_max: LONG, ..Options::new(system, name, endpoint) }
}

/// Returns a free port of this host. It is below the range from which Linux takes the ports of outgoing connections (32768 to 60999), so
/// that no connection of another process takes it before it is used; test processes begin at different ports.
pub fn free_port() -> u16 {
    static TAKEN: AtomicU16 = AtomicU16::new(0);
    let first = 10_000 + 10 * (std::process::id() % 2_000) as u16;
    loop {
        let port = first + TAKEN.fetch_add(1, Ordering::Relaxed) % 2_000;
        if std::net::TcpListener::bind(("127.0.0.1", port)).is_ok() {
            return port;
        }
    }
}

/// Starts a supervisor's host; returns it and the endpoint to join.
pub fn listening(system: &str) -> (Hosts, String) {
    let endpoint = format!("tcp/127.0.0.1:{}", free_port());
    let hosts = Hosts::listen(options_of(system, "cell-a", &endpoint)).expect("loopback may be plain");
    (hosts, endpoint)
}

/// Waits until a condition holds.
pub fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let until = Instant::now() + LONG;
    while !holds() {
        assert!(Instant::now() < until, "in vain: {what}");
        std::thread::park_timeout(Duration::from_millis(1));
    }
}

/// Returns a value and its checksum.
pub fn checked(value: u64) -> [u8; 16] {
    let mut bytes = [0; 16];
    bytes[..8].copy_from_slice(&value.to_le_bytes());
    bytes[8..].copy_from_slice(&(!value).wrapping_mul(0x9e37_79b9_7f4a_7c15).to_le_bytes());
    bytes
}

/// Returns the value; panics if it differs from what was written.
pub fn value_of(bytes: &[u8]) -> u64 {
    let value = u64::from_le_bytes(bytes[..8].try_into().expect("eight bytes"));
    assert_eq!(bytes, checked(value), "a value that nobody wrote");
    value
}

pub fn publish(sender: &mut dyn Sender, value: u64, now_ns: i64) {
    sender.group().copy_from_slice(&checked(value));
    sender.publish(value, now_ns);
}

/// Pushes a row; returns false if there is no space.
pub fn push(sender: &mut dyn Sender, value: u64) -> bool {
    sender.push(value, 0, &mut |row| row.copy_from_slice(&checked(value))).is_ok()
}

/// Latches and returns the group if it is new.
pub fn latched(receiver: &mut dyn Receiver, now_ns: i64) -> Option<(Header, u64)> {
    let header = receiver.latch(now_ns)?;
    let value = value_of(receiver.group());
    assert_eq!(header.number, value, "a group and its number belong together");
    Some((header, value))
}

/// Pops the oldest row.
pub fn popped(receiver: &mut dyn Receiver) -> Option<u64> {
    let (number, value) = receiver.peek_row().map(|(number, row)| (number, value_of(row)))?;
    assert_eq!(number, value, "a row and its number belong together");
    assert!(receiver.pop_row());
    Some(value)
}

pub fn monotonic_ns() -> i64 {
    (hosts::Options::new("x", "x", "tcp/127.0.0.1:1").clocks.steady)()
}

/// Creates an authority for one test.
pub fn authority(name: &str) -> Authority {
    Authority::at(PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{}", std::process::id())))
}

pub fn readable_by_all(path: &Path) {
    use std::os::unix::fs::PermissionsExt;
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o644)).expect("the file is ours");
}
