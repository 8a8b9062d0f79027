// SPDX-License-Identifier: Apache-2.0
//! Carrying out what an instance needs: scripts, tables, connections, cells that move. Above what is kept, below the course of an instance.
pub(crate) mod carrier;
pub(crate) mod entering;
pub(crate) mod histories;
pub(crate) mod homing;
pub(crate) mod removing;
pub(crate) mod taking;
pub(crate) mod turning;
