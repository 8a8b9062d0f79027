// SPDX-License-Identifier: Apache-2.0
//! Counters of the driver.

device::counters! {
    /// Counters of the driver.
    pub(super) enum Count {
        Cycles: "cycles", "", "SYNCs sent";
        Lost: "frames_lost", "", "process data that a node did not send by the next cycle";
        Refused: "frames_refused", "", "frames received that did not match the configuration: wrong length, 29-bit identifier, unknown state";
        Unsent: "frames_unsent", "", "frames that the interface did not accept: its queue is full, or it is down";
        Overflowed: "frames_overflowed", "", "frames received and dropped, because the buffer of this host was full";
        Emergencies: "emergencies", "", "emergency messages of nodes";
        Missed: "heartbeats_missed", "", "heartbeats of nodes that did not come in time";
        Passive: "error_passive", "", "reports that the adapter is error passive: frames are not acknowledged, or are disturbed";
        BusOff: "bus_off", "", "reports that the adapter has left the bus";
    }
}
