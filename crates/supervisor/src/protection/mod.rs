// SPDX-License-Identifier: Apache-2.0
//! Protection: stops, pauses, limits on ages, losses, and the alarms that they raise. It is above the core, and below the course of an instance.
pub(crate) mod ages;
pub(crate) mod causes;
pub(crate) mod cut_off;
pub(crate) mod lost;
pub(crate) mod pausing;
pub(crate) mod stopping;
pub(crate) mod unguarded;
