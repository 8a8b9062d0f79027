// SPDX-License-Identifier: Apache-2.0
//! Checks that mistakes in a Rust declaration are reported in plain words.

#[test]
fn mistakes_are_told_in_plain_words() {
    let cases = trybuild::TestCases::new();
    cases.compile_fail("tests/mistakes/*.rs");
}
