// SPDX-License-Identifier: Apache-2.0
//! A panic in a block prints nothing; any other panic still does. In a process of its own, because the hook is the process's.

use opengpac::trial::{Fault, Trial};
use opengpac::{FunctionBlock, Invocation, Outcome, Step};
use std::panic;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Divides: y = a / b.
#[derive(FunctionBlock)]
struct Divide {
    /// dividend
    #[input]
    a: i32,
    /// divisor
    #[input]
    b: i32,
    /// quotient
    #[output]
    y: i32,
}
impl Step for Divide {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = quotient(self.a, self.b);
        Outcome::Done
    }
}

#[inline(never)]
fn quotient(a: i32, b: i32) -> i32 {
    a / b
}

#[test]
fn only_a_panic_in_a_block_is_silent() {
    static HEARD: AtomicUsize = AtomicUsize::new(0);
    panic::set_hook(Box::new(|_| {
        HEARD.fetch_add(1, Ordering::Relaxed);
    }));
    let mut trial = Trial::new(Divide::descriptor());
    for _ in 0..3 {
        assert_eq!(trial.run(), Err(Fault::Panicked));
    }
    assert_eq!(HEARD.load(Ordering::Relaxed), 0);
    assert!(panic::catch_unwind(|| quotient(std::hint::black_box(1), std::hint::black_box(0))).is_err());
    assert_eq!(HEARD.load(Ordering::Relaxed), 1);
}
