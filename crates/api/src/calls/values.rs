// SPDX-License-Identifier: Apache-2.0
//! Calls for values of SVVs, and for time.
use crate::sure;
use crate::values::{Reading, Snapshot, history as past, snapshot};
use crate::waits::advance as advanced;
use model::value::Value;
use supervisor::SvvAbout;

crate::calls! {
    /// Calls for values and time.
    pub(super) const VALUES about "values and time" = [
        /// Returns one consistent snapshot.
        Observe read(
            /// Names of SVVs, of private cells ("move#1:coefficients"), or of channels ("plant.elbow.position").
            must names: Vec<String>,
            /// True to return "bytes", the memory of the C type in base64, little-endian, instead of "value", which cannot represent NaN
            /// or infinity in JSON.
            may raw: bool,
        ) -> Snapshot: rated
            => |system| snapshot(system, &names, raw);
        /// Stores a value.
        Operate write(must name: String, must value: Value) -> (): commands("name"), told, brief, moves
            => |system| system.write(&name, &value);
        /// Returns the most recent values, oldest first.
        Observe history(
            must name: String,
            /// Maximum number of values.
            must count: usize,
            /// True to return "bytes" instead of "value", as in `read`.
            may raw: bool,
        ) -> Vec<Reading>: costs, rated
            => |system| past(system, &name, count, raw);
        /// Returns the properties of an SVV, a private cell or a channel: its type, unit, history and writers.
        Observe svv_about(must name: String) -> SvvAbout
            => |system| system.svv_about(&name);
        /// Returns the time on the system's clock, ns.
        Observe now() -> i64: brief
            => |system| sure(system.now_ns());
        /// Runs the firings in (now, now + duration] under the virtual clock.
        Operate advance(must duration_ns: i64) -> (): lasts
            => |system, slice| advanced(system, duration_ns, slice);
        /// Runs the next firing under the virtual clock, however far ahead it is. Returns false if nothing will ever be due.
        Operate step() -> bool
            => |system| system.step();
    ];
}
