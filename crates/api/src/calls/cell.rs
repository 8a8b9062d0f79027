// SPDX-License-Identifier: Apache-2.0
//! Calls that affect the whole cell: emergency stop, pause, modes, forced signals.
use crate::calls::PROGRAM;
use crate::effect::Effect;
use crate::waits::paused as until_paused;
use indexmap::IndexMap;
use model::value::Value;
use std::collections::BTreeMap;
use supervisor::{ForcedSignal, Mode};

crate::calls! {
    /// Calls that affect the whole cell.
    pub(super) const CELL about "cell" = [
        /// Stops everything that moves. The stop is latched until `reset` is called.
        Operate emergency_stop(must reason: String) -> (): commands("reason"), told_of_system, outcome_journalled, stops_all, free
            => |system| system.emergency_stop(&reason);
        /// Makes a channel of a device trip the emergency stop.
        Configure emergency_stop_input(
            must device: String,
            must channel: String,
            /// True if the channel trips the emergency stop at zero rather than at one.
            may at_zero: bool,
        ) -> (): commands("device"), goes_with("delete_physical_device", "device"), watches
            => |system| system.emergency_stop_input(&device, &channel, at_zero);
        /// Resets the emergency stop, and reopens lost devices. Returns the devices that are still lost, with the reasons.
        Operate reset() -> BTreeMap<String, String>: commands(""), told, outcome_journalled, moves
            => |system| system.reset();
        /// Suspends all actions on these logical devices, or on all devices, and waits until they are suspended. Returns the names of the
        /// suspended instances.
        Operate pause(may devices: Option<Vec<String>>) -> Vec<String>: commands(""), told, outcome_journalled, lasts, stops, free
            => |system, slice| {
                let (ids, names): (Vec<u64>, Vec<String>) = system.pause(devices.as_deref())?.into_iter().unzip();
                until_paused(system, &ids, names, slice)
            };
        /// Waits until these instances are no longer running. Returns their names.
        Operate paused(must instances: Vec<u64>, must names: Vec<String>) -> Vec<String>: outcome_journalled, lasts, free
            => |system, slice| until_paused(system, &instances, names, slice);
        /// Ends a pause. Returns the names of the instances that resume or begin.
        Operate resume_program(may devices: Option<Vec<String>>) -> Vec<String>: commands(""), told, outcome_journalled, moves
            => |system| Ok::<_, crate::Refusals>(system.resume_program(devices.as_deref())?.into_iter().map(|(_, name)| name).collect::<Vec<_>>());
        /// Returns the mode: "automatic" or "manual".
        Observe mode() -> Mode
            => |system| crate::sure(system.mode());
        /// Changes the mode.
        Operate set_mode(must mode: Mode) -> (): commands("mode"), told_of_system, journalled, moves, replaces(&[]), watches
            => |system| system.set_mode(mode);
        /// Sets the channel of the enabling switch, without which nothing moves in manual mode.
        Configure enabling_switch(must device: String, must channel: String) -> ():
            commands("device"), replaces(&[]), goes_with("delete_physical_device", "device"), watches
            => |system| system.enabling_switch(&device, &channel);
        /// Forces a signal, identified by its logical device: an input has this value instead of its reading, an output instead of its
        /// command. The force ends with the session that set it, when the device is disabled or lost, and at an emergency stop; an alarm
        /// is active until then. Returns the number of the force.
        Configure force(
            must name: String,
            /// Value in the unit of the signal's channel.
            must value: Value,
            /// Person or session that forces the signal; set by the control interface to its caller.
            may who: Option<String>,
        ) -> u64: commands("name"), told, moves, unjournalled, signed("who"), effect(Effect::ForcesSignal)
            => |system| system.force(&name, &value, who.as_deref().unwrap_or(PROGRAM));
        /// Ends the forcing of one signal, or of all. Returns the signals that were forced.
        Operate unforce(
            may name: Option<String>,
            /// Person or session that releases the signal; set by the control interface to its caller.
            may who: Option<String>,
        ) -> Vec<String>: commands("name"), told, moves, signed("who")
            => |system| system.unforce(name.as_deref(), who.as_deref().unwrap_or(PROGRAM));
        /// Returns the forced signals, by logical device.
        Observe forced() -> IndexMap<String, ForcedSignal>
            => |system| crate::sure(system.forced());
    ];
}
