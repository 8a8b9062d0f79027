// SPDX-License-Identifier: Apache-2.0
//! Modules that can change floating-point state, and the effects of loading one.
#![cfg(target_arch = "x86_64")]
mod common;
use common::{GAIN, module};
use opengpac::abi::mark;
use opengpac::floats::Words;

/// Returns the marks of a block with this statement in its body, and more text before it.
fn marks(name: &str, before: &str, statement: &str) -> u32 {
    let text = format!(
        "#include <opengpac.h>\n#include <fenv.h>\n{before}\nFUNCTION_BLOCK(b, \"y = u.\", in(double, u, \"in\"), out(double, y, \"out\"))\n{{ {statement} self->y = self->u; return OK; }}\n"
    );
    module(&format!("floats-{name}"), &format!("{name}.c"), &text).blocks[0].descriptor.reserved
}

#[test]
fn what_can_change_the_state_is_seen() {
    let suspected = mark::LOADED | mark::FLOATS;
    assert_eq!(marks("import", "", "fesetround(FE_UPWARD);"), suspected);
    assert_eq!(marks("mxcsr", "", "unsigned w = 0x9fc0; __asm__ volatile(\"ldmxcsr %0\" : : \"m\"(w));"), suspected);
    assert_eq!(marks("x87", "", "unsigned short w = 0x27f; __asm__ volatile(\"fldcw %0\" : : \"m\"(w));"), suspected);
    assert_eq!(marks("mmx", "", "__asm__ volatile(\"pxor %%mm0, %%mm0\" : : : \"mm0\");"), suspected);
}

#[test]
fn what_cannot_is_not_slowed_down() {
    assert_eq!(module("floats-gain", "gain.c", GAIN).blocks[0].descriptor.reserved, mark::LOADED);
    // Constants and addresses that look like `ldmxcsr` and `fldcw`.
    assert_eq!(marks("constants", "static volatile unsigned long kept;", "kept = 0x17ae0f17ae0f; kept = 0x28d9; kept += 0x6cd90f17;"), mark::LOADED);
    assert_eq!(marks("reads", "", "self->u += fegetround();"), mark::LOADED);
}

#[test]
fn what_a_constructor_sets_is_taken_back() {
    let text = format!("{GAIN}\n#include <fenv.h>\n__attribute__((constructor)) static void sets(void) {{ fesetround(FE_UPWARD); }}\n");
    let before = Words::present();
    assert!(module("floats-constructor", "sets.c", &text).changed_floats);
    assert_eq!(Words::present(), before);
    assert!(!module("floats-none", "gain.c", GAIN).changed_floats);
}
