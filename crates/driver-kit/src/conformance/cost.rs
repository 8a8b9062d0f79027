// SPDX-License-Identifier: Apache-2.0
//! Checks of the cost of an exchange: allocations, blocking, memory, and the age of its readings.
use super::check::{Check, CheckResult, PassedCheck, holds};
use super::measures::{allocated, allocations, printed, processor_ns, resident, waits};
use super::rig::{Joint, Rig};
use super::subject::Subject;
use device::Class;
use std::time::{Duration, Instant};

pub(super) const CHECKS: &[Check] = &[
    Check { name: "allocation", sentence: "an inline exchange allocates nothing", run: allocation },
    Check { name: "waiting", sentence: "an inline exchange does not wait", run: waiting },
    Check { name: "brief", sentence: "an inline exchange computes for less than 0.25 ms", run: brief },
    Check { name: "prints", sentence: "an exchange prints nothing", run: prints },
    Check { name: "memory", sentence: "memory use does not grow over many exchanges", run: memory },
    Check { name: "age", sentence: "readings of a worker have an age, and new ones arrive", run: age },
];

/// Number of warm-up firings before the measurement.
pub(super) const WARM: usize = 50;
/// Number of measured firings.
const MEASURED: usize = 500;
/// Time limit of the long check, whatever the number of exchanges.
const LONG: Duration = Duration::from_secs(15);
/// Maximum average CPU time of one inline exchange: a quarter of a cycle at 1 kHz.
const BRIEF_NS: i64 = 250_000;
/// Maximum growth of memory, bytes. Allows for pages that are touched for the first time.
const GROWTH: i64 = 256 << 10;

/// Runs firings in which channels are engaged and released, as by a program.
pub(super) fn mixed(rig: &mut Rig, joints: &[Joint], count: usize) -> Result<(), String> {
    for k in 0..count {
        if k % 3 == 0 {
            rig.let_go()
        } else {
            rig.hold(joints)
        }
        rig.cycle()?;
    }
    rig.let_go();
    Ok(())
}

fn allocation(subject: &Subject) -> CheckResult {
    if !subject.is_inline() {
        return Ok(PassedCheck::NotApplicable("it is not inline"));
    }
    let mut rig = subject.open()?;
    let joints = rig.joints();
    mixed(&mut rig, &joints, WARM)?;
    let (asked, held) = (allocations(), allocated());
    mixed(&mut rig, &joints, MEASURED)?;
    let (asked_then, held_then) = (allocations(), allocated());
    match (asked, asked_then) {
        (Some(before), Some(after)) => holds(after == before, || format!("{} times in {MEASURED} firings", after - before)),
        _ => holds(held_then <= held, || format!("{} more bytes are held after {MEASURED} firings", held_then - held)),
    }
}

fn waiting(subject: &Subject) -> CheckResult {
    if !subject.is_inline() {
        return Ok(PassedCheck::NotApplicable("it is not inline"));
    }
    let mut rig = subject.open()?;
    let joints = rig.joints();
    mixed(&mut rig, &joints, WARM)?;
    let before = waits();
    mixed(&mut rig, &joints, MEASURED)?;
    let waited = waits() - before;
    // A page fault from disk is a wait too, but a driver that waits by itself does so in each firing.
    holds(waited * 10 < MEASURED as i64, || format!("its thread gave up its processor {waited} times in {MEASURED} firings"))
}

fn brief(subject: &Subject) -> CheckResult {
    if !subject.is_inline() {
        return Ok(PassedCheck::NotApplicable("it is not inline"));
    }
    let mut rig = subject.open()?;
    let joints = rig.joints();
    mixed(&mut rig, &joints, WARM)?;
    let before_ns = processor_ns();
    mixed(&mut rig, &joints, WARM)?;
    let mean_ns = (processor_ns() - before_ns) / WARM as i64;
    holds(mean_ns <= BRIEF_NS, || format!("it computes for {:.2} ms, while everything on its source waits for it", mean_ns as f64 * 1e-6))
}

fn prints(subject: &Subject) -> CheckResult {
    let mut rig = subject.open()?;
    let joints = rig.joints();
    let (made, bytes) = printed(|| mixed(&mut rig, &joints, WARM)).map_err(|why| format!("what it prints cannot be counted: {why}"))?;
    made?;
    // A message in the first exchange or two is not one per exchange.
    holds(bytes < WARM as u64, || format!("it prints {bytes} bytes in {WARM} exchanges; each of them waits for the reader of the terminal"))
}

fn memory(subject: &Subject) -> CheckResult {
    let mut rig = subject.open()?;
    let joints = rig.joints();
    mixed(&mut rig, &joints, 4 * WARM)?;
    let (held, resident_before, begun) = (allocated(), resident(), Instant::now());
    let mut made = 0;
    while made < subject.exchanges && begun.elapsed() < LONG {
        mixed(&mut rig, &joints, WARM)?;
        made += WARM as u64;
    }
    let (more, pages) = (allocated() - held, resident() - resident_before);
    holds(more <= GROWTH && pages <= 16 * GROWTH, || format!("{made} exchanges hold {more} more bytes, and {pages} in pages"))
}

fn age(subject: &Subject) -> CheckResult {
    if subject.of.class != Class::Worker {
        return Ok(PassedCheck::NotApplicable("it is not a worker"));
    }
    let mut rig = Rig::new(subject.made()?);
    let Some(age) = rig.driver.channels().iter().find(|channel| channel.name == "age").cloned() else { return Err("there is no channel 'age'".to_owned()) };
    rig.open()?;
    let slot = device::Slot { offset: age.offset, len: age.len };
    let deadline = Instant::now() + Duration::from_secs(30);
    let (mut newest, mut older) = (f64::INFINITY, 0.0);
    // An age that decreases is that of a newer reading.
    while Instant::now() < deadline {
        rig.on_the_wall();
        rig.read()?;
        newest = slot.double(&rig.readings, 0);
        if !(newest.is_finite() && newest >= 0.0) || newest < older {
            break;
        }
        older = newest;
    }
    rig.driver.close();
    holds(newest.is_finite() && newest >= 0.0, || format!("it is {newest} s"))?;
    holds(newest < older, || "no newer reading has arrived within 30 s".to_owned())
}
