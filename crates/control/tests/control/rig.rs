// SPDX-License-Identifier: Apache-2.0
//! A served system in its own folder, and a minimal client.
use control::{Options, Server};
use daemon::Watcher;
use serde_json::{Value as Json, json};
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use supervisor::System;

/// A folder that is deleted with the test.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new() -> Folder {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let path = std::env::temp_dir().join(format!("control-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed)));
        std::fs::create_dir_all(&path).expect("a folder");
        Folder(path)
    }

    pub fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _gone = std::fs::remove_dir_all(&self.0);
    }
}

/// Returns a system under the virtual clock with one timer, the SVV `y`, and the verb `wave`, which runs until it is ended.
pub fn system(clock: &str) -> Arc<System> {
    let system = api::open("cell", clock, "{}").unwrap_or_else(|r| panic!("{r:?}"));
    let say = |name: &str, arguments: Json| api::call(&system, name, &arguments.to_string()).unwrap_or_else(|r| panic!("{name}: {r:?}"));
    say("processor", json!({ "name": "rtp0" }));
    say("source", json!({ "processor": "rtp0", "name": "fast", "kind": "timer", "period_ns": 1_000_000, "priority": 80 }));
    say("svv", json!({ "name": "y", "type_text": "double", "history": 10 }));
    say("define_verb", wave("wave", Json::Null));
    Arc::new(system)
}

/// Returns a verb with this policy.
pub fn wave(name: &str, policy: Json) -> Json {
    json!({
        "name": name, "if_cut_off": policy,
        "blocks": { "wave": { "block": { "subroutine": "library.signal_generator" }, "constants": { "shape": 0, "offset": 2.5 } } },
        "instantiation_parameters": { "y": ["wave.y"] },
        "command_lists": { "start": { "commands": [{ "command": "activate", "block": "wave", "every_ns": 1_000_000 }] } },
    })
}

/// Collects the messages it receives; the number limits how often the server may continue.
pub struct MessageKeeper(pub Vec<String>, pub usize);

impl Default for MessageKeeper {
    fn default() -> MessageKeeper {
        MessageKeeper(Vec::new(), usize::MAX)
    }
}

impl Watcher for MessageKeeper {
    fn tell(&mut self, text: &str) {
        self.0.push(text.to_owned());
    }

    fn goes_on(&mut self) -> bool {
        self.1 = self.1.saturating_sub(1);
        self.1 > 0
    }
}

pub struct Rig {
    // Declared before the folder, so that the server stops first.
    pub server: Server,
    pub system: Arc<System>,
    pub folder: Folder,
}

impl Rig {
    pub fn new() -> Rig {
        Rig::with("virtual", |_, _| {})
    }

    pub fn with(clock: &str, change: impl FnOnce(&mut Options, &Folder)) -> Rig {
        let folder = Folder::new();
        let mut options = Options { socket: Some(folder.file("s")), ..Options::default() };
        change(&mut options, &folder);
        Rig::within(folder, clock, &options, &mut MessageKeeper::default()).unwrap_or_else(|r| panic!("{r:?}"))
    }

    /// Serves a system in a folder that may contain files of an earlier run.
    pub fn within(folder: Folder, clock: &str, options: &Options, watcher: &mut dyn Watcher) -> Result<Rig, api::Refusals> {
        let system = system(clock);
        let server = Server::start_watched(system.clone(), options, watcher)?;
        Ok(Rig { server, system, folder })
    }

    pub fn connect(&self) -> UnixStream {
        UnixStream::connect(self.folder.file("s")).expect("it listens")
    }

    /// Sends one request; returns its status and its answer.
    pub fn ask(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &str) -> (u16, Json) {
        let mut stream = self.connect();
        send(&mut stream, method, path, headers, body.as_bytes());
        receive(&mut stream)
    }

    /// Makes a call in a session, or in none, and returns its result.
    pub fn call(&self, session: &str, name: &str, arguments: Json) -> Json {
        let headers: &[(&str, &str)] = if session.is_empty() { &[] } else { &[("opengpac-session", session)] };
        let (status, answer) = self.ask("POST", &format!("/v1/call/{name}"), headers, &arguments.to_string());
        assert_eq!(status, 200, "{name}: {answer}");
        answer["result"].clone()
    }

    /// Opens a new session and takes command.
    pub fn commander(&self, name: &str) -> String {
        let session = self.open(name);
        let (status, answer) = self.ask("POST", "/v1/command", &[("opengpac-session", &session)], "{}");
        assert_eq!(status, 200, "{answer}");
        session
    }

    pub fn open(&self, name: &str) -> String {
        let (status, answer) = self.ask("POST", "/v1/sessions", &[], &json!({ "name": name }).to_string());
        assert_eq!(status, 200, "{answer}");
        answer["result"]["session"].as_str().expect("an ID").to_owned()
    }

    /// Starts an instance of a verb.
    pub fn running(&self, session: &str, verb: &str) -> u64 {
        let id = self.call(session, "create", json!({ "verb": verb, "arguments": { "y": { "svv": "y" } }, "placement": { "*": "rtp0.fast" } }));
        self.call(session, "start", json!({ "instance": id }));
        id.as_u64().expect("a number")
    }

    /// Polls until a condition holds; if it never does, the test's time limit ends the test.
    pub fn until(&self, holds: impl Fn(&Rig) -> bool) {
        while !holds(self) {
            std::thread::yield_now();
        }
    }

    pub fn audit(&self) -> Vec<Json> {
        let text = std::fs::read_to_string(self.folder.file("s.audit.jsonl")).expect("an audit file");
        text.lines().map(|line| serde_json::from_str(line).expect("a line is JSON")).collect()
    }
}

pub fn send(stream: &mut impl Write, method: &str, path: &str, headers: &[(&str, &str)], body: &[u8]) {
    let mut text = format!("{method} {path} HTTP/1.1\r\ncontent-length: {}\r\nconnection: close\r\n", body.len());
    if !headers.iter().any(|(name, _)| *name == "host") {
        text.push_str("host: localhost\r\n");
    }
    headers.iter().for_each(|(name, value)| text.push_str(&format!("{name}: {value}\r\n")));
    text.push_str("\r\n");
    stream.write_all(text.as_bytes()).and_then(|()| stream.write_all(body)).expect("it takes the request");
}

pub fn receive(stream: &mut impl Read) -> (u16, Json) {
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).expect("it answers");
    let text = String::from_utf8(answer).expect("text");
    let (head, body) = text.split_once("\r\n\r\n").unwrap_or_else(|| panic!("no answer: {text:?}"));
    let status = head.split(' ').nth(1).and_then(|s| s.parse().ok()).expect("a status");
    (status, serde_json::from_str(body).unwrap_or_else(|why| panic!("{why}: {text}")))
}

/// Returns the class of the first error of an answer.
pub fn class(answer: &Json) -> &str {
    answer["errors"][0]["class"].as_str().unwrap_or("none")
}
