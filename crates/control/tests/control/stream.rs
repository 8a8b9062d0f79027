// SPDX-License-Identifier: Apache-2.0
//! The stream: values, the log, end reports, and errors of clients.
use crate::rig::{Rig, class};
use serde_json::{Value as Json, json};
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

pub fn open(rig: &Rig, path: &str, session: Option<&str>) -> WebSocket<UnixStream> {
    let mut request = format!("ws://localhost{path}").into_client_request().expect("a request");
    if let Some(session) = session {
        request.headers_mut().insert("opengpac-session", session.parse().expect("a value"));
    }
    tungstenite::client(request, rig.connect()).unwrap_or_else(|why| panic!("{why}")).0
}

pub fn say(stream: &mut WebSocket<UnixStream>, frame: Json) {
    stream.send(Message::text(frame.to_string())).expect("it takes it");
}

/// Returns the next text frame.
pub fn next(stream: &mut WebSocket<UnixStream>) -> Json {
    loop {
        if let Message::Text(text) = stream.read().expect("it goes on") {
            return serde_json::from_str(&text).expect("JSON");
        }
    }
}

#[test]
fn values_the_log_and_ends_come_as_they_are() {
    let rig = Rig::new();
    let session = rig.commander("panel");
    let id = rig.running(&session, "wave");
    rig.call(&session, "advance", json!({ "duration_ns": 2_000_000 }));
    let mut stream = open(&rig, "/v1/stream", None);
    say(&mut stream, json!({ "subscribe": "svvs", "id": "a", "names": ["y"], "every_ms": 3_600_000 }));
    let frame = next(&mut stream);
    assert_eq!((&frame["id"], &frame["svvs"]["values"]["y"]["value"], &frame["dropped"]), (&json!("a"), &json!(2.5), &json!(0)));
    say(&mut stream, json!({ "subscribe": "svvs", "id": "r", "names": ["y"], "every_ms": 3_600_000, "raw": true }));
    assert_eq!(next(&mut stream)["svvs"]["values"]["y"]["bytes"], "AAAAAAAABEA=");
    say(&mut stream, json!({ "subscribe": "ends", "id": "c" }));
    rig.call(&session, "halt", json!({ "instance": id }));
    let frame = next(&mut stream);
    assert_eq!((&frame["ends"][0]["instance"], &frame["ends"][0]["report"]["condition"]), (&json!(id), &json!("halted")), "{frame}");
    say(&mut stream, json!({ "subscribe": "log", "id": "b", "since": 0 }));
    let frame = next(&mut stream);
    assert!(frame["log"].as_array().is_some_and(|log| log.iter().any(|entry| entry["kind"] == "end")), "{frame}");
    say(&mut stream, json!({ "unsubscribe": "c" }));
    say(&mut stream, json!({ "unsubscribe": "c" }));
    assert_eq!(class(&next(&mut stream)), "UnknownName");
}

#[test]
fn what_is_wrong_with_a_frame_is_said_and_the_stream_goes_on() {
    let rig = Rig::new();
    let mut stream = open(&rig, "/v1/stream", None);
    say(&mut stream, json!({ "sing": true }));
    assert_eq!(class(&next(&mut stream)), "CallError");
    say(&mut stream, json!({ "subscribe": "svvs", "id": "a", "names": ["nothing"] }));
    let frame = next(&mut stream);
    assert_eq!((&frame["id"], class(&frame)), (&json!("a"), "UnknownName"));
    for index in 0..33 {
        say(&mut stream, json!({ "subscribe": "ends", "id": format!("s{index}") }));
    }
    assert_eq!(class(&next(&mut stream)), "LimitExceeded");
    say(&mut stream, json!({ "subscribe": "ends", "id": "s0" }));
    assert_eq!(class(&next(&mut stream)), "InUse");
}

#[test]
fn a_stream_may_hold_its_session() {
    let rig = Rig::new();
    let session = rig.commander("panel");
    let stream = open(&rig, "/v1/stream?hold=true", Some(&session));
    let listed = |rig: &Rig| rig.ask("GET", "/v1/sessions", &[], "").1["result"][0].clone();
    rig.until(|rig| listed(rig)["held"] == true);
    drop(stream);
    rig.until(|rig| listed(rig)["alive"] == false);
    assert_eq!(rig.ask("GET", "/v1/command", &[], "").1["result"]["holder"], Json::Null);
}

/// Returns the resident memory of this process, kB.
fn resident_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("the status of this process");
    let line = status.lines().find(|line| line.starts_with("VmRSS:")).expect("its resident memory");
    line.split_whitespace().nth(1).and_then(|kb| kb.parse().ok()).expect("a number")
}

/// Ends the floods of a test, also if it fails.
struct FloodEnd<'a>(&'a AtomicBool);

impl Drop for FloodEnd<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[test]
fn a_stop_is_heard_beside_clients_that_ping_and_read_no_pong() {
    const FLOODS: usize = 4;
    const PINGS: usize = 20_000;
    let rig = Rig::new();
    let (sent, ends) = (AtomicUsize::new(0), AtomicBool::new(false));
    std::thread::scope(|scope| {
        let _end = FloodEnd(&ends);
        for _ in 0..FLOODS {
            scope.spawn(|| {
                // A client that is cut off comes back.
                while !ends.load(Ordering::Relaxed) {
                    let mut stream = open(&rig, "/v1/stream", None);
                    let ping = Message::Ping(vec![0; 125].into());
                    while !ends.load(Ordering::Relaxed) && stream.write(ping.clone()).and_then(|()| stream.flush()).is_ok() {
                        sent.fetch_add(1, Ordering::Relaxed);
                    }
                }
            });
        }
        let flooded = |pings: usize| rig.until(|_| sent.load(Ordering::Relaxed) >= pings);
        flooded(PINGS);
        let before_kb = resident_kb();
        for round in 1..=10 {
            rig.call("", "emergency_stop", json!({ "reason": format!("round {round}") }));
            let emergency = rig.call("", "statistics", json!({}))["emergency"].clone();
            assert!(emergency.as_str().is_some_and(|why| why.contains(&format!("round {round}"))), "{emergency}");
            let session = rig.open(&format!("panel{round}"));
            rig.ask("POST", "/v1/command", &[("opengpac-session", &session)], r#"{"force": true}"#);
            rig.call(&session, "reset", json!({}));
            rig.ask("DELETE", "/v1/command", &[("opengpac-session", &session)], "");
            flooded(sent.load(Ordering::Relaxed) + PINGS);
        }
        // 200,000 pings of 131 bytes, each with its pong, are 52 MB.
        assert!(resident_kb() < before_kb + 20_000, "{before_kb} kB, then {} kB", resident_kb());
    });
}

#[test]
fn a_client_that_pings_without_end_and_reads_no_pong_is_cut_off() {
    let rig = Rig::new();
    let mut stream = open(&rig, "/v1/stream", None);
    let ping = Message::Ping(vec![0; 125].into());
    let sent = (0..1 << 20).take_while(|_| stream.write(ping.clone()).and_then(|()| stream.flush()).is_ok()).count();
    // The frames sent until the client notices fill at most two sockets; without a bound this would never end.
    assert!(sent < 1 << 16, "{sent}");
    let mut seen = Vec::new();
    while let Ok(message) = stream.read() {
        seen.push(message);
    }
    let pongs = seen.iter().filter(|message| matches!(message, Message::Pong(_))).count();
    assert!(pongs <= 256, "{pongs}");
}
