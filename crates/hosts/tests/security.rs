// SPDX-License-Identifier: Apache-2.0
//! Tests security: admission of hosts, and refusals before anything starts.
mod common;
use common::*;
use hosts::{Hosts, JoinError, Options, Security, wire_to_listen};
use interconnect::Link;
use std::path::PathBuf;
use std::time::Duration;

const TOKEN: &str = "a-token-of-some-length";

fn refusal(made: Result<Hosts, JoinError>) -> String {
    made.err().expect("it is refused").to_string()
}

fn certificates(authority: &Authority, host: &str) -> Security {
    let (certificate, key) = authority.sign(host, &["127.0.0.1"]);
    Security::Certificates { authority: authority.authority.clone(), certificate, key }
}

fn exchange(a: &Hosts, b: &Hosts) {
    let (near, far): (Box<dyn Link>, Box<dyn Link>) = (a.link("cell-b", 1).expect("joined"), b.link("cell-a", 1).expect("listens"));
    near.send(b"in order").expect("it is open");
    assert_eq!(far.receive(LONG), Ok(Some(b"in order".to_vec())));
}

/// Sends much from both sides at the same time.
fn both_ways_at_once(a: &Hosts, b: &Hosts) {
    const FRAMES: usize = 100;
    let ends: [Box<dyn Link>; 2] = [a.link("cell-b", 2).expect("joined"), b.link("cell-a", 2).expect("listens")];
    let frame = |number: usize| vec![number as u8; 10_000 + number];
    std::thread::scope(|scope| {
        for end in &ends {
            scope.spawn(move || (0..FRAMES).for_each(|number| end.send(&frame(number)).expect("it is open")));
            scope.spawn(move || {
                for number in 0..FRAMES {
                    assert_eq!(end.receive(LONG), Ok(Some(frame(number))));
                }
            });
        }
    });
}

#[test]
fn only_loopback_may_be_plain_and_each_refusal_says_what_to_do() {
    let authority = authority("table");
    let full = certificates(&authority, "a");
    let token = |token: &str| Security::Token { token: token.to_owned(), authority: None, certificate: None };
    let missing = Security::Certificates { authority: PathBuf::from("no/such.pem"), certificate: PathBuf::new(), key: PathBuf::new() };
    for (endpoint, security, words) in [
        ("tcp/0.0.0.0:7447", loopback(), "so it needs TLS; use tls/HOST:PORT with certificates or a token"),
        ("tcp/[::]:7447", loopback(), "so it needs TLS"),
        ("tcp/192.0.2.1:7447", loopback(), "so it needs TLS"),
        ("tls/0.0.0.0:7447", loopback(), "needs certificates: give authority, certificate and key, or a token"),
        ("tls/127.0.0.1:7447", loopback(), "needs certificates"),
        ("tcp/127.0.0.1:7447", full.clone(), "have no effect on 'tcp/127.0.0.1:7447'; write tls/HOST:PORT"),
        ("tcp/192.0.2.1:7447", token(TOKEN), "have no effect"),
        ("tls/127.0.0.1:7447", token("short"), "use 16 characters or more"),
        ("tls/127.0.0.1:7447", token(TOKEN), "a token alone is not enough to"),
        ("tls/127.0.0.1:7447", missing, "the authority 'no/such.pem' cannot be used"),
        ("http://127.0.0.1", loopback(), "write tcp/HOST:PORT or tls/HOST:PORT"),
    ] {
        for make in [Hosts::listen, Hosts::join] {
            let refused = refusal(make(Options { security: security.clone(), ..Options::new("cell", "cell-a", endpoint) }));
            assert!(refused.contains(words), "{endpoint}: {refused}");
        }
    }
    for (system, name) in [("a/b", "ok"), ("ok", ""), ("*", "ok"), ("ok", "über")] {
        assert!(refusal(Hosts::listen(Options::new(system, name, "tcp/127.0.0.1:1"))).contains("use letters, digits"));
    }
    if let Security::Certificates { key, .. } = &full {
        readable_by_all(key);
    }
    let refused = refusal(Hosts::listen(Options { security: full.clone(), ..Options::new("cell", "cell-a", "tls/127.0.0.1:1") }));
    assert!(refused.contains("others may read it; chmod 600 it"), "{refused}");
    assert!(!format!("{:?}", token(TOKEN)).contains(TOKEN), "no secret gets into a log");
}

#[test]
fn certificates_of_one_authority_let_in_and_no_others() {
    let (authority, other) = (authority("own"), authority("other"));
    let endpoint = format!("tls/127.0.0.1:{}", free_port());
    let options = |name: &str, security| Options { security, join_max: LONG, ..Options::new("tls", name, &endpoint) };
    let a = Hosts::listen(options("cell-a", certificates(&authority, "a"))).expect("it has certificates");
    let b = Hosts::join(options("cell-b", certificates(&authority, "b"))).expect("it has certificates of the same authority");
    assert!(a.wait_for("cell-b", LONG));
    exchange(&a, &b);
    both_ways_at_once(&a, &b);
    let threads = std::fs::read_dir("/proc/self/task").expect("Linux").flatten();
    let names: Vec<String> = threads.flat_map(|thread| std::fs::read_to_string(thread.path().join("comm"))).collect();
    assert!(names.iter().any(|name| name.starts_with("rx-")), "{names:?}");
    assert!(!names.iter().any(|name| name.starts_with("tx-") || name.starts_with("acc-")), "a stream is read and written by one thread: {names:?}");

    let (certificate, key) = other.sign("c", &["127.0.0.1"]);
    let stranger = Security::Certificates { authority: authority.authority.clone(), certificate, key };
    let none = Security::Token { token: TOKEN.to_owned(), authority: Some(authority.authority.clone()), certificate: None };
    for (security, who) in [(stranger, "a certificate of another authority"), (none, "no certificate")] {
        let refused = refusal(Hosts::join(Options { join_max: Duration::from_secs(2), ..options("cell-c", security) }));
        assert!(refused.contains(&endpoint), "{who}: {refused}");
    }
    assert_eq!(a.peers().len(), 1, "nobody else was let in");
}

#[test]
fn a_token_lets_in_and_another_does_not() {
    let authority = authority("token");
    let endpoint = format!("tls/127.0.0.1:{}", free_port());
    let options = |name: &str, security| Options { security, join_max: LONG, ..Options::new("token", name, &endpoint) };
    let listens = Security::Token { token: TOKEN.to_owned(), authority: None, certificate: Some(authority.sign("a", &["127.0.0.1"])) };
    let joins = |token: &str| Security::Token { token: token.to_owned(), authority: Some(authority.authority.clone()), certificate: None };
    let a = Hosts::listen(options("cell-a", listens)).expect("it has a certificate");
    let b = Hosts::join(options("cell-b", joins(TOKEN))).expect("it has the token");
    assert!(a.wait_for("cell-b", LONG));
    exchange(&a, &b);
    for (security, who) in [(joins("another-token-of-length"), "another token"), (certificates(&authority, "c"), "a certificate and no token")] {
        let refused = refusal(Hosts::join(Options { join_max: Duration::from_secs(2), ..options("cell-c", security) }));
        assert!(refused.contains(&endpoint), "{who}: {refused}");
    }
    assert_eq!(a.peers().len(), 1, "nobody else was let in");
}

#[test]
fn on_loopback_each_side_must_have_the_secret() {
    let endpoint = format!("tcp/127.0.0.1:{}", free_port());
    let of = |name: &str, secret: &str| {
        let security = Security::Loopback { secret: secret.to_owned() };
        Options { security, join_max: LONG, ..Options::new("secret", name, &endpoint) }
    };
    let a = Hosts::listen(of("cell-a", SECRET)).expect("it has a secret");
    let _b = Hosts::join(of("cell-b", SECRET)).expect("it has the secret");
    assert!(a.wait_for("cell-b", LONG));
    let refused = refusal(Hosts::join(Options { join_max: Duration::from_secs(2), ..of("cell-c", "another-secret-of-length") }));
    assert!(refused.contains(&endpoint) && refused.contains("it belongs to another user"), "{refused}");
    for weak in ["", "short", "with white space in it"] {
        assert!(refusal(Hosts::join(of("cell-c", weak))).contains("16 characters or more"), "{weak}");
        assert!(refusal(Hosts::listen(of("cell-c", weak))).contains("16 characters or more"), "{weak}");
    }
    // Any program that knows the address and the names could try this: it is not admitted, so it neither receives nor sends anything.
    let mut config = zenoh::Config::default();
    let settings = [
        ("mode", "\"client\"".to_owned()),
        ("connect/endpoints", format!("[{endpoint:?}]")),
        ("connect/timeout_ms", "1000".to_owned()),
        ("connect/exit_on_failure", "true".to_owned()),
        ("scouting/multicast/enabled", "false".to_owned()),
    ];
    settings.iter().for_each(|(key, value)| config.insert_json5(key, value).expect("zenoh knows it"));
    assert!(zenoh::Wait::wait(zenoh::open(config)).is_err(), "a stranger has a way in");
    assert_eq!(a.peers().len(), 1, "nobody else was let in");
}

#[test]
fn who_listens_without_the_secret_is_given_no_host() {
    // The transport admits the joining side, as a rogue listener could.
    let endpoint = format!("tcp/127.0.0.1:{}", free_port());
    let of = |name: &str, secret: &str| {
        let security = Security::Loopback { secret: secret.to_owned() };
        Options { security, join_max: LONG, ..Options::new("false", name, &endpoint) }
    };
    let wire = wire_to_listen(&of("cell-a", SECRET)).expect("the address is free");
    let _a = Hosts::listen_over(of("cell-a", "another-secret-of-length"), wire).expect("it listens");
    let refused = refusal(Hosts::join(of("cell-b", SECRET)));
    assert!(refused.contains("does not have the secret"), "{refused}");
}

#[test]
fn a_host_that_does_not_fit_is_refused_with_words() {
    let endpoint = format!("tcp/127.0.0.1:{}", free_port());
    let options = |name: &str| Options { abi_version: 7, ..options_of("fits", name, &endpoint) };
    let _a = Hosts::listen(options("cell-a")).expect("loopback");
    let _b = Hosts::join(options("cell-b")).expect("it fits");
    let older = refusal(Hosts::join(Options { abi_version: 6, ..options("cell-c") }));
    assert!(older.contains("does not admit host 'cell-c': its block interface (ABI) has version 6, but this side's has version 7"), "{older}");
    let taken = refusal(Hosts::join(options("cell-b")));
    assert!(taken.contains("a host 'cell-b' has already joined") && taken.contains("give this one another name"), "{taken}");
    let listeners = refusal(Hosts::join(options("cell-a")));
    assert!(listeners.contains("the host that listens is also named 'cell-a'"), "{listeners}");
    // Long enough to connect on a busy machine; without a connection the refusal would differ.
    let elsewhere = Options { join_max: Duration::from_secs(5), system: "another".to_owned(), ..options("cell-d") };
    assert!(refusal(Hosts::join(elsewhere)).contains("no system 'another' answered"));
    let nobody = Options { join_max: Duration::from_secs(1), ..options_of("fits", "cell-d", &format!("tcp/127.0.0.1:{}", free_port())) };
    assert!(refusal(Hosts::join(nobody)).contains("cannot connect to"));
    let taken = refusal(Hosts::listen(options("cell-e")));
    assert!(taken.contains("cannot connect to"), "the address is in use: {taken}");
}
