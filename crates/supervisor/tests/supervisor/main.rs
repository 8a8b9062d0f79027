// SPDX-License-Identifier: Apache-2.0
//! The supervisor under the virtual clock; tests that need their own process are next to this folder.
#[path = "../common/mod.rs"]
mod common;

mod arbitration;
mod calls;
mod containment;
mod cut_off;
mod devices;
mod endings;
mod exchange;
mod faults;
mod layers;
mod life;
mod lists;
mod no_jump;
mod pauses;
mod properties;
mod scheduling;
mod suspension;
mod taps;
mod values;
