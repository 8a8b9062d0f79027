// SPDX-License-Identifier: Apache-2.0
//! Frames of both protocols with all kinds of bytes, a bus whose other end misbehaves, and an arm of two servos.
mod arm;
mod codecs;
mod lines;
mod peer;
