// SPDX-License-Identifier: Apache-2.0
//! Tests bodies of requests, and that no bytes can crash a decoder.
use daemon::requests::{self, OpenSession, TakeCommand};
use proptest::prelude::*;
use std::time::Duration;

#[test]
fn a_slice_is_of_the_request() {
    let asked = requests::asked(br#"{"instance": 7, "slice_ms": 20}"#, true).expect("right");
    assert_eq!((asked.slice, asked.arguments.len()), (Duration::from_millis(20), 1));
    assert_eq!(requests::asked(b" \n", true).expect("nothing is an object").slice, requests::SLICE_MAX);
    for body in [&br#"{"slice_ms": 0}"#[..], br#"{"slice_ms": 1001}"#, br#"{"slice_ms": "long"}"#, b"[1]", b"{", b"7", b"\xff"] {
        assert!(requests::asked(body, true).is_err(), "{body:?}");
    }
    assert!(requests::asked(br#"{"slice_ms": 20}"#, false).is_err(), "it does not last");
}

#[test]
fn sessions_have_names_and_bounds() {
    let open = |text: &str| requests::object::<OpenSession>(text.as_bytes()).and_then(OpenSession::checked);
    let opened = open(r#"{"name": "panel-1.a_b"}"#).expect("right");
    assert_eq!((opened.lost_after_ms, opened.take_up), (5_000, false));
    let long = format!(r#"{{"name": "{}"}}"#, "a".repeat(65));
    for text in [
        "",
        "{}",
        r#"{"name": ""}"#,
        r#"{"name": "a b"}"#,
        r#"{"name": "a/b"}"#,
        r#"{"name": "a", "lost_after_ms": 999}"#,
        r#"{"name": "a", "more": 1}"#,
        &long,
    ] {
        assert!(open(text).is_err(), "{text}");
    }
    assert!(!requests::object::<TakeCommand>(b"").expect("nothing").force);
}

proptest! {
    #[test]
    fn any_bytes_are_decoded_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..200), text in "\\PC{0,80}") {
        for lasts in [false, true] {
            let _either = requests::asked(&bytes, lasts);
            let _either = requests::asked(text.as_bytes(), lasts);
        }
        let _either = requests::object::<OpenSession>(&bytes).and_then(OpenSession::checked);
        prop_assert!(!requests::is_sha256(&text) || text.len() == 64);
    }
}
