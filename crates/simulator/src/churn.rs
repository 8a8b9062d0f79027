// SPDX-License-Identifier: Apache-2.0
//! Bounded memory and work: an instance that is repeatedly created, started, halted and deleted must cost as much at the end as at the
//! beginning. The binary's allocator counts the allocations made by the system alone, and all live bytes.
use crate::broken::{BrokenInvariant, broken, text};
use crate::memory::{counted, counts};
use crate::operations::{Operation, What};
use crate::plant;
use crate::program::MS;
use crate::world::World;
use serde_json::json;

/// Numbers of rounds: for warm-up, in each of the two measurements, and between the measurements.
const WARM: usize = 4;
const MEASURED: usize = 8;
const BETWEEN: usize = 40;
/// Bytes per round that the log, the end reports and the simulator's own records may take.
const KEPT: i64 = 10 * 1024;

pub fn churn(world: &mut World, of: Operation) -> Result<String, BrokenInvariant> {
    {
        let mut ledger = plant::locked(&world.plant);
        (ledger.fails, ledger.gate) = (false, 0.0);
    }
    world.system.advance(10 * MS).or_else(|why| broken("time goes on", text(&why)))?;
    for call in ["reset", "resume_program"] {
        if let Err(why) = world.call(call, json!({})) {
            return Ok(format!("no churn: {}", text(&why)));
        }
    }
    world.lives.lost.clear();
    for _ in 0..WARM {
        if let Some(why) = round(world, of)? {
            return Ok(format!("no churn: {why}"));
        }
    }
    let first = rounds(world, of, MEASURED)?;
    rounds(world, of, BETWEEN)?;
    let last = rounds(world, of, MEASURED)?;
    let words = format!("{MEASURED} rounds made {} allocations, and {} after {BETWEEN} more; {} and {} bytes more live", first.0, last.0, first.1, last.1);
    // Rounds differ by their timing relative to the firings, and by lost messages.
    if last.0 > first.0 + first.0 / 2 + 200 || last.1 > MEASURED as i64 * KEPT {
        return broken("bounded memory and work", words);
    }
    Ok(words)
}

/// Runs rounds. Returns the number of allocations and the increase in live bytes.
fn rounds(world: &mut World, of: Operation, count: usize) -> Result<(u64, i64), BrokenInvariant> {
    world.work = 0;
    let before = counts().0;
    for _ in 0..count {
        round(world, of)?;
    }
    Ok((world.work, counts().0 - before))
}

/// Runs one life cycle of an instance. Returns the reason if this is not possible.
fn round(world: &mut World, of: Operation) -> Result<Option<String>, BrokenInvariant> {
    let words = world.create(Operation { c: 1, ..of });
    let made = world.made();
    let Some(name) = made.last().filter(|name| words.starts_with(&format!("create '{name}'"))).cloned() else { return Ok(Some(words)) };
    let id = world.lives.of[&name].id;
    let start = Operation { what: What::Start, caller: 0, a: made.len() - 1, b: 127, c: 1 };
    let words = world.start(start)?;
    let is_refused = words.contains("refused");
    if !is_refused {
        let _advanced = world.told("advance", json!({"duration_ns": 3 * MS}));
        for _ in 0..2 {
            let (system, work) = (&world.system, &mut world.work);
            let _halted = counted(work, || system.halt(id));
        }
        let _waited = world.told("wait", json!({"instance": id, "timeout_ns": 200 * MS}));
    }
    let (words, result) = world.told("delete", json!({"instance": id}));
    world.catch_up()?;
    if result.is_err() {
        return broken("stopping ends", format!("'{name}' was halted twice; delete: {words}"));
    }
    world.lives.of[&name].is_deleted = true;
    // The observations of blocks and the outputs to the plant are checked as after each operation.
    crate::invariants::check(world)?;
    Ok(is_refused.then_some(words))
}
