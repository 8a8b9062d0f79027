// SPDX-License-Identifier: Apache-2.0
//! The control interface, from its decoders to its sockets.
mod audit;
mod command;
mod doors;
mod files;
mod frames;
mod gate;
mod journal;
mod lanes;
mod page;
mod reach;
mod recordings;
mod rig;
mod rights;
mod schemas;
mod scope;
mod served;
mod start;
mod stream;
