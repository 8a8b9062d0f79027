// SPDX-License-Identifier: Apache-2.0
//! Round-trip time of a frame with the process data of all drives: `exchange INTERFACE DRIVES TIMES` prints the median in ns.
use ethercat::main_device::{Bus, Cycle, FrameAnswer, Pdos, SubdeviceSettings, bring_up, open_link, take};
use ethercat::registers::AL_CONTROL;
use ethercat::states::State;
use std::time::{Duration, Instant};

const WATCHDOG_NS: i64 = 6_000_000_000;
const LONG: Duration = Duration::from_secs(10);
/// Control words that lead to the operational state, with velocity 0.
const WORDS: [u16; 4] = [0x80, 0x06, 0x07, 0x0F];

fn main() -> Result<(), String> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [interface, drives, times] = arguments.as_slice() else { return Err("exchange INTERFACE DRIVES TIMES".to_owned()) };
    let number = |text: &String| text.parse::<usize>().map_err(|error| format!("{text}: {error}"));
    let mut bus = Bus::open(interface)?;
    let wanted: Vec<SubdeviceSettings<'_>> =
        (0..number(drives)?).map(|position| SubdeviceSettings { position, pdos: &Pdos::Device, settings: &[], is_synced: true }).collect();
    let found = take(&mut bus)?;
    let line = bring_up(&mut bus, &found, &wanted, WATCHDOG_NS, None)?;
    let mut cycle = Cycle::new(open_link(interface)?, &line).ok_or("the process data do not fit into a frame")?;
    exchange(&mut cycle)?;
    for station in &line.stations {
        bus.write(station.subdevice.station, AL_CONTROL, &(State::Op as u16).to_le_bytes())?;
    }
    for word in WORDS {
        for station in &line.stations {
            let outputs = &mut cycle.outputs()[station.outputs_at..];
            outputs[..2].copy_from_slice(&word.to_le_bytes());
            outputs[12] = 9;
        }
        exchange(&mut cycle)?;
    }
    let mut spans: Vec<u64> = Vec::new();
    for _ in 0..number(times)? {
        let begun = Instant::now();
        exchange(&mut cycle)?;
        spans.push(begun.elapsed().as_nanos() as u64);
    }
    spans.sort_unstable();
    println!("{}", spans.get(spans.len() / 2).copied().unwrap_or(0));
    Ok(())
}

/// Makes one round trip, polling without a pause as SOEM does.
fn exchange(cycle: &mut Cycle) -> Result<(), String> {
    let failed = |error: std::io::Error| error.to_string();
    cycle.send(None).map_err(failed)?;
    let until = Instant::now() + LONG;
    while Instant::now() < until {
        match cycle.receive(|_| {}).map_err(failed)? {
            FrameAnswer::Whole => return Ok(()),
            FrameAnswer::Short => return Err("not all drives take their process data".to_owned()),
            FrameAnswer::Nothing | FrameAnswer::NotAsked => std::hint::spin_loop(),
        }
    }
    Err("nothing comes back".to_owned())
}
