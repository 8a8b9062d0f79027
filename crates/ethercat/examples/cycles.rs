// SPDX-License-Identifier: Apache-2.0
//! Exchanges with the driver in its cycle, as a source does. `cycles INTERFACE AXES SECONDS PRIORITY` engages all axes at 1 kHz on a
//! thread with that real-time priority (0 for none), counts the allocations of the cycles, and prints their lateness and duration, ns, as
//! JSON.
use device::{DeviceError, Driver};
use serde_json::{Value, json};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::f64::consts::TAU;

const PERIOD_NS: i64 = 1_000_000;
const COUNTS: f64 = 10_000.0;
/// Number of cycles in which all axes are enabled, before measurements begin.
const BEGINS: usize = 1_000;

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: every call is forwarded to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller upholds the same contract.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(place, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

fn main() -> Result<(), String> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [interface, axes, seconds, priority] = arguments.as_slice() else { return Err("cycles INTERFACE AXES SECONDS PRIORITY".to_owned()) };
    let number = |text: &String| text.parse::<usize>().map_err(|error| format!("{text}: {error}"));
    let (axes, cycles) = (number(axes)?, number(seconds)? * 1_000);
    device::register(&ethercat::DRIVER).map_err(|error| error.to_string())?;
    let all: Vec<Value> = (0..axes).map(|axis| json!({ "name": format!("a{axis}"), "counts": COUNTS, "speed_max": 5 })).collect();
    // Only a minute without any frame ends the exchange, so that delays of a busy machine do not.
    let options = json!({ "interface": interface, "axes": all, "lost_after": 60_000, "timeout_ns": 6_000_000_000_i64 });
    let (mut driver, _) = device::open("ethercat", &options).map_err(|error| error.to_string())?;
    let wanted = u8::try_from(number(priority)?).map_err(|_| format!("priority {priority}: 0 to 99"))?;
    if wanted > 0 && !scheduling::prioritise(wanted, scheduling::Children::Ordinary) {
        return Err(format!("priority {priority}: no permission for real-time scheduling"));
    }
    driver.open(now_ns()).map_err(|error| error.message)?;
    let measured = exchange(&mut *driver, axes, cycles).map_err(|error| error.message)?;
    let counters = driver.counters().into_iter().flat_map(|of| of.all().map(|(word, count)| (word.name, count)).collect::<Vec<_>>());
    let counters: Value = counters.map(|(name, count)| (name.to_owned(), Value::from(count))).collect::<serde_json::Map<_, _>>().into();
    driver.close();
    let CycleMeasurements { lateness, spans, allocations, skipped, moved } = measured;
    println!(
        "{}",
        json!({ "cycles": spans.len(), "allocations": allocations, "skipped": skipped, "moved": moved, "lateness": said(lateness), "exchange": said(spans), "counters": counters })
    );
    Ok(())
}

struct CycleMeasurements {
    lateness: Vec<u64>,
    spans: Vec<u64>,
    allocations: u64,
    /// Number of releases that were skipped because of late cycles.
    skipped: u64,
    /// Range of positions covered by the first axis, rad.
    moved: f64,
}

fn exchange(driver: &mut dyn Driver, axes: usize, cycles: usize) -> Result<CycleMeasurements, DeviceError> {
    let position = driver.channels().iter().find(|channel| channel.name == "a0.position").map_or(0, |channel| channel.offset);
    let (mut readings, mut commands, engaged) = (vec![0; 128 * axes], vec![0; 8 * axes], vec![true; axes]);
    let mut measured = CycleMeasurements { lateness: Vec::with_capacity(cycles), spans: Vec::with_capacity(cycles), allocations: 0, skipped: 0, moved: 0.0 };
    let (mut minimum, mut maximum) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut release_ns = now_ns() + PERIOD_NS;
    for cycle in 0..BEGINS + cycles {
        sleep_until(release_ns);
        let began_ns = now_ns();
        // One full swing per second.
        let goal = 0.2 * (cycle as f64 * 1e-3 * TAU).sin();
        commands.chunks_exact_mut(8).for_each(|command| command.copy_from_slice(&goal.to_ne_bytes()));
        let before = ALLOCATIONS.with(Cell::get);
        driver.read(release_ns, &mut readings)?;
        driver.write(release_ns, &commands, &engaged)?;
        let allocated = ALLOCATIONS.with(Cell::get) - before;
        if cycle >= BEGINS {
            measured.allocations += allocated;
            measured.lateness.push((began_ns - release_ns) as u64);
            measured.spans.push((now_ns() - began_ns) as u64);
            let mut eight = [0; 8];
            eight.copy_from_slice(&readings[position..position + 8]);
            (minimum, maximum) = (minimum.min(f64::from_ne_bytes(eight)), maximum.max(f64::from_ne_bytes(eight)));
        }
        let missed = (now_ns() - release_ns) / PERIOD_NS;
        measured.skipped += missed as u64;
        release_ns += (missed + 1) * PERIOD_NS;
    }
    measured.moved = maximum - minimum;
    Ok(measured)
}

fn said(mut values: Vec<u64>) -> Value {
    values.sort_unstable();
    let at = |part: f64| values.get(((values.len() as f64 * part) as usize).min(values.len().saturating_sub(1))).copied();
    json!({ "median": at(0.5), "p999": at(0.999), "maximum": at(1.0) })
}

fn now_ns() -> i64 {
    let mut now = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is valid for the call.
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &raw mut now) };
    now.tv_sec * 1_000_000_000 + now.tv_nsec
}

fn sleep_until(ns: i64) {
    let until = libc::timespec { tv_sec: ns / 1_000_000_000, tv_nsec: ns % 1_000_000_000 };
    // SAFETY: the struct is valid for the call; an interrupted sleep starts a cycle early, once.
    unsafe { libc::clock_nanosleep(libc::CLOCK_MONOTONIC, libc::TIMER_ABSTIME, &raw const until, std::ptr::null_mut()) };
}
