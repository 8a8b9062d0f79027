// SPDX-License-Identifier: Apache-2.0
//! Invariants that are checked after each operation.
use crate::blocks::{MANY, decode, is_whole, wrong};
use crate::broken::{BrokenInvariant, broken, text};
use crate::plant::{self, safe};
use crate::program::{ARRAYS, HISTORY, JOINT, MS, PAIRS, Program};
use crate::world::World;
use model::value::Value;

/// Checks all invariants after an operation.
pub fn check(world: &mut World) -> Result<(), BrokenInvariant> {
    world.catch_up()?;
    states(world)?;
    if let Some(shared) = world.lives.shared_claim() {
        return broken("one writer", shared);
    }
    reports(world)?;
    blocks()?;
    writes(world)?;
    outputs(world)?;
    snapshot(world)?;
    histories(world)
}

/// Checks that the log and the state of each instance agree: every accepted start is in the log, and every start except the current one
/// has an end.
fn states(world: &World) -> Result<(), BrokenInvariant> {
    for (name, life) in world.lives.of.iter().filter(|(_, life)| life.id != 0) {
        let state = if life.is_deleted { "ended" } else { world.system.state(life.id) };
        let under_way = matches!(state, "queued" | "running" | "suspended");
        if life.started != life.accepted || life.is_busy() != under_way {
            let (accepted, started, ended) = (life.accepted, life.started, life.ended);
            return broken("one end for each start", format!("'{name}' is {state}: {accepted} starts were accepted, the log has {started} and {ended} ends"));
        }
    }
    Ok(())
}

/// Checks that each end has exactly one report, which belongs to its start and contains the values of one invocation.
fn reports(world: &mut World) -> Result<(), BrokenInvariant> {
    for end in world.system.ends_since(world.ends_read) {
        world.ends_read = end.number + 1;
        let report = end.report;
        let Some(life) = world.lives.of.get_mut(&report.instance).filter(|life| !life.is_lost) else { continue };
        life.reports += 1;
        if report.start != life.reports || life.id != 0 && end.instance != life.id {
            return broken("one end for each start", format!("'{}' has report {} of start {}", report.instance, life.reports, report.start));
        }
        let number = |name: &str| match report.outputs.get(name) {
            Some(Some(Value::Number(number))) => Some(*number),
            _ => None,
        };
        for index in 0..3 {
            let (Some(a), Some(b)) = (number(&format!("p{index}a")), number(&format!("p{index}b"))) else { continue };
            if !is_whole(a, b) {
                return broken(
                    "atomic publication",
                    format!("the report of '{}' ({}) has {:?} and {:?} of block p{index}", report.instance, report.condition, decode(a), decode(b)),
                );
            }
            // If the ending list reports within the same instant, ω of an end may be from that list: a known fault.
            let concludes = !world.program.verbs[life.verb].definition["ending"].is_null();
            let is_own = report.condition == format!("reached_p{index}") && !concludes;
            if let (true, Some(Value::Number(value))) = (is_own, &report.value)
                && *value != a
            {
                return broken("atomic publication", format!("'{}' reported {:?} and returned {:?}", report.instance, decode(*value), decode(a)));
            }
        }
    }
    for (name, life) in world.lives.of.iter().filter(|(_, life)| !life.is_lost) {
        if life.reports != life.ended {
            return broken("one end for each start", format!("'{name}' has {} ends in the log and {} reports", life.ended, life.reports));
        }
    }
    Ok(())
}

/// Checks the values that blocks have read.
fn blocks() -> Result<(), BrokenInvariant> {
    match wrong().into_iter().next() {
        Some(text) => broken("atomic publication", text),
        None => Ok(()),
    }
}

/// Checks that every output is either safe or was written by a running start that claims the channel.
fn writes(world: &mut World) -> Result<(), BrokenInvariant> {
    let writes = std::mem::take(&mut plant::locked(&world.plant).writes);
    let joint = world.program.plant.1 - 1;
    for write in writes {
        for (index, (value, is_engaged)) in write.outputs.iter().enumerate() {
            if !is_engaged && *value != safe(index) {
                return broken("safe outputs", format!("output {index}, which nobody claims, is {value} at {} us", write.time_ns / 1_000));
            }
            let (true, Some((tag, number))) = (*is_engaged && index != joint, decode(*value)) else { continue };
            let run = world.lives.runs.get(&tag);
            let is_right = run.is_some_and(|(name, run)| {
                let claims = world.lives.of[name].has_claim(&format!("channel {index}"));
                let grace_ns = grace_ns(&world.program);
                claims && run.is_some_and(|run| run.begun_ns - grace_ns <= write.time_ns && run.ended_ns.is_none_or(|ended| write.time_ns <= ended + grace_ns))
            });
            if !is_right {
                return broken(
                    "writes by claimants",
                    format!("output {index} gets invocation {number} of start {tag} at {} us; that is {run:?}", write.time_ns / 1_000),
                );
            }
        }
    }
    Ok(())
}

/// Returns the time after an end during which values may still arrive: 0, unless firings have a duration, in which case the current one
/// must finish first.
pub fn grace_ns(program: &Program) -> i64 {
    match program.max_cost_ns() {
        0 => 0,
        cost_ns => 3 * cost_ns + MS,
    }
}

/// Checks that unclaimed outputs are safe, and that all outputs are safe after an emergency stop.
fn outputs(world: &mut World) -> Result<(), BrokenInvariant> {
    let now_ns = world.system.now_ns();
    let is_latched = world.system.latched().is_some();
    let joint = world.program.plant.1 - 1;
    let is_disabled = world.system.device_state(JOINT) == Ok("disabled");
    let outputs = plant::locked(&world.plant).outputs.clone();
    for (index, value) in outputs.into_iter().enumerate() {
        let claim = format!("channel {index}");
        let is_claimed = if index == joint { !is_disabled } else { world.lives.of.values().any(|life| life.runs() && life.has_claim(&claim)) };
        if is_claimed && !is_latched {
            world.free_since[index] = None;
            continue;
        }
        let since_ns = *world.free_since[index].get_or_insert(now_ns);
        if value != safe(index) && now_ns - since_ns >= grace_ns(&world.program) && !is_standing(world, world.program.plant.0) {
            let why = if is_latched { "the emergency stop is latched" } else { "nobody claims it" };
            return broken(
                "safe outputs",
                format!("output {index} is {value} ({:?}) at {} us; {why} since {} us", decode(value), now_ns / 1_000, since_ns / 1_000),
            );
        }
    }
    Ok(())
}

/// Returns true if a source is stalled or has just resumed.
pub fn is_standing(world: &World, source: usize) -> bool {
    world.stalled_ns[source].saturating_add(grace_ns(&world.program)) >= world.system.now_ns()
}

/// Checks that the outputs of one block in one snapshot come from one invocation, carry its number, and were stored while its start was
/// running.
fn snapshot(world: &World) -> Result<(), BrokenInvariant> {
    if (0..world.program.sources.len()).any(|source| is_standing(world, source)) || !world.lives.lost.is_empty() {
        return Ok(());
    }
    let pairs = Program::pairs();
    let halves = pairs.iter().flat_map(|pair| [format!("{pair}.a"), format!("{pair}.b")]);
    let names: Vec<String> = halves.chain((0..ARRAYS).map(|index| format!("v{index}"))).collect();
    let before_ns = world.system.now_ns();
    let (_, readings) = match world.system.read(&names) {
        Ok(read) => read,
        Err(why) => return broken("what is asked is answered", format!("a snapshot is refused: {}", text(&why))),
    };
    // The snapshot may come after a command that waits for the end of a firing.
    if world.system.now_ns() - before_ns > grace_ns(&world.program) {
        return broken("what is asked is answered", format!("a snapshot took {} us", (world.system.now_ns() - before_ns) / 1_000));
    }
    let number = |bytes: &[u8]| f64::from_le_bytes(bytes[..8].try_into().expect("a double has eight bytes"));
    for (pair, reading) in pairs.iter().zip(readings.chunks(2)) {
        let (a, b) = (number(&reading[0].0), number(&reading[1].0));
        let (Some((tag, invocation)), true) = (decode(a), decode(b).is_some()) else { continue };
        if !is_whole(a, b) {
            return broken("atomic publication", format!("a snapshot has {:?} in '{pair}.a' and {:?} in '{pair}.b'", decode(a), decode(b)));
        }
        if (reading[0].1, reading[0].2) != (reading[1].1, reading[1].2) || reading[0].1 != invocation {
            return broken(
                "atomic publication",
                format!(
                    "invocation {invocation} in '{pair}' bears the numbers {} and {}, the times {} and {}",
                    reading[0].1, reading[1].1, reading[0].2, reading[1].2
                ),
            );
        }
        let Some((name, Some(run))) = world.lives.runs.get(&tag) else {
            return broken("writes by claimants", format!("'{pair}' has a value of start {tag}, which has not begun"));
        };
        let (time_ns, grace_ns) = (reading[0].2, grace_ns(&world.program));
        if time_ns < run.begun_ns - grace_ns || run.ended_ns.is_some_and(|ended| time_ns > ended + grace_ns) {
            return broken("writes by claimants", format!("'{pair}' has a value of {time_ns} ns of '{name}', which ran {run:?}"));
        }
    }
    for (index, reading) in readings[2 * pairs.len()..].iter().enumerate() {
        let elements: Vec<f64> = reading.0.chunks(8).map(number).collect();
        if elements.len() != MANY {
            return broken("atomic publication", format!("'v{index}' has {} elements", elements.len()));
        }
        if let Some(at) = elements.iter().position(|element| *element != elements[0]) {
            let (first, other) = (decode(elements[0]), decode(elements[at]));
            return broken("atomic publication", format!("'v{index}' has {first:?} in its first element and {other:?} in element {at}"));
        }
        if let Some((tag, invocation)) = decode(elements[0])
            && reading.1 != invocation
        {
            return broken("atomic publication", format!("'v{index}' has invocation {invocation} of start {tag} with number {}", reading.1));
        }
    }
    Ok(())
}

/// Checks that a history has at most the declared number of rows, in order, each with its number.
fn histories(world: &World) -> Result<(), BrokenInvariant> {
    for index in 0..PAIRS {
        let name = format!("s{index}.a");
        let rows = world.system.history(&name, 10 * HISTORY).or_else(|why| broken("what is asked is answered", text(&why)))?;
        if rows.len() > HISTORY {
            return broken("bounded memory", format!("the history of '{name}' has {} rows", rows.len()));
        }
        let mut last: Option<(i64, u64, i64)> = None;
        for (number, time_ns, bytes) in rows {
            let value = f64::from_le_bytes(bytes[..8].try_into().expect("a double has eight bytes"));
            let Some((tag, invocation)) = decode(value) else { continue };
            // A delayed firing carries the time of its release, and values executed meanwhile a later one.
            let is_near = |at: i64| time_ns != at && (time_ns - at).abs() <= grace_ns(&world.program);
            let is_after = last.is_none_or(|(before, of, at)| is_near(at) || time_ns >= at && (tag != before || invocation > of));
            if number != invocation || !is_after {
                return broken(
                    "atomic publication",
                    format!("the history of '{name}' has invocation {invocation} of start {tag} with number {number} at {time_ns} ns, after {last:?}"),
                );
            }
            last = Some((tag, invocation, time_ns));
        }
    }
    Ok(())
}
