// SPDX-License-Identifier: Apache-2.0
//! Calls of the control interface: those declared in [`api`], except calls that refer to files on the daemon's host.
use api::Role;
pub use api::{Argument, Call};

/// Maximum size of the body of a call, bytes: a path of 4,096 waypoints of 16 joints with their speeds and blends, where each number has
/// 17 digits, a sign, an exponent and a comma.
pub const BODY_MAX: usize = 2 << 20;
/// Maximum size of the body of a call that only observes a named item, bytes.
const LOOK_MAX: usize = 64 << 10;

/// Returns the calls, in the order of `opengpac_ps.h`. `download` is excluded: code is uploaded by `PUT /v1/modules`.
pub fn all() -> impl Iterator<Item = &'static Call> {
    api::calls().filter(|call| !call.local)
}

/// Returns the call with this name.
pub fn find(name: &str) -> Option<&'static Call> {
    api::find(name).filter(|call| !call.local)
}

/// Returns the maximum size of a call's body, bytes. Calls that observe need long bodies only for definitions.
pub fn body_max(call: &Call) -> usize {
    if call.role == Role::Observe && !call.costs { LOOK_MAX } else { BODY_MAX }
}
