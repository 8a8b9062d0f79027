// SPDX-License-Identifier: Apache-2.0
//! A verb instance as it is kept: what it was made of, where it stands in its life, and what the kernels are asked to do for it.
pub(crate) mod floats;
pub(crate) mod held;
pub(crate) mod homes;
pub(crate) mod idle;
pub(crate) mod instance;
pub(crate) mod instances;
pub(crate) mod opening;
pub(crate) mod operating;
pub(crate) mod outputs;
pub(crate) mod report;
pub(crate) mod stages;
pub(crate) mod standing;
pub(crate) mod trial;
pub(crate) mod way;
pub(crate) mod windows;
pub(crate) mod words;
