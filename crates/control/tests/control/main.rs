// SPDX-License-Identifier: Apache-2.0
//! The control interface, from its decoders to its sockets.
mod audit;
mod command;
mod doors;
mod files;
mod gate;
mod journal;
mod lanes;
mod ledger;
mod page;
mod reach;
mod requests;
mod rig;
mod rights;
mod schemas;
mod scope;
mod served;
mod sessions;
mod start;
mod stream;
