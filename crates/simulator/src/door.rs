// SPDX-License-Identifier: Apache-2.0
//! A second kind of world, run by one seed in 50: the control interface runs in this process, observers send every request they are
//! allowed to, and a panel issues stops.
use crate::broken::{BrokenInvariant, broken, text};
use crate::outcome::Outcome;
use crate::seed::Numbers;
use api::Role;
use axum::Router;
use axum::body::{Body, to_bytes};
use axum::http::Request;
use control::{Inside, Options};
use daemon::{Peer, tokens};
use serde_json::{Value as Json, json};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use supervisor::System;
use tokio::task::JoinHandle;
use tower::ServiceExt;

/// Interval, in seeds, at which a seed runs such a world.
const EACH: u64 = 50;
const OBSERVERS: usize = 6;
/// Time limit for answering a stop, on the interface's clock.
const BOUND: Duration = Duration::from_millis(20);

/// Returns true if a seed runs a world of this kind.
pub fn is_of(seed: u64) -> bool {
    seed % EACH == EACH - 1
}

#[derive(Clone, Copy, Debug)]
enum What {
    /// An observer starts several waits at the same time.
    Waits,
    Histories,
    Checks,
    Looks,
    /// An observer disconnects before the answers arrive.
    Absent,
    /// An observer does not read the answers.
    Unread,
    /// Time elapses.
    Time,
    /// The panel stops something.
    Stop,
}

const KINDS: [(What, usize); 8] =
    [(What::Waits, 24), (What::Histories, 2), (What::Checks, 2), (What::Looks, 2), (What::Absent, 2), (What::Unread, 2), (What::Time, 1), (What::Stop, 4)];

const STOPS: [&str; 4] = ["halt", "disable", "pause", "emergency_stop"];

#[derive(Clone, Copy, Debug)]
struct Operation {
    what: What,
    who: usize,
    count: usize,
    slice_ms: usize,
    stop: usize,
}

fn operations(numbers: &Numbers) -> Vec<Operation> {
    let mut draw = numbers.split("requests");
    let weights = KINDS.map(|(_, weight)| weight);
    let count = 10 + draw.below(20);
    let mut drawn = || Operation {
        what: KINDS[draw.weighted(&weights)].0,
        who: draw.below(OBSERVERS),
        count: 8 + draw.below(40),
        slice_ms: 20 + draw.below(30),
        stop: draw.below(STOPS.len()),
    };
    let mut operations: Vec<Operation> = (0..count).map(|_| drawn()).collect();
    operations.push(Operation { what: What::Stop, ..drawn() });
    operations
}

/// A folder that is deleted when the world is dropped.
struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        // If this fails, the files remain in the folder for temporary files.
        let _gone = std::fs::remove_dir_all(&self.0);
    }
}

/// Runs a seed of this kind, or only those of its operations that are in `kept`. Returns the operations that were run.
pub fn run(seed: u64, kept: Option<&[usize]>, outcome: &mut Outcome) -> (Vec<usize>, Result<(), BrokenInvariant>) {
    let numbers = Numbers::of(seed);
    let chosen: Vec<(usize, Operation)> =
        operations(&numbers).into_iter().enumerate().filter(|(index, _)| kept.is_none_or(|kept| kept.contains(index))).collect();
    outcome.operations = chosen.len();
    let indices = chosen.iter().map(|(index, _)| *index).collect();
    let runtime = match tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build() {
        Ok(runtime) => runtime,
        Err(why) => return (indices, broken("a world can be made", why.to_string())),
    };
    (indices, runtime.block_on(told(seed, &chosen, outcome)))
}

async fn told(seed: u64, chosen: &[(usize, Operation)], outcome: &mut Outcome) -> Result<(), BrokenInvariant> {
    let folder = Folder(std::env::temp_dir().join(format!("simulate-{}-{seed}", std::process::id())));
    std::fs::create_dir_all(&folder.0).or_else(|why| broken("a world can be made", why.to_string()))?;
    let mut door = Door::new(folder.0.join("tokens.json")).await?;
    for (index, operation) in chosen {
        outcome.story.push(format!("[{index}] {operation:?}"));
        door.carry_out(*operation).await?;
        outcome.accepted += 1;
    }
    // Requests whose clients are still connected must be answered.
    for request in door.pending.drain(..) {
        match request.await {
            Ok(0) => return broken("what is asked is answered", "a request has no answer"),
            Err(why) if why.is_panic() => return broken("no panic", why.to_string()),
            _ => {}
        }
    }
    outcome.starts = door.starts;
    Ok(())
}

struct Door {
    system: Arc<System>,
    router: Router,
    observers: Vec<String>,
    panel: String,
    session: String,
    instance: u64,
    pending: Vec<JoinHandle<u16>>,
    unread: Vec<Body>,
    starts: u64,
}

/// Sends a request. Returns the status and the unread body; the status is 0 if there was no answer.
async fn send(router: Router, token: String, session: String, path: String, body: Json) -> (u16, Body) {
    let Ok(from) = "10.0.0.1:1".parse() else { return (0, Body::empty()) };
    let request = Request::post(path).header("host", "localhost").header("authorization", format!("Bearer {token}")).extension(Peer::Tcp { from });
    let request = if session.is_empty() { request } else { request.header("opengpac-session", session) };
    let Ok(request) = request.body(Body::from(body.to_string())) else { return (0, Body::empty()) };
    match router.oneshot(request).await {
        Ok(answer) => (answer.status().as_u16(), answer.into_body()),
        Err(never) => match never {},
    }
}

async fn read(body: Body) -> Json {
    let bytes = to_bytes(body, usize::MAX).await.unwrap_or_default();
    serde_json::from_slice(&bytes).unwrap_or_default()
}

impl Door {
    async fn new(file: PathBuf) -> Result<Door, BrokenInvariant> {
        let system = Arc::new(api::open("door", "monotonic", "{}").or_else(|why| broken("a world can be made", text(&why)))?);
        let token = |name: &str, role| tokens::add(&file, name, role, None).or_else(|why| broken("a world can be made", why.to_string()));
        let panel = token("panel", Role::Operate)?;
        let observers = (0..OBSERVERS).map(|who| token(&format!("observer{who}"), Role::Observe)).collect::<Result<_, _>>()?;
        let inside = Inside::new(system.clone(), &Options { tokens: Some(file.clone()), ..Options::default() });
        let router = inside.or_else(|why| broken("a world can be made", text(&why)))?.router();
        let mut door = Door { system, router, observers, panel, session: String::new(), instance: 0, pending: Vec::new(), unread: Vec::new(), starts: 0 };
        door.configure()?;
        door.again();
        let (_, opened) = door.panel("/v1/sessions", json!({"name": "panel"})).await;
        door.session = read(opened).await["result"]["session"].as_str().unwrap_or_default().to_owned();
        match door.panel("/v1/command", json!({})).await.0 {
            200 => Ok(door),
            status => broken("a world can be made", format!("the panel does not get command: {status}")),
        }
    }

    fn configure(&mut self) -> Result<(), BrokenInvariant> {
        let say = |name: &str, arguments: Json| {
            api::call(&self.system, name, &arguments.to_string()).or_else(|why| broken("a world can be made", format!("{name}: {}", text(&why))))
        };
        say("processor", json!({"name": "rtp0"}))?;
        say("source", json!({"processor": "rtp0", "name": "t0", "kind": "timer", "period_ns": 1_000_000, "priority": 50}))?;
        say("svv", json!({"name": "y", "type_text": "double", "history": 1_000}))?;
        let verb = json!({
            "name": "wave", "blocks": {"wave": {"block": {"subroutine": "library.signal_generator"}, "constants": {"shape": 0, "offset": 2.5}}},
            "instantiation_parameters": {"y": ["wave.y"]},
            "command_lists": {"start": {"commands": [{"command": "activate", "block": "wave", "every_ns": 1_000_000}]}},
        });
        say("define_verb", verb)?;
        say("define_device_type", json!({"name": "Axis", "svvs": {"a": {"type_text": "double"}}}))?;
        say("device", json!({"name": "axis", "device_type": "Axis"}))?;
        let made = say("create", json!({"verb": "wave", "arguments": {"y": {"svv": "y"}}, "placement": {"*": "rtp0.t0"}}))?;
        self.instance = made.as_u64().unwrap_or_default();
        Ok(())
    }

    async fn panel(&self, path: &str, body: Json) -> (u16, Body) {
        send(self.router.clone(), self.panel.clone(), self.session.clone(), path.to_owned(), body).await
    }

    /// Sends `of.count` concurrent requests of one observer, and reads their responses in the background.
    fn ask(&mut self, of: Operation, call: &str, arguments: &Json) {
        for _ in 0..of.count {
            let sent = send(self.router.clone(), self.observers[of.who].clone(), String::new(), format!("/v1/call/{call}"), arguments.clone());
            self.pending.push(tokio::spawn(async move {
                let (status, body) = sent.await;
                read(body).await;
                status
            }));
        }
    }

    async fn carry_out(&mut self, of: Operation) -> Result<(), BrokenInvariant> {
        match of.what {
            What::Waits => self.ask(of, "wait", &json!({"instance": self.instance, "slice_ms": of.slice_ms})),
            What::Histories => self.ask(of, "history", &json!({"name": "y", "count": 1_000})),
            What::Checks => {
                let blocks: serde_json::Map<String, Json> =
                    (0..of.count).map(|number| (format!("b{number}"), json!({"block": {"subroutine": "library.gain"}}))).collect();
                self.ask(Operation { count: 4, ..of }, "check_definition", &json!({"graph": {"name": "g", "blocks": blocks}}));
            }
            What::Looks => self.ask(of, "now", &json!({})),
            What::Absent => {
                let before = self.pending.len();
                self.ask(of, "wait", &json!({"instance": self.instance, "slice_ms": of.slice_ms}));
                tokio::task::yield_now().await;
                self.pending.drain(before..).for_each(|request| request.abort());
            }
            What::Unread => {
                let arguments = json!({"name": "y", "count": 1_000});
                let path = "/v1/call/history".to_owned();
                self.unread.push(send(self.router.clone(), self.observers[of.who].clone(), String::new(), path, arguments).await.1);
            }
            What::Time => tokio::time::sleep(Duration::from_millis(10 * of.slice_ms as u64)).await,
            What::Stop => return self.stop(of).await,
        }
        Ok(())
    }

    /// Halts and restarts the system.
    fn again(&mut self) {
        for (again, arguments) in [
            ("reset", json!({})),
            ("resume_program", json!({"devices": null})),
            ("enable", json!({"name": "axis"})),
            ("start", json!({"instance": self.instance})),
        ] {
            // Calls that would have no effect are refused.
            let is_done = api::call(&self.system, again, &arguments.to_string()).is_ok();
            self.starts += u64::from(is_done && again == "start");
        }
    }

    /// Stops something from the panel. The stop must be answered no matter how many clients are waiting.
    async fn stop(&mut self, of: Operation) -> Result<(), BrokenInvariant> {
        self.again();
        // Earlier requests must first have claimed their resources.
        for _ in 0..8 {
            tokio::task::yield_now().await;
        }
        let call = STOPS[of.stop];
        let arguments = match call {
            "halt" => json!({"instance": self.instance, "slice_ms": 1}),
            "disable" => json!({"name": "axis", "slice_ms": 1}),
            "pause" => json!({"slice_ms": 1}),
            _ => json!({"reason": "the panel"}),
        };
        let is_due = call == "emergency_stop" || call == "halt" && self.system.state(self.instance) == "running";
        let begun = tokio::time::Instant::now();
        let (status, body) = self.panel(&format!("/v1/call/{call}"), arguments).await;
        let answer = read(body).await;
        let took = begun.elapsed();
        if matches!(status, 0 | 408 | 413 | 429 | 500..) || is_due && status != 200 {
            return broken("stopping never waits", format!("the panel's '{call}' is answered {status}: {}", answer["errors"][0]["message"]));
        }
        if took > BOUND {
            return broken("stopping never waits", format!("the panel's '{call}' is answered after {} ms", took.as_millis()));
        }
        // The instance ends with the next firing, but the latch must be set at once.
        if call == "emergency_stop" && self.system.latched().is_none() {
            return broken("stopping never waits", "the panel's emergency stop is answered, and the system is not stopped");
        }
        self.again();
        Ok(())
    }
}
