// SPDX-License-Identifier: Apache-2.0
//! Registry: code, sources, devices, SVVs, holders of claims.
pub(crate) mod catalog;
pub(crate) mod definitions;
pub(crate) mod download;
pub(crate) mod faces;
pub(crate) mod identity;
pub(crate) mod location;
pub(crate) mod planned;
pub(crate) mod psi;
pub(crate) mod ranges;
pub(crate) mod records;
pub(crate) mod sane;
pub(crate) mod svvs;
pub(crate) mod windows;
pub(crate) mod writers;
