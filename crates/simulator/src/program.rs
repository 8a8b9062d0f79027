// SPDX-License-Identifier: Apache-2.0
//! A random program: processors and sources, a plant, SVVs and devices, and verbs composed of the blocks of this crate.
//!
//! The draws are chosen so that most definitions are accepted; a refusal rejects a definition as a whole, and the world continues.
mod making;

use crate::blocks::MANY;
use crate::seed::Numbers;
use making::Making;
use serde_json::{Map, Value as Json, json};

pub const MS: i64 = 1_000_000;

/// Number of pairs of SVVs that have no owner: `s0.a`, `s0.b`, …
pub const PAIRS: usize = 3;
/// Number of arrays.
pub const ARRAYS: usize = 2;
/// Logical devices without a verb that define the treatment of a second writer, each with a pair.
pub const ARBITRATED: [&str; 2] = ["queue", "abort"];
/// Logical device with a servo, and its pair.
pub const JOINT: &str = "joint";
/// Number of rows in the history of each first half.
pub const HISTORY: usize = 8;

/// An interrupt source.
#[derive(Clone, Debug)]
pub struct Source {
    pub processor: String,
    /// Name including the name of the processor: `rtp0.t0`.
    pub name: String,
    /// Period of a timer; `None` for a software source.
    pub period_ns: Option<i64>,
    pub priority: u8,
    pub cost_ns: i64,
}

/// Kind of binding of a parameter, which determines the claims.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A written pair: parameters `<name>.a` and `<name>.b`.
    Pair,
    /// A read pair.
    Reads,
    /// A written array.
    Array,
    /// A written channel of the plant.
    Channel,
    /// The joint, passed as an object.
    Object,
}

#[derive(Clone, Debug)]
pub struct Parameter {
    pub name: String,
    pub kind: Kind,
}

#[derive(Clone, Debug)]
pub struct Verb {
    pub name: String,
    pub definition: Json,
    pub parameters: Vec<Parameter>,
    /// Default source of each block: label → source.
    pub placement: Vec<(String, usize)>,
    /// True if the verb uses a block of module `crashing`.
    pub crashes: bool,
    /// ψ values of a start in addition to the tag: name → maximum value.
    pub inputs: Vec<(&'static str, u64)>,
}

/// Transport of connections.
#[derive(Clone, Copy, Debug)]
pub enum Carrier {
    Memory,
    /// Messages, with the seed of their faults.
    Message(u64),
}

#[derive(Clone, Debug)]
pub struct Program {
    pub sources: Vec<Source>,
    pub clock_seed: u64,
    pub carrier: Carrier,
    /// Source that serves the plant, and number of outputs of the plant; the last output belongs to the joint.
    pub plant: (usize, usize),
    pub verbs: Vec<Verb>,
    /// Number of verbs defined at the beginning.
    pub begins_with: usize,
}

impl Program {
    pub fn random(numbers: &Numbers) -> Program {
        let mut draw = numbers.split("configuration");
        let sources = sources(&mut draw);
        let timers: Vec<usize> = (0..sources.len()).filter(|i| sources[*i].period_ns.is_some()).collect();
        let plant = (*draw.pick(&timers), 2 + draw.below(2));
        let carrier = if draw.percent(30) { Carrier::Memory } else { Carrier::Message(draw.number()) };
        let clock_seed = draw.number();
        let mut draw = numbers.split("verbs");
        let mut verbs = vec![push(&sources, *draw.pick(&timers))];
        verbs.extend(
            (0..6).map(|index| Making { sources: &sources, timers: &timers, plant, draw: draw.split(&format!("verb {index}")) }.verb(&format!("v{index}"))),
        );
        Program { sources, clock_seed, carrier, plant, verbs, begins_with: 5 }
    }

    pub fn max_cost_ns(&self) -> i64 {
        self.sources.iter().map(|source| source.cost_ns).max().unwrap_or(0)
    }

    /// Returns all pairs of SVVs that verbs write.
    pub fn pairs() -> Vec<String> {
        let own = (0..PAIRS).map(|i| format!("s{i}"));
        own.chain(ARBITRATED.iter().map(|device| (*device).to_owned())).chain([JOINT.to_owned()]).collect()
    }
}

fn sources(draw: &mut Numbers) -> Vec<Source> {
    let has_costs = draw.percent(50);
    let mut sources = Vec::new();
    for processor in 0..1 + draw.below(3) {
        for index in 0..1 + draw.below(3) {
            let is_timer = index == 0 || draw.percent(60);
            let period_ns = is_timer.then(|| *draw.pick(&[1, 1, 2, 4, 5]) * MS);
            let cost_ns = if has_costs && draw.percent(60) { draw.within(1, 25) * period_ns.unwrap_or(MS) / 100 } else { 0 };
            let name = format!("rtp{processor}.{}{index}", if is_timer { 't' } else { 'w' });
            sources.push(Source { processor: format!("rtp{processor}"), name, period_ns, priority: 90 - 10 * index as u8 - draw.below(5) as u8, cost_ns });
        }
    }
    sources
}

/// Returns the verb that acts on the joint.
fn push(sources: &[Source], at: usize) -> Verb {
    let every_ns = sources[at].period_ns;
    let definition = json!({
        "name": "push", "blocks": {"p0": {"block": {"subroutine": "sim.reporter"}}},
        "objects": {"joint": {"device_type": "Joint"}},
        "instantiation_parameters": {"joint.a": ["p0.a"], "joint.b": ["p0.b"]},
        "input_parameters": {"tag": {"targets": ["p0.tag"]}, "each": {"targets": ["p0.each"], "default": 0}},
        "output_values": {"p0a": "p0.a", "p0b": "p0.b"},
        "conditions": {"reached": {"on": ["p0.reached"], "returns": ["p0a", "p0b"]}, "halted": {"returns": ["p0a", "p0b"]}, "late": {"on": ["p0.late"], "returns": []}},
        "command_lists": {"one": {"commands": [{"command": "activate", "block": "p0", "every_ns": every_ns}]}},
    });
    Verb {
        name: "push".to_owned(),
        definition,
        parameters: vec![Parameter { name: "joint".to_owned(), kind: Kind::Object }],
        placement: vec![("p0".to_owned(), at)],
        crashes: false,
        inputs: vec![("each", 20)],
    }
}

/// Returns true if the block's output is an array.
fn is_array(of: &str) -> bool {
    matches!(of, "sim.many" | "crashing.torn")
}

/// Returns the SVVs to create, each as its name and request.
pub fn svvs() -> Vec<(String, Json)> {
    let mut svvs = Vec::new();
    for index in 0..PAIRS {
        svvs.push((format!("s{index}.a"), json!({"type_text": "double", "history": HISTORY})));
        svvs.push((format!("s{index}.b"), json!({"type_text": "double"})));
    }
    svvs.extend((0..ARRAYS).map(|index| (format!("v{index}"), json!({"type_text": format!("double[{MANY}]")}))));
    svvs
}

/// Returns the device types, and the servo of the joint.
pub fn device_types() -> Vec<Json> {
    let pair = |of: &str| json!({"name": of, "svvs": {"a": {"type_text": "double"}, "b": {"type_text": "double"}}, "arbitration": of});
    let mut types: Vec<Json> = ARBITRATED.iter().map(|of| pair(of)).collect();
    types.push(
        json!({"name": "Joint", "verb": "servo", "svvs": {"a": {"type_text": "double"}, "b": {"type_text": "double"}, "sensed": {"type_text": "double"}}}),
    );
    types
}

pub fn servo(every_ns: Option<i64>) -> Json {
    json!({
        "name": "servo", "blocks": {"servo": {"block": {"subroutine": "sim.servo"}}},
        "instantiation_parameters": {"drive.sensor": ["servo.sensor"], "drive.actuator": ["servo.actuator"], "a": ["servo.u"], "sensed": ["servo.sensed"]},
        "command_lists": {"start": {"commands": [{"command": "activate", "block": "servo", "every_ns": every_ns}, {"command": "ready"}]}},
    })
}
