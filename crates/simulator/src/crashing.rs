// SPDX-License-Identifier: Apache-2.0
//! Blocks that crash in an invocation chosen by the seed: `crash` writes to an invalid address; `torn` exhausts its budget while it
//! stores, between two halves of one output.
use crate::blocks::{MANY, code};
use opengpac::abi::{Descriptor, Header, Invocation, RUNNING};
use opengpac::{FunctionBlock, Outcome, Step};
use std::ffi::c_void;
use std::sync::OnceLock;
use std::sync::atomic::{Ordering, compiler_fence};

/// Writes to an invalid address in invocation `at`; stores pairs until then.
#[derive(FunctionBlock)]
pub struct Crash {
    /// the code
    #[output]
    a: f64,
    /// its negative value
    #[output]
    b: f64,
    /// number of the start
    #[param(default = 1)]
    tag: i64,
    /// invocation in which it crashes
    #[param(default = 1_000_000)]
    at: u64,
}

impl Step for Crash {
    fn step(&mut self, invocation: &opengpac::Invocation) -> Outcome {
        self.a = code(self.tag, invocation.number);
        if invocation.number == self.at {
            let nowhere = std::hint::black_box(16 as *mut u32);
            // SAFETY: none; the fault is intended, and the kernel contains it.
            unsafe { nowhere.write_volatile(1) };
        }
        self.b = -self.a;
        Outcome::Done
    }
}

/// An array whose elements all contain the code. In invocation `at`, the budget is exhausted when half of the elements have been stored.
#[derive(FunctionBlock)]
pub struct Torn {
    /// the code
    #[output]
    y: [f64; MANY],
    /// number of the start
    #[param(default = 1)]
    tag: i64,
    /// invocation in which its budget is exhausted
    #[param(default = 1_000_000)]
    at: u64,
}

impl Step for Torn {
    /// Stores the elements that its entry point (below) does not store.
    fn step(&mut self, invocation: &opengpac::Invocation) -> Outcome {
        self.y = [code(self.tag, invocation.number); MANY];
        Outcome::Done
    }
}

/// Memory of an instance in the layout of the generated entry point.
#[repr(C)]
struct Instance {
    header: Header,
    y: *mut f64,
    own: Torn,
}

/// Entry point like the generated ones (`block/src/abi.rs`), except for the signal.
unsafe extern "C" fn run(memory: *mut c_void, _: *const Invocation) -> u64 {
    let m = memory.cast::<Instance>();
    // SAFETY: the kernel passes the memory of an instance of this block with every address bound.
    unsafe {
        let number = (*m).header.number;
        let next = &raw mut (*m).header.number;
        next.write_volatile(number.wrapping_add(1) | RUNNING);
        let (value, is_spent) = (code((*m).own.tag, number), number == (*m).own.at);
        next.write_volatile(number.wrapping_add(1));
        compiler_fence(Ordering::SeqCst);
        for index in 0..MANY {
            if is_spent && index == MANY / 2 {
                // The guard takes this signal as an exhausted budget without reading a clock, so every run of the seed is the same.
                libc::raise(libc::SIGXCPU);
            }
            (*m).y.add(index).write_volatile(value);
        }
    }
    0
}

/// Returns the descriptor of `Torn` with this entry point.
fn torn() -> &'static Descriptor {
    static DESCRIPTOR: OnceLock<&'static Descriptor> = OnceLock::new();
    DESCRIPTOR.get_or_init(|| Box::leak(Box::new(Descriptor { run, ..*Torn::descriptor() })))
}

/// Returns the blocks of module `crashing`, which is no longer trusted after a crash.
pub fn all() -> [&'static Descriptor; 2] {
    [Crash::descriptor(), torn()]
}
