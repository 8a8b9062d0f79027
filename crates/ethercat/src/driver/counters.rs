// SPDX-License-Identifier: Apache-2.0
//! Counters of the driver.

device::counters! {
    /// Counters of the driver.
    pub(super) enum Count {
        Cycles: "cycles", "", "frames sent";
        Lost: "frames_lost", "", "frames that did not come back in time";
        Short: "working_counter_errors", "", "frames that came back without having been processed by all subdevices";
        Refused: "frames_refused", "", "frames received that were not valid answers: malformed, changed, or late";
        Difference: "clock_difference", "ns", "with sync0: the maximum difference of an axis's clock from the reference clock";
        Reference: "reference_difference", "ns", "with sync0: the difference of the reference clock from the clock of this host";
    }
}
