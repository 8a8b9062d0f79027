// SPDX-License-Identifier: Apache-2.0
//! Tests the frames of a stream, and that no text can crash the decoder.
use control::{StreamRequest, Topic, frame};
use proptest::prelude::*;
use std::time::Duration;

#[test]
fn a_frame_subscribes_or_unsubscribes() {
    let wanted = frame(r#"{"subscribe": "svvs", "id": "a", "names": ["y"], "every_ms": 1}"#).expect("right");
    let StreamRequest::Subscribe { id, topic: Topic::Svvs, names, every, raw: false, since: 0 } = wanted else { panic!("{wanted:?}") };
    assert_eq!((id.as_str(), names.as_slice(), every), ("a", &["y".to_owned()][..], Duration::from_millis(10)));
    assert_eq!(frame(r#"{"unsubscribe": "a"}"#).expect("right"), StreamRequest::Unsubscribe("a".to_owned()));
    for text in [
        "",
        "{}",
        r#"{"subscribe": "svvs", "id": "a"}"#,
        r#"{"subscribe": "log", "id": "a", "names": ["y"]}"#,
        r#"{"subscribe": "scope", "id": "a"}"#,
        r#"{"subscribe": "statistics", "id": "a", "names": ["y"]}"#,
        r#"{"subscribe": "installed", "id": "a", "names": ["y"]}"#,
        r#"{"subscribe": "log"}"#,
        r#"{"subscribe": "log", "id": ""}"#,
        r#"{"subscribe": "songs", "id": "a"}"#,
        r#"{"subscribe": "log", "id": "a", "unsubscribe": "b"}"#,
    ] {
        assert!(frame(text).is_err(), "{text}");
    }
}

proptest! {
    #[test]
    fn any_text_is_decoded_or_refused(text in "\\PC{0,80}") {
        let _either = frame(&text);
    }
}
