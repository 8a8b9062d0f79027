// SPDX-License-Identifier: Apache-2.0
//! Seal of a module that was built here: a checksum after the end of the shared object, which loaders ignore. It reveals any damage
//! before a byte of the file is executed. Modules built elsewhere have no seal, and are only tried in a child.

const MARK: &[u8] = b"\nopengpac-seal:";
const DIGITS: usize = 16;

/// Verdict on the seal of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seal {
    Absent,
    Whole,
    Broken,
}

/// Appends the seal to the bytes.
pub fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let sum = checksum(&bytes);
    bytes.extend_from_slice(MARK);
    bytes.extend_from_slice(format!("{sum:016x}").as_bytes());
    bytes
}

/// Checks the seal.
pub fn check(bytes: &[u8]) -> Seal {
    let Some(end) = bytes.len().checked_sub(MARK.len() + DIGITS) else { return Seal::Absent };
    let (content, seal) = bytes.split_at(end);
    match seal.strip_prefix(MARK) {
        None => Seal::Absent,
        Some(digits) if digits == format!("{:016x}", checksum(content)).as_bytes() => Seal::Whole,
        Some(_) => Seal::Broken,
    }
}

/// Computes FNV-1a, 64 bits: detects accidents, not attacks.
fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |sum, byte| (sum ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3))
}
