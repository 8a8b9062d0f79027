// SPDX-License-Identifier: Apache-2.0
//! The daemon without a listener: sessions, the sum of a journal, decoders.
mod ledger;
mod requests;
mod sessions;
