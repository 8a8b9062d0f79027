// SPDX-License-Identifier: Apache-2.0
//! Physical devices: what stands behind the kernel's [`kernel::Driver`].
//!
//! A driver is chosen by name with [`open`]; it knows channels and time, nothing of verbs, state vector variables or Python.
//!
//! | kind | what it is |
//! |---|---|
//! | `mujoco` | a robot arm simulated by MuJoCo, from any MJCF file |
//! | `loopback` | parts that follow their effort, `x' = u`, for tests; it can fail on purpose |
//! | `plant_process` | any of the others in a process of its own, at its own pace, which outlives the one that commands it |
//! | `scripted` | channels of any type that read a table of values and record what is written, for tests |
pub mod driver;
pub mod error;
mod geometry;
pub mod loopback;
pub mod mujoco;
pub mod part;
pub mod plant_process;
pub mod scripted;

mod bytes;

pub use driver::{KINDS, open};
pub use error::DriverError;
pub use geometry::geometry;
pub use part::{Part, Servo};
