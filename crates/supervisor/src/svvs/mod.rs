// SPDX-License-Identifier: Apache-2.0
//! State vector variables: their cells, names, values and windows.
pub(crate) mod cells;
pub(crate) mod identity;
pub(crate) mod named;
pub(crate) mod svv_calls;
pub(crate) mod values;
pub(crate) mod windows;
