// SPDX-License-Identifier: Apache-2.0
//! Processors: location, equipment, guarding and revival.
pub(crate) mod equipping;
pub(crate) mod farewell;
pub(crate) mod guard;
pub(crate) mod guarded_devices;
pub(crate) mod hardware;
pub(crate) mod location;
pub(crate) mod remote;
pub(crate) mod revival;
