// SPDX-License-Identifier: Apache-2.0
//! Tests of frames of both protocols with arbitrary bytes, of a bus whose other end misbehaves, and of an arm of two servos.
mod arm;
mod codecs;
mod lines;
mod peer;
