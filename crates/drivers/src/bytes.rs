// SPDX-License-Identifier: Apache-2.0
//! Numbers in the readings and commands of a device, which are plain bytes in the machine's order.

/// The double at `offset`.
pub(crate) fn get(bytes: &[u8], offset: usize) -> f64 {
    let mut eight = [0; 8];
    eight.copy_from_slice(&bytes[offset..offset + 8]);
    f64::from_ne_bytes(eight)
}

/// Stores a double at `offset`.
pub(crate) fn put(bytes: &mut [u8], offset: usize, value: f64) {
    bytes[offset..offset + 8].copy_from_slice(&value.to_ne_bytes());
}
