// SPDX-License-Identifier: Apache-2.0
//! The calls of the control interface: those of [`api`], where each is declared, but for what speaks of files of the daemon's host.
use api::Role;
pub use api::{Argument, Call};

/// The largest body of a call, bytes: a path of 4,096 way-points of 16 joints with their speeds and blends, each number with its 17 digits, sign,
/// exponent and comma.
pub const BODY_MAX: usize = 2 << 20;
/// The same of a call that only looks at something by its name.
const LOOK_MAX: usize = 64 << 10;

/// Returns the calls, in the order of `opengpac_ps.h`. `download` is not among them: code comes by `PUT /v1/modules`.
pub fn all() -> impl Iterator<Item = &'static Call> {
    api::calls().filter(|call| !call.local)
}

/// Returns the call of that name.
pub fn find(name: &str) -> Option<&'static Call> {
    api::find(name).filter(|call| !call.local)
}

/// Returns the largest body that a call takes, bytes: what only looks has much to say of a definition alone.
pub fn body_max(call: &Call) -> usize {
    if call.role == Role::Observe && !call.costs { LOOK_MAX } else { BODY_MAX }
}
