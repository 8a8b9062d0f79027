// SPDX-License-Identifier: Apache-2.0
//! What the driver counts.
use device::CounterWord;

/// Indices into the counters.
pub(super) mod count {
    pub const CYCLES: usize = 0;
    pub const LOST: usize = 1;
    pub const SHORT: usize = 2;
    pub const REFUSED: usize = 3;
    pub const DIFFERENCE: usize = 4;
    pub const REFERENCE: usize = 5;
}

pub(super) const COUNTERS: [CounterWord; 6] = [
    CounterWord { name: "cycles", unit: "", doc: "frames that were sent" },
    CounterWord { name: "frames_lost", unit: "", doc: "frames that did not come back in time" },
    CounterWord { name: "working_counter_errors", unit: "", doc: "frames that came back and that not all subdevices took" },
    CounterWord { name: "frames_refused", unit: "", doc: "frames that came and were no answer: malformed, changed, or late" },
    CounterWord { name: "clock_difference", unit: "ns", doc: "with sync0: the greatest difference of an axis's clock from the reference clock" },
    CounterWord { name: "reference_difference", unit: "ns", doc: "with sync0: the difference of the reference clock from that of this host" },
];
