// SPDX-License-Identifier: Apache-2.0
//! A rig for scenarios: a system under the virtual clock with two timers, a trigger and two software sources on two processors, blocks
//! that leave a trace, and programs in a short notation.
#![allow(dead_code, reason = "each test file uses its part")]
mod blocks;

#[allow(unused_imports, reason = "each test file uses its part")]
pub use blocks::{Row, all, seen};

use indexmap::IndexMap;
use interconnect::{Carrier, Faults, Memory, Message};
use model::configuration::SourceKind;
use model::definition::{Application, DeviceType, Verb};
use model::refusal::{Class, Refusals};
use model::value::Value;
use runtime::ClockKind;
use serde_json::{Value as Json, json};
use std::time::Duration;
use supervisor::{Limits, Report, SvvRequest, System, WaitResult};

pub const MS: i64 = 1_000_000;

/// Time limit far longer than any real wait.
const LONG: Duration = Duration::from_secs(300);

pub struct Rig {
    pub system: System,
}

/// Carrier of connections.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Link {
    Memory,
    /// Messages that arrive immediately.
    Message,
    /// Messages that are delayed, lost, repeated, reordered and corrupted; chosen by the seed.
    Faulty(u64),
}

impl Link {
    fn carrier(self) -> Box<dyn Carrier> {
        match self {
            Link::Memory => Box::new(Memory),
            Link::Message => Box::new(Message::new(1, Faults::none())),
            Link::Faulty(seed) => Box::new(Message::new(seed, Faults::every())),
        }
    }
}

/// Runs a scenario in memory and by messages.
pub fn on_both(scenario: impl Fn(&Rig)) {
    for link in [Link::Memory, Link::Message] {
        scenario(&Rig::new(link));
    }
}

/// Runs a scenario with every carrier, including faulty ones.
pub fn on_all(scenario: impl Fn(&Rig)) {
    on_both(&scenario);
    for seed in 1..4 {
        scenario(&Rig::new(Link::Faulty(seed)));
    }
}

impl Rig {
    pub fn new(link: Link) -> Rig {
        Rig::with(ClockKind::Virtual { seed: 7 }, link)
    }

    pub fn with(clock: ClockKind, link: Link) -> Rig {
        Rig::begun(clock, link, 0, |_| {})
    }

    /// Creates the same rig, but with firings of the slower sources that cost `cost_ns` of virtual time, and with an action on the system
    /// before its first source is made.
    pub fn begun(clock: ClockKind, link: Link, cost_ns: u64, begin: impl FnOnce(&System)) -> Rig {
        Rig::made(clock, link.carrier(), cost_ns, begin)
    }

    /// Creates a rig with this carrier.
    pub fn over(clock: ClockKind, carrier: Box<dyn Carrier>) -> Rig {
        Rig::made(clock, carrier, 0, |_| {})
    }

    fn made(clock: ClockKind, carrier: Box<dyn Carrier>, cost_ns: u64, begin: impl FnOnce(&System)) -> Rig {
        let system = System::new("cell", clock, carrier).expect("a system");
        begin(&system);
        system.processor("rtp0", None, true).unwrap();
        system.processor("rtp1", None, false).unwrap();
        system.source("rtp0", "fast", SourceKind::Timer { period_ns: 1_000_000 }, 80, 0).unwrap();
        system.source("rtp0", "slow", SourceKind::Timer { period_ns: 4_000_000 }, 60, 2 * cost_ns).unwrap();
        system.source("rtp1", "other", SourceKind::Timer { period_ns: 1_000_000 }, 70, cost_ns).unwrap();
        system.source("rtp0", "door", SourceKind::Trigger, 50, 0).unwrap();
        system.source("rtp1", "soft", SourceKind::Software, 40, cost_ns).unwrap();
        system.enter("t", &blocks::all(), &[]).unwrap();
        system.enter("crashing", &blocks::crashing(), &[]).unwrap();
        Rig { system }
    }

    /// Defines an SVV of type `double`.
    pub fn svv(&self, name: &str) {
        self.svv_of(name, json!({"type_text": "double"}));
    }

    pub fn svvs(&self, names: &[&str]) {
        names.iter().for_each(|name| self.svv(name));
    }

    pub fn svv_of(&self, name: &str, request: Json) {
        let request: SvvRequest = serde_json::from_value(request).expect("an SVV request");
        self.system.svv(name, &request, None).unwrap_or_else(|r| panic!("{}", text(&r)));
    }

    pub fn define(&self, verb: Json) {
        self.try_define(verb).unwrap_or_else(|r| panic!("{}", text(&r)));
    }

    pub fn try_define(&self, verb: Json) -> Result<(), Refusals> {
        let verb: Verb = serde_json::from_value(verb).expect("a verb");
        self.system.define_verb(verb)
    }

    pub fn device_type(&self, of: Json) {
        let of: DeviceType = serde_json::from_value(of).expect("a device type");
        self.system.define_device_type(of).unwrap_or_else(|r| panic!("{}", text(&r)));
    }

    pub fn create(&self, application: Json) -> u64 {
        self.try_create(application).unwrap_or_else(|r| panic!("{}", text(&r)))
    }

    pub fn try_create(&self, application: Json) -> Result<u64, Refusals> {
        let application: Application = serde_json::from_value(application).expect("an application");
        self.system.create(&application)
    }

    /// Creates an instance of `verb` with SVVs for its parameters (`"parameter=svv"`) and blocks in sources (`"label@rtp0.fast"`).
    pub fn instance(&self, verb: &str, given: &[&str]) -> u64 {
        self.create(application(verb, given))
    }

    pub fn start(&self, id: u64) {
        self.start_with(id, json!({}));
    }

    pub fn start_with(&self, id: u64, values: Json) {
        self.try_start(id, values, Limits::default()).unwrap_or_else(|r| panic!("{}", text(&r)));
    }

    pub fn try_start(&self, id: u64, values: Json, limits: Limits) -> Result<(), Refusals> {
        let values: IndexMap<String, Value> = serde_json::from_value(values).expect("values by name");
        self.system.start(id, &values, limits)
    }

    /// Advances by `ms` milliseconds.
    pub fn advance(&self, ms: i64) {
        self.system.advance(ms * MS).unwrap_or_else(|r| panic!("{}", text(&r)));
    }

    /// Advances to the next whole ms.
    pub fn align(&self) {
        let past = self.system.now_ns() % MS;
        self.system.advance((MS - past) % MS).unwrap_or_else(|r| panic!("{}", text(&r)));
    }

    /// Waits for the end, at most one virtual minute.
    pub fn wait(&self, id: u64) -> Report {
        self.wait_for(id, 60_000).unwrap_or_else(|| panic!("instance {id} is still {}", self.system.state(id)))
    }

    /// Waits for the end, at most `ms` milliseconds of the system's clock.
    pub fn wait_for(&self, id: u64, ms: i64) -> Option<Report> {
        let until_ns = self.system.now_ns() + ms * MS;
        match self.system.wait(id, Some(until_ns), LONG).unwrap_or_else(|r| panic!("{}", text(&r))) {
            WaitResult::Done(report) => Some(report),
            WaitResult::TimedOut => None,
            WaitResult::Slice => panic!("the wait took five minutes of real time"),
        }
    }

    /// Returns the value of an SVV of type `double`.
    pub fn read(&self, name: &str) -> f64 {
        self.read_all(&[name])[0]
    }

    pub fn read_all(&self, names: &[&str]) -> Vec<f64> {
        let names: Vec<String> = names.iter().map(|n| (*n).to_owned()).collect();
        let (_, readings) = self.system.read(&names).unwrap_or_else(|r| panic!("{}", text(&r)));
        readings.iter().map(|(bytes, _, _)| f64::from_le_bytes(bytes.as_slice().try_into().unwrap())).collect()
    }

    pub fn write(&self, name: &str, value: f64) {
        self.system.write(name, &Value::Number(value)).unwrap_or_else(|r| panic!("{}", text(&r)));
    }

    /// Returns the log entries of one kind, as `about: text`.
    pub fn logged(&self, kind: &str) -> Vec<String> {
        self.system.log_since(0).iter().filter(|e| e.kind == kind).map(|e| format!("{}: {}", e.about, e.text)).collect()
    }
}

/// Returns the application of a verb; for the notation see [`Rig::instance`].
pub fn application(verb: &str, given: &[&str]) -> Json {
    let (mut arguments, mut placement) = (serde_json::Map::new(), serde_json::Map::new());
    for word in given {
        if let Some((label, source)) = word.split_once('@') {
            placement.insert(label.into(), json!(source));
        } else if let Some((parameter, svvs)) = word.split_once('=') {
            let svvs: Vec<&str> = svvs.split(',').collect();
            let argument = if svvs.len() > 1 { json!({"svvs": svvs}) } else { json!({"svv": svvs[0]}) };
            arguments.insert(parameter.into(), argument);
        } else {
            panic!("'{word}' is neither parameter=svv nor label@source");
        }
    }
    json!({"verb": verb, "arguments": arguments, "placement": placement})
}

/// Returns a verb with blocks `label: module.block` and the remaining members.
pub fn verb(name: &str, blocks: &[(&str, &str)], rest: Json) -> Json {
    let uses: serde_json::Map<String, Json> = blocks.iter().map(|(label, of)| ((*label).into(), json!({"block": {"subroutine": of}}))).collect();
    let mut verb = json!({"name": name, "blocks": uses});
    merge(&mut verb, rest);
    verb
}

fn merge(base: &mut Json, over: Json) {
    match (base, over) {
        (Json::Object(base), Json::Object(over)) => {
            for (key, value) in over {
                merge(base.entry(key).or_insert(Json::Null), value);
            }
        }
        (base, over) => *base = over,
    }
}

/// Returns a command list in short form: `+label`, `+label 1ms` (activate), `-label` (deactivate), `!label` (execute), `*label`
/// (install), `?` (wait until nothing is active), `?5ms` (for a time), `?label.condition` (for one of several, separated by spaces),
/// `ready`.
pub fn list(commands: &[&str]) -> Json {
    let commands: Vec<Json> = commands.iter().map(|text| command(text)).collect();
    json!({"commands": commands})
}

fn command(text: &str) -> Json {
    if text == "ready" {
        return json!({"command": "ready"});
    }
    let (sign, rest) = text.split_at(1);
    let words: Vec<&str> = rest.split_whitespace().collect();
    let duration = |word: &str| model::quantity::duration_ns(word, "it").expect("a duration");
    match sign {
        "+" => json!({"command": "activate", "block": words[0], "every_ns": words.get(1).map(|w| duration(w))}),
        "-" => json!({"command": "deactivate", "block": words[0]}),
        "!" => json!({"command": "execute", "block": words[0]}),
        "*" => json!({"command": "install", "blocks": words}),
        "?" if words.first().is_some_and(|w| w.ends_with("ms")) => json!({"command": "wait", "time_ns": duration(words[0])}),
        "?" => json!({"command": "wait", "conditions": words}),
        _ => panic!("'{text}' is not a command"),
    }
}

/// Returns command lists by name.
pub fn lists(lists: &[(&str, &[&str])]) -> Json {
    Json::Object(lists.iter().map(|(name, commands)| ((*name).to_owned(), list(commands))).collect())
}

/// Returns τ in short form: `from, condition -> to`.
pub fn tau(lines: &[&str]) -> Json {
    let line = |text: &&str| {
        let (from, rest) = text.split_once(", ").expect("from, condition -> to");
        let (condition, to) = rest.split_once(" -> ").expect("from, condition -> to");
        json!({"from": from, "condition": condition, "to": to})
    };
    lines.iter().map(line).collect()
}

pub fn text(refusals: &Refusals) -> String {
    refusals.iter().map(|r| format!("{:?}: {r}", r.class)).collect::<Vec<_>>().join("\n")
}

/// Returns the class of an expected refusal.
pub fn class<T>(result: Result<T, Refusals>) -> Class {
    match result {
        Ok(_) => panic!("it was not refused"),
        Err(refusals) => refusals[0].class,
    }
}

/// Returns a numeric output of an end report.
pub fn output(report: &Report, name: &str) -> f64 {
    match report.outputs.get(name).and_then(Option::as_ref) {
        Some(Value::Number(number)) => *number,
        Some(Value::Integer(number)) => *number as f64,
        other => panic!("output '{name}' is {other:?}"),
    }
}
