// SPDX-License-Identifier: Apache-2.0
//! The scope, counted end to end: for each channel, values received plus values reported as lost equal the values stored.
use crate::rig::{Rig, class};
use crate::stream::{next, open, say};
use serde_json::json;
use std::os::unix::net::UnixStream;
use tungstenite::{Message, WebSocket};

/// A run of values of one channel in a frame.
struct Run {
    channel: usize,
    lost: u64,
    stamps: Vec<(i64, u64)>,
    values: Vec<f64>,
}

/// Returns the runs of the next binary frame, in the format of docs/control.md.
fn frame(stream: &mut WebSocket<UnixStream>, id: &str, components: &[usize]) -> Vec<Run> {
    let bytes = loop {
        match stream.read().expect("it goes on") {
            Message::Binary(bytes) => break bytes,
            Message::Text(text) => panic!("{text}"),
            _ => {}
        }
    };
    let mut at = 0;
    let mut word = |of: usize| {
        let wide = std::array::from_fn::<u8, 8, _>(|k| if k < of { bytes[at + k] } else { 0 });
        at += of;
        u64::from_le_bytes(wide)
    };
    assert_eq!(word(4), 0x4753_4331);
    let named: Vec<u8> = (0..word(4)).map(|_| word(1) as u8).collect();
    assert_eq!(named, id.as_bytes());
    (0..(8 - id.len() % 8) % 8).for_each(|_| assert_eq!(word(1), 0));
    let runs = word(4);
    assert_eq!(word(4), 0);
    let runs: Vec<Run> = (0..runs)
        .map(|_| {
            let (channel, count, lost) = (word(4) as usize, word(4) as usize, word(8));
            let stamps = (0..count).map(|_| (word(8).cast_signed(), word(8))).collect();
            let values = (0..count * components[channel]).map(|_| f64::from_bits(word(8))).collect();
            Run { channel, lost, stamps, values }
        })
        .collect();
    assert_eq!(at, bytes.len(), "nothing else is in it");
    runs
}

/// Creates `count` SVVs, each written at 1 kHz by its own instance.
fn channels(rig: &Rig, session: &str, count: usize) -> Vec<String> {
    let names: Vec<String> = (0..count).map(|k| format!("c{k}")).collect();
    for name in &names {
        rig.call(session, "svv", json!({ "name": name, "type_text": "double" }));
        let made = rig.call(session, "create", json!({ "verb": "wave", "arguments": { "y": { "svv": name } }, "placement": { "*": "rtp0.fast" } }));
        rig.call(session, "start", json!({ "instance": made }));
    }
    names
}

/// Counts of one channel.
#[derive(Clone, Default)]
struct ChannelCounts {
    next: u64,
    got: u64,
    lost: u64,
}

impl ChannelCounts {
    /// Counts one run: its first number must skip exactly the values reported as lost, and no value within it may be missing.
    fn count(&mut self, run: &Run) {
        for (index, (time_ns, number)) in run.stamps.iter().enumerate() {
            let expected = if index == 0 { self.next + run.lost } else { self.next };
            assert_eq!(*number, expected, "channel {}", run.channel);
            assert_eq!(*time_ns, (*number as i64 + 1) * 1_000_000);
            self.next = number + 1;
        }
        if run.stamps.is_empty() {
            self.next += run.lost;
        }
        assert!(run.values.iter().all(|value| *value == 2.5));
        self.got += run.stamps.len() as u64;
        self.lost += run.lost;
    }
}

fn subscribe(stream: &mut WebSocket<UnixStream>, names: &[String]) {
    say(stream, json!({ "subscribe": "scope", "id": "s1", "names": names, "every_ms": 10 }));
    let head = next(stream);
    let told: Vec<&str> = head["scope"]["channels"].as_array().expect("channels").iter().filter_map(|channel| channel["name"].as_str()).collect();
    assert_eq!(told, names, "{head}");
    assert_eq!(head["scope"]["channels"][0], json!({ "name": names[0], "type_text": "double", "unit": "", "components": 1 }));
}

/// Reads until every channel is accounted for, received or lost.
fn count(stream: &mut WebSocket<UnixStream>, channels: usize, stored: u64) -> Vec<ChannelCounts> {
    let mut counted = vec![ChannelCounts::default(); channels];
    while counted.iter().any(|of| of.got + of.lost < stored) {
        for run in frame(stream, "s1", &vec![1; channels]) {
            counted[run.channel].count(&run);
        }
    }
    assert!(counted.iter().all(|of| of.next == stored));
    counted
}

#[test]
fn every_value_of_64_channels_at_1_khz_arrives_once() {
    let rig = Rig::new();
    let session = rig.commander("panel");
    let names = channels(&rig, &session, 64);
    let mut stream = open(&rig, "/v1/stream", None);
    subscribe(&mut stream, &names);
    let reader = std::thread::spawn(move || count(&mut stream, 64, 2_000));
    for _ in 0..20 {
        rig.call(&session, "advance", json!({ "duration_ns": 100_000_000 }));
    }
    let counted = reader.join().expect("it counts");
    let lost: u64 = counted.iter().map(|of| of.lost).sum();
    let got: u64 = counted.iter().map(|of| of.got).sum();
    // Even a reader that keeps reading may fall behind on a busy machine; the loss is then reported, and the sum is still exact.
    assert_eq!(got + lost, 64 * 2_000);
    for name in &names {
        assert_eq!(rig.call(&session, "read", json!({ "names": [name] }))["values"][name]["number"], 1_999);
    }
}

#[test]
fn what_a_reader_that_does_not_read_has_lost_is_counted_exactly() {
    let rig = Rig::new();
    let session = rig.commander("panel");
    let names = channels(&rig, &session, 4);
    let mut stream = open(&rig, "/v1/stream", None);
    subscribe(&mut stream, &names);
    let mut advanced = 0;
    while advanced < 40_000 {
        rig.call(&session, "advance", json!({ "duration_ns": 1_000_000_000_i64 }));
        advanced += 1_000;
    }
    let counted = count(&mut stream, 4, 40_000);
    assert!(counted.iter().all(|of| of.lost > 0 && of.got > 0 && of.got + of.lost == 40_000), "{:?}", counted[0].lost);
}

#[test]
fn attaching_changes_no_value_and_leaving_ends_it() {
    let run = |observed: bool| {
        let rig = Rig::new();
        let session = rig.commander("panel");
        let names = channels(&rig, &session, 2);
        let mut stream = open(&rig, "/v1/stream", None);
        if observed {
            subscribe(&mut stream, &names);
        }
        rig.call(&session, "advance", json!({ "duration_ns": 300_000_000 }));
        say(&mut stream, json!({ "unsubscribe": "s1" }));
        rig.call(&session, "advance", json!({ "duration_ns": 300_000_000 }));
        drop(stream);
        rig.call(&session, "advance", json!({ "duration_ns": 300_000_000 }));
        rig.call(&session, "read", json!({ "names": names }))
    };
    assert_eq!(run(true), run(false));
}

#[test]
fn a_scope_has_names_that_are_there_and_not_too_many() {
    let rig = Rig::new();
    let mut stream = open(&rig, "/v1/stream", None);
    say(&mut stream, json!({ "subscribe": "scope", "id": "a" }));
    assert_eq!(class(&next(&mut stream)), "CallError");
    say(&mut stream, json!({ "subscribe": "scope", "id": "a", "names": ["nothing"] }));
    let refused = next(&mut stream);
    assert_eq!((&refused["id"], class(&refused)), (&json!("a"), "UnknownName"));
    let many = |count: usize| (0..count).map(|_| "y").collect::<Vec<_>>();
    say(&mut stream, json!({ "subscribe": "scope", "id": "b", "names": many(257) }));
    assert_eq!(class(&next(&mut stream)), "LimitExceeded");
    say(&mut stream, json!({ "subscribe": "scope", "id": "c", "names": many(200) }));
    assert_eq!(next(&mut stream)["scope"]["channels"].as_array().map(Vec::len), Some(200));
    say(&mut stream, json!({ "subscribe": "scope", "id": "d", "names": many(57) }));
    assert_eq!(class(&next(&mut stream)), "LimitExceeded");
}

#[test]
fn what_is_installed_comes_when_it_has_changed_and_statistics_come_again_and_again() {
    let rig = Rig::new();
    let session = rig.commander("panel");
    let mut stream = open(&rig, "/v1/stream", None);
    say(&mut stream, json!({ "subscribe": "installed", "id": "i", "every_ms": 100 }));
    assert_eq!(next(&mut stream)["installed"], json!({ "instances": [] }));
    let id = rig.running(&session, "wave");
    let running = loop {
        let frame = next(&mut stream);
        if frame["installed"]["instances"][0]["state"] == "running" {
            break frame["installed"]["instances"][0].clone();
        }
    };
    assert_eq!((&running["id"], &running["name"], &running["list"]), (&json!(id), &json!("wave#1"), &json!("start")));
    say(&mut stream, json!({ "unsubscribe": "i" }));
    say(&mut stream, json!({ "subscribe": "statistics", "id": "s", "every_ms": 100 }));
    let mut came = 0;
    while came < 2 {
        let frame = next(&mut stream);
        // A frame of the earlier subscription may still have been in transit.
        if frame["id"] == "s" {
            assert_eq!(frame["statistics"]["sources"]["rtp0.fast"]["period_ns"], 1_000_000, "{frame}");
            came += 1;
        }
    }
}
