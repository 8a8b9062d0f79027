// SPDX-License-Identifier: Apache-2.0
//! Groups and rows that show whether all of their bytes were written together.
use interconnect::ConnectionSpec;

/// More than a few cache lines, and not a whole number of them.
pub const GROUP_LEN: usize = 808;

pub const SPEC: ConnectionSpec = ConnectionSpec { writer: 3, reader: 5, asynchronous_len: GROUP_LEN, queue_row_len: 200, queue_depth: 4 };

/// Fills `bytes` with values that follow from `number`, and their sum.
pub fn fill(bytes: &mut [u8], number: u64) {
    let (words, _) = bytes.as_chunks_mut::<8>();
    let (sum_of, values) = words.split_first_mut().expect("there is a word");
    let mut sum = number;
    for (index, value) in values.iter_mut().enumerate() {
        let word = number.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(index as u32);
        sum = sum.wrapping_add(word);
        *value = word.to_le_bytes();
    }
    *sum_of = sum.to_le_bytes();
}

/// Returns true if all of `bytes` was written for `number`.
pub fn agrees(bytes: &[u8], number: u64) -> bool {
    let mut expected = vec![0; bytes.len()];
    fill(&mut expected, number);
    expected == bytes
}
