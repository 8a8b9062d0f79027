// SPDX-License-Identifier: Apache-2.0
//! What the driver counts.
use device::CounterWord;

/// Indices into the counters.
pub const CYCLES: usize = 0;
pub const LOST: usize = 1;
pub const REFUSED: usize = 2;
pub const UNSENT: usize = 3;
pub const OVERFLOWED: usize = 4;
pub const EMERGENCIES: usize = 5;
pub const MISSED: usize = 6;
pub const PASSIVE: usize = 7;
pub const BUS_OFF: usize = 8;

pub const COUNTERS: [CounterWord; 9] = [
    CounterWord { name: "cycles", unit: "", doc: "SYNCs that were sent" },
    CounterWord { name: "frames_lost", unit: "", doc: "process data that a drive did not send by the next cycle" },
    CounterWord { name: "frames_refused", unit: "", doc: "frames that came and were not as they were configured: another length, 29 bits, unknown states" },
    CounterWord { name: "frames_unsent", unit: "", doc: "frames that the interface did not take: its queue is full, or it is down" },
    CounterWord { name: "frames_overflowed", unit: "", doc: "frames that came and that this host had no room for" },
    CounterWord { name: "emergencies", unit: "", doc: "emergency messages of drives" },
    CounterWord { name: "heartbeats_missed", unit: "", doc: "heartbeats of drives that did not come in time" },
    CounterWord { name: "error_passive", unit: "", doc: "reports that the adapter is error passive: frames are not acknowledged, or disturbed" },
    CounterWord { name: "bus_off", unit: "", doc: "reports that the adapter has left the bus" },
];
