// SPDX-License-Identifier: Apache-2.0
//! End of a run: every instance ends, everything can be started once more, and no object remains.
use crate::broken::{BrokenInvariant, broken, text};
use crate::invariants;
use crate::plant::{self, safe};
use crate::program::{JOINT, MS};
use crate::world::World;
use serde_json::json;

/// Time limit for an instance that was halted twice to end, ms of the system's clock; an instance that first comes to rest has its own
/// limit.
const END_MS: i64 = 200;

pub fn finale(world: &mut World) -> Result<Vec<String>, BrokenInvariant> {
    let mut told = Vec::new();
    {
        let mut ledger = plant::locked(&world.plant);
        (ledger.fails, ledger.gate) = (false, 0.0);
    }
    advance(world, 10 * MS)?;
    let ids: Vec<(String, u64)> =
        world.lives.of.iter().filter(|(_, life)| life.id != 0 && !life.is_deleted).map(|(name, life)| (name.clone(), life.id)).collect();
    for (name, id) in &ids {
        end(world, name, *id)?;
    }
    invariants::check(world)?;
    let reset = world.reset();
    if world.system.latched().is_some() || reset.contains("refused") {
        return broken("every start that is possible", format!("nothing runs and nothing is in the way; {reset}"));
    }
    // A device that has come back still needs its first reading.
    advance(world, 20 * MS)?;
    world.call("resume_program", json!({})).or_else(|why| broken("every start that is possible", text(&why)))?;
    for (index, (name, id)) in ids.iter().enumerate() {
        if world.lives.of[name].devices.contains(&JOINT) {
            enable(world)?;
        }
        let start = crate::operations::Operation { what: crate::operations::What::Start, caller: 0, a: index, b: 127, c: 1 };
        let words = world.start(start)?;
        told.push(words.clone());
        if words.contains("refused") {
            return broken("every start that is possible", format!("nothing is in the way; {words}"));
        }
        advance(world, 3 * MS)?;
        end(world, name, *id)?;
        invariants::check(world)?;
    }
    for (name, id) in &ids {
        world.call("delete", json!({"instance": id})).or_else(|why| broken("nothing is left", format!("'{name}' cannot be deleted: {}", text(&why))))?;
    }
    left(world)?;
    Ok(told)
}

fn advance(world: &mut World, duration_ns: i64) -> Result<(), BrokenInvariant> {
    world.system.advance(duration_ns).or_else(|why| broken("time goes on", text(&why)))
}

fn enable(world: &World) -> Result<(), BrokenInvariant> {
    let until_ns = world.system.now_ns() + 50 * MS;
    let enabled = world.call("enable", json!({"name": JOINT})).and_then(|_| world.call("wait_enabled", json!({"name": JOINT, "until_ns": until_ns})));
    match enabled {
        Ok(serde_json::Value::Bool(true)) => Ok(()),
        other => broken("every start that is possible", format!("'{JOINT}' is not enabled in 50 ms: {other:?}; it is {:?}", world.system.device_state(JOINT))),
    }
}

/// Halts an instance twice, after which it must have ended.
fn end(world: &mut World, name: &str, id: u64) -> Result<(), BrokenInvariant> {
    for _ in 0..2 {
        if matches!(world.system.state(id), "queued" | "running" | "suspended") {
            // The instance may end by itself meanwhile.
            let _halted = world.system.halt(id);
        }
    }
    if world.system.state(id) == "created" {
        return Ok(());
    }
    match world.has_ended_within(id, END_MS) {
        Ok(true) => Ok(()),
        Ok(false) => broken("stopping ends", format!("'{name}' was halted twice and is {} after {END_MS} ms", world.system.state(id))),
        Err(why) => broken("stopping ends", format!("'{name}': {}", text(&why))),
    }
}

/// Checks that no object remains.
fn left(world: &mut World) -> Result<(), BrokenInvariant> {
    world.call("disable", json!({"name": JOINT})).or_else(|why| broken("stopping ends", text(&why)))?;
    advance(world, invariants::grace_ns(&world.program))?;
    invariants::check(world)?;
    let statistics = world.system.statistics();
    let steps: Vec<String> =
        (statistics.sources.iter()).filter(|(_, source)| source.steps != 0).map(|(name, source)| format!("{} steps in '{name}'", source.steps)).collect();
    // The servo of the joint exists as long as the joint.
    if steps.len() > 1 || statistics.instances.len() != 1 {
        return broken("nothing is left", format!("{steps:?}, {:?}", statistics.instances));
    }
    world.system.close();
    let ledger = plant::locked(&world.plant);
    if ledger.outputs.iter().enumerate().any(|(index, value)| *value != safe(index)) {
        return broken("safe outputs", format!("after the close the outputs are {:?}", ledger.outputs));
    }
    if ledger.opened != ledger.closed {
        return broken("nothing is left", format!("the plant was opened {} times and closed {} times", ledger.opened, ledger.closed));
    }
    Ok(())
}
