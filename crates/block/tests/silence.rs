// SPDX-License-Identifier: Apache-2.0
//! Checks that a panic in a block prints nothing, and any other panic still does. Runs in its own process, because the panic hook belongs
//! to the process.

use opengpac::abi::{NONE, outcome};
use opengpac::bank::{self, Call};
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

/// Runs one invocation through the bank entry, with both inputs 0.
fn by_the_bank_entry() -> u64 {
    let descriptor = Divide::descriptor();
    let mut memory = vec![0_u64; (descriptor.instance_size as usize).div_ceil(size_of::<u64>())];
    let (mut value, mut step, invocation) = (0_i32, 0, Invocation::default());
    let call = Call { run: descriptor.run, instance: memory.as_mut_ptr().cast(), invocation: &raw const invocation };
    // SAFETY: the descriptor states the number of items and where their addresses lie; the memory is as large as it states.
    unsafe {
        for item in std::slice::from_raw_parts(descriptor.items, descriptor.item_count as usize) {
            assert_ne!(item.address, NONE);
            call.instance.byte_add(item.address as usize).cast::<*mut i32>().write(&raw mut value);
        }
        bank::of(descriptor.run).expect("a block in Rust has a bank entry")(&raw const call, &raw mut step, 0, 1)
    }
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
        assert_eq!(by_the_bank_entry(), outcome::PANIC);
    }
    assert_eq!(HEARD.load(Ordering::Relaxed), 0);
    assert!(panic::catch_unwind(|| quotient(std::hint::black_box(1), std::hint::black_box(0))).is_err());
    assert_eq!(HEARD.load(Ordering::Relaxed), 1);
}
