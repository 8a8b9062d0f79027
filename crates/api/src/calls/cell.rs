// SPDX-License-Identifier: Apache-2.0
//! Calls about the whole cell: emergency stop, pause, modes.
use crate::waits::paused as until_paused;
use std::collections::BTreeMap;
use supervisor::Mode;

crate::calls! {
    /// The whole cell.
    pub(super) const CELL about "cell" = [
        /// Stops everything that moves, until `reset`.
        Operate emergency_stop(must reason: String) -> (): commands("reason"), told_of_system, outcome_journalled, stops_all, free
            => |system| system.emergency_stop(&reason);
        /// Lets a channel of a device trip the emergency stop.
        Configure emergency_stop_input(
            must device: String,
            must channel: String,
            /// True if it trips at zero rather than at one.
            may at_zero: bool,
        ) -> (): commands("device"), goes_with("delete_physical_device", "device"), watches
            => |system| system.emergency_stop_input(&device, &channel, at_zero);
        /// Resets the emergency stop, and reopens lost devices. Returns the devices that are still lost, with the reasons.
        Operate reset() -> BTreeMap<String, String>: commands(""), told, outcome_journalled, moves
            => |system| system.reset();
        /// Suspends all actions on these logical devices, or on all devices, and waits until they are suspended. Returns the names of
        /// these instances.
        Operate pause(may devices: Option<Vec<String>>) -> Vec<String>: commands(""), told, outcome_journalled, lasts, stops, free
            => |system, slice| {
                let (ids, names): (Vec<u64>, Vec<String>) = system.pause(devices.as_deref())?.into_iter().unzip();
                until_paused(system, &ids, names, slice)
            };
        /// Waits until these instances have stopped. Returns their names.
        Operate paused(must instances: Vec<u64>, must names: Vec<String>) -> Vec<String>: outcome_journalled, lasts, free
            => |system, slice| until_paused(system, &instances, names, slice);
        /// Ends a pause. Returns the names of the instances that resume or begin.
        Operate resume_program(may devices: Option<Vec<String>>) -> Vec<String>: commands(""), told, outcome_journalled, moves
            => |system| Ok::<_, crate::Refusals>(system.resume_program(devices.as_deref())?.into_iter().map(|(_, name)| name).collect::<Vec<_>>());
        /// Returns "automatic" or "manual".
        Observe mode() -> Mode
            => |system| crate::sure(system.mode());
        /// Changes the mode.
        Operate set_mode(must mode: Mode) -> (): commands("mode"), told_of_system, journalled, moves, replaces(&[]), watches
            => |system| system.set_mode(mode);
        /// Sets the channel of the enabling switch, without which nothing moves in manual mode.
        Configure enabling_switch(must device: String, must channel: String) -> ():
            commands("device"), replaces(&[]), goes_with("delete_physical_device", "device"), watches
            => |system| system.enabling_switch(&device, &channel);
    ];
}
