// SPDX-License-Identifier: Apache-2.0
//! Tests the gate: hosts, origins, tokens, certificates.
use crate::rig::Folder;
use api::Role;
use axum::http::{HeaderMap, HeaderName, HeaderValue};
use control::Site;
use daemon::tokens::{self, TokenRejection, Tokens};
use daemon::{Caller, Failure, Gate, Peer};
use std::net::SocketAddr;
use std::os::unix::fs::PermissionsExt;
use std::time::{Duration, Instant};

/// A gate, and the site checks in front of it.
struct Entrance {
    gate: Gate,
    site: Site,
}

impl Entrance {
    fn admit(&self, peer: &Peer, headers: &HeaderMap) -> Result<Caller, Failure> {
        self.site.let_in(&self.gate, peer, headers).map(|(caller, _)| caller)
    }
}

fn gate(tokens: Option<Tokens>) -> Entrance {
    let site = Site { hosts: vec!["cell-b".to_owned()], origins: vec!["https://studio.example".to_owned()] };
    Entrance { gate: Gate { tokens, run: None, uid: 1_000, insecure_loopback: false }, site }
}

fn headers(of: &[(&'static str, &str)]) -> HeaderMap {
    of.iter().map(|(name, value)| (HeaderName::from_static(name), HeaderValue::from_str(value).expect("a value"))).collect()
}

fn tcp(from: &str) -> Peer {
    Peer::Tcp { from: from.parse::<SocketAddr>().expect("an address") }
}

#[test]
fn a_host_is_ours_or_an_address() {
    let gate = gate(None);
    let unix = Peer::Unix { uid: 1_000 };
    for host in ["localhost", "localhost:8777", "127.0.0.1:8777", "[::1]:8777", "[::1]", "192.168.0.7", "cell-b:1", "CELL-B"] {
        assert!(gate.admit(&unix, &headers(&[("host", host)])).is_ok(), "{host}");
    }
    for host in ["evil.example", "evil.example:8777", "localhost.evil.example", "", "127.0.0.1.evil.example", "[evil]"] {
        assert!(gate.admit(&unix, &headers(&[("host", host)])).is_err(), "{host}");
    }
    assert!(gate.admit(&unix, &HeaderMap::new()).is_err(), "there is none");
    let mut two = headers(&[("host", "localhost")]);
    two.append("host", HeaderValue::from_static("evil.example"));
    assert!(gate.admit(&unix, &two).is_err(), "there are two");
}

#[test]
fn no_page_calls_that_is_not_named() {
    let gate = gate(None);
    let unix = Peer::Unix { uid: 1_000 };
    let with = |origin| gate.admit(&unix, &headers(&[("host", "localhost"), ("origin", origin)]));
    assert!(with("https://studio.example").is_ok());
    for origin in ["http://studio.example", "https://evil.example", "null", "http://localhost"] {
        assert!(with(origin).is_err(), "{origin}");
    }
}

#[test]
fn a_token_is_right_expired_revoked_or_wrong() {
    let folder = Folder::new();
    let path = folder.file("tokens.json");
    let right = tokens::add(&path, "panel", Role::Operate, Some(100)).expect("a token");
    let kept = Tokens::open(&path).expect("the file");
    assert_eq!(kept.verify(&right, 99).expect("it holds").role, Role::Operate);
    assert_eq!(kept.verify(&right, 100).expect_err("its time is over"), TokenRejection::Expired);
    assert_eq!(kept.verify(&right[..right.len() - 1], 1).expect_err("a part"), TokenRejection::Wrong);
    assert_eq!(kept.verify("", 1).expect_err("nothing"), TokenRejection::Wrong);
    assert!(tokens::add(&path, "panel", Role::Observe, None).is_err(), "one name, one token");
    assert!(tokens::revoke(&path, "panel").expect("it is there") && !tokens::revoke(&path, "panel").expect("it is there"));
    assert_eq!(kept.verify(&right, 1).expect_err("the file is read again"), TokenRejection::Revoked);
    let next = tokens::add(&path, "panel", Role::Observe, None).expect("a new one of that name");
    assert_eq!(kept.verify(&next, u64::MAX).expect("it never expires").role, Role::Observe);
    assert!(!std::fs::read_to_string(&path).expect("text").contains(&next), "the token itself is nowhere");
    std::fs::remove_file(&path).expect("it was there");
    assert_eq!(kept.verify(&next, 1).expect_err("a file that is gone lets nobody in"), TokenRejection::Wrong);
}

#[test]
fn a_file_of_tokens_that_others_can_read_is_refused() {
    let folder = Folder::new();
    let path = folder.file("tokens.json");
    tokens::add(&path, "panel", Role::Operate, None).expect("a token");
    assert_eq!(std::fs::metadata(&path).expect("it is there").permissions().mode() & 0o777, 0o600);
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o640)).expect("ours");
    assert!(Tokens::open(&path).err().expect("refused").to_string().contains("chmod 600"));
    assert!(Tokens::open(&folder.file("none")).is_err());
    std::fs::write(&path, "{").expect("ours");
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).expect("ours");
    assert!(Tokens::open(&path).err().expect("refused").to_string().contains("not a token file"));
}

#[test]
fn what_authorization_says_is_never_passed_over() {
    let folder = Folder::new();
    let path = folder.file("tokens.json");
    let token = tokens::add(&path, "panel", Role::Operate, None).expect("a token");
    let gate = gate(Some(Tokens::open(&path).expect("the file")));
    let unix = Peer::Unix { uid: 1_000 };
    let with = |given: &str| gate.admit(&unix, &headers(&[("host", "localhost"), ("authorization", given)]));
    let caller = with(&format!("Bearer {token}")).expect("it is right");
    assert_eq!((caller.who.as_str(), caller.role), ("token panel", Role::Operate), "a token says less than the socket");
    for given in ["", "Bearer", "Bearer ", "Basic abc", &format!("bearer {token}x"), &token] {
        assert!(with(given).is_err(), "{given}");
    }
}

#[test]
fn loopback_without_a_token_may_look_where_that_is_asked_for() {
    let mut gate = gate(None);
    let local = headers(&[("host", "localhost")]);
    assert_eq!(gate.admit(&tcp("127.0.0.1:1"), &local).expect_err("no token").ground, daemon::Ground::UnknownCaller);
    gate.gate.insecure_loopback = true;
    assert_eq!(gate.admit(&tcp("127.0.0.1:1"), &local).expect("it looks").role, Role::Observe);
    assert!(gate.admit(&tcp("192.168.0.7:1"), &local).is_err(), "it is of another machine");
}

#[test]
fn a_certificate_has_the_role_of_its_entry() {
    let folder = Folder::new();
    let path = folder.file("tokens.json");
    tokens::add_certificate(&path, "press", Role::Configure, None, [7; 32]).expect("an entry");
    tokens::add_certificate(&path, "old", Role::Configure, Some(1), [8; 32]).expect("an entry");
    let gate = gate(Some(Tokens::open(&path).expect("the file")));
    let of = |certificate: Option<[u8; 32]>| {
        gate.admit(&Peer::Tls { from: "192.168.0.7:1".parse().expect("an address"), certificate }, &headers(&[("host", "cell-b")]))
    };
    assert_eq!(of(Some([7; 32])).expect("it is listed").role, Role::Configure);
    assert_eq!(of(Some([9; 32])).expect("it is signed").role, Role::Observe);
    assert!(of(Some([8; 32])).is_err() && of(None).is_err());
    let digest = "07".repeat(32);
    assert!(gate.admit(&tcp("127.0.0.1:1"), &headers(&[("host", "localhost"), ("authorization", &format!("Bearer {digest}"))])).is_err(), "it is no token");
}

#[test]
fn who_comes_too_often_is_told_when_to_come_again() {
    let rates = daemon::Rates::new(2.0, 3.0);
    let now = Instant::now();
    assert!((0..3).all(|_| rates.take("a", now).is_ok()));
    let refused = rates.take("a", now).expect_err("the bucket is empty");
    assert_eq!(refused.ground, daemon::Ground::TooMany { again_in_s: 1 });
    rates.take("b", now).expect("each has its own");
    rates.take("a", now + Duration::from_millis(500)).expect("it fills with time");
    assert!(rates.take("a", now + Duration::from_millis(600)).is_err());
    for index in 0..2_000 {
        // More callers than are remembered: idle ones are forgotten, so memory stays bounded.
        let _whatever = rates.take(&format!("c{index}"), now + Duration::from_secs(index));
    }
    rates.take("a", now + Duration::from_secs(3_000)).expect("it is let in again");
}

#[test]
fn a_damaged_file_of_tokens_leaves_those_that_it_had_and_says_so_once() {
    let folder = Folder::new();
    let path = folder.file("tokens.json");
    let right = tokens::add(&path, "panel", Role::Operate, None).expect("a token");
    let whole = std::fs::read(&path).expect("ours");
    let kept = Tokens::open(&path).expect("the file");
    assert!(kept.news(0).is_empty());
    for damage in [&b""[..], b"{\"tokens\": [", b"\xff\xfe"] {
        std::fs::write(&path, damage).expect("ours");
        assert!(kept.verify(&right, 1).is_ok(), "it goes on to count");
        let news = kept.news(0);
        assert!(news.len() == 1 && news[0].contains("stay valid until it is fixed"), "{news:?}");
        assert!(kept.news(0).is_empty(), "it is said once");
        std::fs::write(&path, &whole).expect("ours");
        assert!(kept.news(0)[0].ends_with("can be read again"));
    }
    std::fs::remove_file(&path).expect("ours");
    assert_eq!(kept.verify(&right, 1).expect_err("it is gone"), TokenRejection::Wrong);
    assert!(kept.news(0)[0].contains("no caller is admitted by a token"));
}

#[test]
fn a_token_that_is_about_to_expire_says_so_a_week_and_a_day_before_and_when_it_has() {
    let (folder, day) = (Folder::new(), 86_400);
    let path = folder.file("tokens.json");
    tokens::add(&path, "panel", Role::Operate, Some(30 * day)).expect("a token");
    tokens::add(&path, "gone", Role::Operate, Some(30 * day)).expect("a token");
    assert!(tokens::revoke(&path, "gone").expect("it is there"));
    let kept = Tokens::open(&path).expect("the file");
    let told: Vec<String> = (0..40 * 24).flat_map(|hour| kept.news(hour * 3600)).collect();
    let expected = ["'panel' expires in 7 days", "'panel' expires in 24 h", "'panel' has expired"];
    assert!(told.len() == 3 && told.iter().zip(expected).all(|(told, expected)| told.contains(expected)), "{told:?}");
}
