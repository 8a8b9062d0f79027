// SPDX-License-Identifier: Apache-2.0
//! Trial of a block without a system, guarded like firings: a failure is a fault of the block and does not end this process.
use crate::definitions::download::load;
use crate::refuse::{refuse, unknown};
use indexmap::IndexMap;
use model::interface::{Interface, Item, Kind};
use model::refusal::{Class, Refusals};
use model::types::Type;
use model::value::Value;
use opengpac::trial::Trial;
use runtime::Sandbox;
use serde_json::{Value as Json, json};
use std::path::Path;
use std::time::{Duration, Instant};

/// Maximum number of invocations in a trial; all values are kept until it ends.
const TIMES_MAX: usize = 10_000_000;

/// Request for a trial.
pub struct TrialRequest {
    /// Constant values by item.
    pub values: IndexMap<String, Value>,
    /// List of values for each input, one value per invocation.
    pub inputs: IndexMap<String, Vec<Value>>,
    pub times: usize,
    /// Interval between invocations.
    pub period_ns: i64,
    /// True if the interpreter of this process executes the block's body.
    pub is_interpreted: bool,
}

/// Trial of a block.
pub struct BlockTrial {
    trial: Trial,
    interface: Interface,
    given: TrialRequest,
    size: Option<u32>,
    sandbox: Sandbox,
    time: usize,
    outputs: IndexMap<String, Vec<Value>>,
    conditions: Vec<Json>,
    fault: Json,
}

/// Prepares a trial of a block of a module, or of the `library`, without running it.
pub fn trial(module: &str, block: &str, given: TrialRequest, python: &str) -> Result<BlockTrial, Refusals> {
    if given.times > TIMES_MAX {
        let message = format!("a trial of {} invocations is too long", given.times);
        return Err(refuse(Class::OutOfRange, message, format!("ask for at most {TIMES_MAX}")));
    }
    let loaded;
    let (faces, types) = if module == "library" {
        let (faces, types) = library::faces();
        (faces, types)
    } else {
        loaded = load(Path::new(module), python)?;
        (&loaded.blocks, &loaded.types)
    };
    let names = || faces.iter().map(|f| f.name.as_str());
    let Some(face) = faces.iter().find(|f| f.name == block).cloned() else { return Err(unknown("block", block, names())) };
    let declarations: IndexMap<String, String> = types.iter().map(|t| (t.name.clone(), t.declaration.clone())).collect();
    let interface = crate::definitions::faces::interface(module, &face, &declarations);
    let size = size_of(&interface, &given.values, &given.inputs)?;
    let mut trial = Trial::of(face);
    trial.period_ns = given.period_ns;
    if let Some(item) = interface.items.iter().find(|i| i.kind == Kind::Size) {
        // The size comes first: the lengths of other items depend on it.
        put(&mut trial, &interface, &item.name, &Value::Integer(0), size)?;
    }
    for (name, value) in &given.values {
        put(&mut trial, &interface, name, value, size)?;
    }
    let outputs = interface.items.iter().filter(|i| is_shown(i)).map(|i| (i.name.clone(), Vec::new())).collect();
    let sandbox = if given.is_interpreted { Sandbox::interpreted() } else { Sandbox::new() };
    Ok(BlockTrial { trial, interface, given, size, sandbox, time: 0, outputs, conditions: Vec::new(), fault: Json::Null })
}

fn is_shown(item: &Item) -> bool {
    matches!(item.kind, Kind::Output | Kind::DeviceWrite)
}

impl BlockTrial {
    /// Runs the trial for about `slice` on the calling thread; returns false when it is finished.
    pub fn go_on(&mut self, slice: Duration) -> Result<bool, Refusals> {
        let begun = Instant::now();
        while self.time < self.given.times && self.fault.is_null() {
            self.invoke()?;
            self.time += 1;
            if begun.elapsed() > slice {
                break;
            }
        }
        Ok(self.time < self.given.times && self.fault.is_null())
    }

    /// Returns the values of each output, the conditions as (invocation, name, value or null), and the fault that ended the trial, if
    /// any.
    pub fn json(self) -> Json {
        json!({ "outputs": self.outputs, "conditions": self.conditions, "fault": self.fault })
    }

    fn invoke(&mut self) -> Result<(), Refusals> {
        let (trial, interface, size) = (&mut self.trial, &self.interface, self.size);
        for (name, values) in &self.given.inputs {
            if let Some(value) = values.get(self.time).or_else(|| values.last()) {
                put(trial, interface, name, value, size)?;
            }
        }
        // SAFETY: the instance belongs to the trial; it is not run again after a fault.
        let ran = trial.run_by(|run, instance, invocation| unsafe { self.sandbox.call(run, instance, invocation) });
        if let Err(why) = ran {
            self.fault = json!({"invocation": self.time, "text": why.to_string()});
            return Ok(());
        }
        for item in interface.items.iter().filter(|i| is_shown(i)) {
            let of = Type::parse_sized(&item.type_text, &interface.types, size).map_err(|r| vec![r])?;
            let bytes = trial.get(&item.name).map_err(|why| refuse(Class::ValueRefused, why.to_string(), ""))?;
            self.outputs[&item.name].push(of.decode(&bytes[..of.size().min(bytes.len())]));
        }
        for name in trial.reported() {
            let value = reported(trial, interface, &name, size)?;
            self.conditions.push(json!([self.time, name, value]));
        }
        Ok(())
    }
}

/// Returns the size n of a sized block: the passed value, or the length of a sized item's value.
fn size_of(interface: &Interface, values: &IndexMap<String, Value>, inputs: &IndexMap<String, Vec<Value>>) -> Result<Option<u32>, Refusals> {
    let Some(item) = interface.items.iter().find(|i| i.kind == Kind::Size) else { return Ok(None) };
    if let Some(Value::Integer(n)) = values.get(&item.name) {
        return Ok(u32::try_from(*n).ok());
    }
    let sized = |name: &str| interface.items.iter().any(|i| i.name == name && i.sized);
    let given = values.iter().filter(|(name, _)| sized(name)).map(|(_, v)| v);
    let first = inputs.iter().filter(|(name, _)| sized(name)).filter_map(|(_, v)| v.first());
    match given.chain(first).find_map(|v| if let Value::List(list) = v { Some(list.len()) } else { None }) {
        Some(len) if (item.least as usize..=item.most as usize).contains(&len) => Ok(u32::try_from(len).ok()),
        Some(len) => Err(refuse(Class::ValueRefused, format!("'{}' takes {} to {} elements, not {len}", interface.name, item.least, item.most), "")),
        None => Ok(Some(item.least)),
    }
}

fn put(trial: &mut Trial, interface: &Interface, name: &str, value: &Value, size: Option<u32>) -> Result<(), Refusals> {
    let Some(item) = interface.items.iter().find(|i| i.name == name) else {
        return Err(unknown(&format!("item of '{}' named", interface.name), name, interface.items.iter().map(|i| i.name.as_str())));
    };
    let bytes = if item.kind == Kind::Size {
        size.unwrap_or(item.least).to_le_bytes().to_vec()
    } else {
        let of = Type::parse_sized(&item.type_text, &interface.types, size).map_err(|r| vec![r])?;
        of.encode(value, &item.unit).map_err(|r| vec![crate::starting::psi::named(r, name)])?
    };
    trial.set(name, &bytes).map_err(|why| refuse(Class::ValueRefused, why.to_string(), ""))
}

/// Returns the value reported by a condition, if it has one.
fn reported(trial: &Trial, interface: &Interface, name: &str, size: Option<u32>) -> Result<Option<Value>, Refusals> {
    let Some(item) = interface.items.iter().find(|i| i.name == name && !i.type_text.is_empty()) else { return Ok(None) };
    let of = Type::parse_sized(&item.type_text, &interface.types, size).map_err(|r| vec![r])?;
    let bytes = trial.get(name).map_err(|why| refuse(Class::ValueRefused, why.to_string(), ""))?;
    Ok(Some(of.decode(&bytes)))
}
