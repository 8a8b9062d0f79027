// SPDX-License-Identifier: Apache-2.0
//! Runs one seed from beginning to end.
use crate::broken::BrokenInvariant;
use crate::operate::carry_out;
use crate::operations::{self, Operation};
use crate::outcome::{Failure, Outcome};
use crate::seed::Numbers;
use crate::world::World;
use crate::{door, finale, invariants, plant};
use std::cell::RefCell;
use std::mem::ManuallyDrop;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

/// Number of log entries shown for a failure.
const LOG: usize = 25;

thread_local! {
    /// Location and message of the last panic.
    static PANIC: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Stores panics instead of printing them, because blocks panic on purpose.
fn keep_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        std::panic::set_hook(Box::new(|info| {
            let text = info.to_string();
            if std::env::var_os("SIMULATE_PANICS").is_some() {
                eprintln!("{text}");
            }
            PANIC.with_borrow_mut(|panic| *panic = text);
        }));
    });
}

/// Runs a seed, or only those of its operations that are in `kept`.
pub fn run(seed: u64, kept: Option<&[usize]>) -> Outcome {
    keep_panics();
    crate::blocks::wrong();
    if door::is_of(seed) {
        return through_the_door(seed, kept);
    }
    let numbers = Numbers::of(seed);
    let all = operations::random(&numbers);
    let chosen: Vec<(usize, Operation)> = match kept {
        None => all.into_iter().enumerate().collect(),
        Some(kept) => kept.iter().filter_map(|index| Some((*index, *all.get(*index)?))).collect(),
    };
    let mut outcome = Outcome { operations: chosen.len(), ..Outcome::default() };
    let broken = match catch_unwind(AssertUnwindSafe(|| told(&numbers, &chosen, &mut outcome))) {
        Ok(Ok(())) => None,
        Ok(Err(broken)) => Some(broken),
        Err(_) => Some(BrokenInvariant { invariant: "no panic", text: PANIC.take() }),
    };
    plant::forget();
    outcome.failure = broken.map(|broken| Failure { seed, broken, kept: chosen.iter().map(|(index, _)| *index).collect(), story: outcome.story.clone() });
    outcome
}

/// Runs a seed of the world with a control interface.
fn through_the_door(seed: u64, kept: Option<&[usize]>) -> Outcome {
    let mut outcome = Outcome::default();
    let (kept, broken) = match catch_unwind(AssertUnwindSafe(|| door::run(seed, kept, &mut outcome))) {
        Ok((kept, result)) => (kept, result.err()),
        Err(_) => (Vec::new(), Some(BrokenInvariant { invariant: "no panic", text: PANIC.take() })),
    };
    outcome.failure = broken.map(|broken| Failure { seed, broken, kept, story: outcome.story.clone() });
    outcome
}

fn told(numbers: &Numbers, chosen: &[(usize, Operation)], outcome: &mut Outcome) -> Result<(), BrokenInvariant> {
    // A world in which something has panicked cannot be closed, and is leaked.
    let mut world = ManuallyDrop::new(World::new(numbers)?);
    outcome.story.append(&mut world.story);
    let result = steps(&mut world, chosen, &mut outcome.story).and_then(|()| {
        outcome.story.push(format!("{:>9} us  finale", world.system.now_ns() / 1_000));
        outcome.story.extend(finale::finale(&mut world)?);
        Ok(())
    });
    (outcome.accepted, outcome.refused) = world.counts;
    outcome.starts = world.lives.of.values().map(|life| life.started).sum();
    outcome.virtual_ns = world.system.now_ns();
    if result.is_err() {
        // A broken world is not closed in order.
        outcome.story.push(format!("{:>9} us  here it does not hold; the end of the log:", world.system.now_ns() / 1_000));
        let entries = world.system.log_since(0);
        let last = entries
            .iter()
            .skip(entries.len().saturating_sub(LOG))
            .map(|entry| format!("{:>12.3} ms  {}  {}  {}", entry.time_s * 1e3, entry.kind, entry.about, entry.text));
        outcome.story.extend(last);
    }
    drop(ManuallyDrop::into_inner(world));
    result
}

fn steps(world: &mut World, chosen: &[(usize, Operation)], story: &mut Vec<String>) -> Result<(), BrokenInvariant> {
    for (index, operation) in chosen {
        let now_us = world.system.now_ns() / 1_000;
        story.push(format!("{now_us:>9} us  [{index}] {:?}", operation.what));
        let words = carry_out(world, *operation)?;
        if let Some(last) = story.last_mut() {
            *last = format!("{now_us:>9} us  [{index}] {words}");
        }
        invariants::check(world)?;
        let waited = world.poll();
        if !waited.is_empty() {
            story.extend(waited.into_iter().map(|words| format!("{:>12}  {words}", "")));
            invariants::check(world)?;
        }
    }
    Ok(())
}
