// SPDX-License-Identifier: Apache-2.0
//! Distributed clocks: all subdevices share one system time, which follows this host's clock; SYNC0 is derived from it.
//!
//! The first subdevice with a clock is the reference clock. At startup, the propagation delays are measured, and each clock is given its
//! offset from host time and its delay from the reference clock. After that, every frame carries the reference clock's time past all the
//! other clocks, which use it to correct the remaining difference and their oscillator drift. The reference clock is synchronised to the
//! host in the same way (decision 105).
use super::bus::Bus;
use super::delays::{Ports, delays};
use super::subdevices::Subdevice;
use crate::frames::{self, Command, u16_at, u32_at};
use crate::registers as reg;

/// Period of SYNC0, and its shift relative to multiples of the period.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sync0 {
    pub cycle_ns: u32,
    pub shift_ns: u32,
}

/// Settings of the clocks of a line: SYNC0, and a function that returns this host's time in ns.
pub struct Clocks<'a> {
    pub sync0: Sync0,
    pub now_ns: &'a dyn Fn() -> u64,
}

/// The reference clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reference {
    pub station: u16,
    /// Expected working counter of the datagram that distributes its time: counts the reference clock and the clocks that follow it.
    pub counted: u16,
}

/// Number of delay measurements, and number of time distributions before SYNC0 starts.
const MEASURED: usize = 8;
const PASSES: usize = 500;
/// Value that resets the filters of a clock when it is written.
const SPEED: u16 = 0x1000;
/// Delay until SYNC0 starts; doubled if it is too short for a slow host.
const LEAD_NS: u64 = 20_000_000;
const TRIES: u32 = 8;

/// Sets all clocks to this host's time. Returns the reference clock.
///
/// # Errors
/// Fails with a message if no subdevice has a clock, or if a subdevice does not answer.
pub fn synchronise(bus: &mut Bus, line: &[Subdevice], clocks: &Clocks<'_>) -> Result<Reference, String> {
    let mut has_clock = Vec::with_capacity(line.len());
    for subdevice in line {
        has_clock.push(u16_at(&bus.read(subdevice.station, reg::FEATURES, 2)?, 0) & reg::HAS_CLOCK != 0);
    }
    let reference = has_clock.iter().position(|has| *has).ok_or("no subdevice has a distributed clock: leave sync0 out")?;
    let mut best: Option<LatchedTimes> = None;
    let mut sums = vec![0u64; line.len()];
    for _ in 0..MEASURED {
        let latched = latch(bus, line, &has_clock, clocks)?;
        for (sum, delay) in sums.iter_mut().zip(delays(&latched.ports)) {
            *sum += u64::from(delay.unwrap_or(0));
        }
        if best.as_ref().is_none_or(|best| latched.span_ns < best.span_ns) {
            best = Some(latched);
        }
    }
    let Some(best) = best else { return Err("no delay was measured".to_owned()) };
    for (at, subdevice) in line.iter().enumerate().filter(|(at, _)| has_clock[*at]) {
        let delay_ns = sums[at] / MEASURED as u64;
        let offset = best.host_ns.wrapping_add(delay_ns).wrapping_sub(best.local_ns[at]);
        bus.write(subdevice.station, reg::DC_OFFSET, &offset.to_le_bytes())?;
        bus.write(subdevice.station, reg::DC_DELAY, &(delay_ns as u32).to_le_bytes())?;
        bus.write(subdevice.station, reg::DC_SPEED, &SPEED.to_le_bytes())?;
    }
    let station = line[reference].station;
    let mut counted = 0;
    for _ in 0..PASSES {
        counted = bus.ask(Command::StationReadRestWrite, frames::at(station, reg::DC_SYSTEM_TIME), &[0; 8])?.counter;
    }
    Ok(Reference { station, counted })
}

/// Reception times of one frame, the time at which this host sent it, and its round-trip time.
struct LatchedTimes {
    ports: Vec<Ports>,
    local_ns: Vec<u64>,
    host_ns: u64,
    span_ns: u64,
}

fn latch(bus: &mut Bus, line: &[Subdevice], has_clock: &[bool], clocks: &Clocks<'_>) -> Result<LatchedTimes, String> {
    let begun_ns = (clocks.now_ns)();
    bus.write_all(reg::DC_RECEIVED, &[0; 4])?;
    let span_ns = (clocks.now_ns)().saturating_sub(begun_ns);
    let mut latched = LatchedTimes { ports: Vec::new(), local_ns: Vec::new(), host_ns: begun_ns + span_ns / 2, span_ns };
    for (subdevice, has_clock) in line.iter().zip(has_clock) {
        let status = u16_at(&bus.read(subdevice.station, reg::DL_STATUS, 2)?, 0);
        // Each port has two bits from bit 8 on; the second one indicates communication.
        let is_open = std::array::from_fn(|port| status >> (9 + 2 * port) & 1 == 1);
        let mut ports = Ports { has_clock: *has_clock, is_open, received: [0; 4] };
        let mut local_ns = 0;
        if *has_clock {
            let times = bus.read(subdevice.station, reg::DC_RECEIVED, 16)?;
            ports.received = std::array::from_fn(|port| u32_at(&times, 4 * port));
            local_ns = eight(&bus.read(subdevice.station, reg::DC_RECEIVED_UNIT, 8)?);
        }
        latched.ports.push(ports);
        latched.local_ns.push(local_ns);
    }
    Ok(latched)
}

/// Starts SYNC0 in a subdevice that is in PREOP. Returns the system time of its start.
///
/// # Errors
/// Fails with a message if the subdevice has no clock or does not answer.
pub fn start_sync0(bus: &mut Bus, subdevice: &Subdevice, sync0: Sync0) -> Result<u64, String> {
    let to = subdevice.station;
    if u16_at(&bus.read(to, reg::FEATURES, 2)?, 0) & reg::HAS_CLOCK == 0 {
        return Err(format!("{} has no distributed clock: leave sync0 out", subdevice.title()));
    }
    let (cycle_ns, shift_ns) = (u64::from(sync0.cycle_ns.max(1)), u64::from(sync0.shift_ns));
    for again in 0..TRIES {
        bus.write(to, reg::SYNC_ACTIVATION, &[0])?;
        bus.write(to, reg::SYNC_UNIT, &[0])?;
        let system_ns = eight(&bus.read(to, reg::DC_SYSTEM_TIME, 8)?);
        let start_ns = (system_ns + (LEAD_NS << again)) / cycle_ns * cycle_ns + shift_ns;
        bus.write(to, reg::SYNC0_CYCLE, &sync0.cycle_ns.to_le_bytes())?;
        bus.write(to, reg::SYNC0_START, &start_ns.to_le_bytes())?;
        bus.write(to, reg::SYNC_ACTIVATION, &[reg::SYNC0_ON])?;
        // SYNC0 never starts if its start is in the past.
        if eight(&bus.read(to, reg::DC_SYSTEM_TIME, 8)?) < start_ns {
            return Ok(start_ns);
        }
    }
    Err(format!("{}: its SYNC0 cannot be started: it answers too slowly", subdevice.title()))
}

fn eight(bytes: &[u8]) -> u64 {
    u64::from(u32_at(bytes, 0)) | u64::from(u32_at(bytes, 4)) << 32
}
