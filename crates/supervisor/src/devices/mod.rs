// SPDX-License-Identifier: Apache-2.0
//! Devices: opening, enabling, exchange, services and reopening.
pub(crate) mod enabling;
pub(crate) mod errands;
pub(crate) mod exchange;
pub(crate) mod exchange_calls;
pub(crate) mod forces;
pub(crate) mod forcing;
pub(crate) mod forcing_calls;
pub(crate) mod physical;
pub(crate) mod reopening;
pub(crate) mod services;
