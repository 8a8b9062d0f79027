// SPDX-License-Identifier: Apache-2.0
//! Blocks that crash, each in an invocation that the seed says: `crash` writes where nothing is; `torn` runs out of budget while it stores, between
//! two halves of one output.
use crate::blocks::{MANY, code};
use opengpac::abi::{Descriptor, Header, Invocation, RUNNING};
use opengpac::{FunctionBlock, Outcome, Step};
use std::ffi::c_void;
use std::sync::OnceLock;
use std::sync::atomic::{Ordering, compiler_fence};

/// Writes where nothing is, in invocation `at`; a pair until then.
#[derive(FunctionBlock)]
pub struct Crash {
    /// the code
    #[output]
    a: f64,
    /// its negative
    #[output]
    b: f64,
    /// number of the start
    #[param(default = 1)]
    tag: i64,
    /// in which invocation
    #[param(default = 1_000_000)]
    at: u64,
}

impl Step for Crash {
    fn step(&mut self, invocation: &opengpac::Invocation) -> Outcome {
        self.a = code(self.tag, invocation.number);
        if invocation.number == self.at {
            let nowhere = std::hint::black_box(16 as *mut u32);
            // SAFETY: none; the fault is what is simulated, and the kernel contains it.
            unsafe { nowhere.write_volatile(1) };
        }
        self.b = -self.a;
        Outcome::Done
    }
}

/// Many elements, all of them the code. In invocation `at` its budget is spent when half of them are stored.
#[derive(FunctionBlock)]
pub struct Torn {
    /// the code
    #[output]
    y: [f64; MANY],
    /// number of the start
    #[param(default = 1)]
    tag: i64,
    /// in which invocation
    #[param(default = 1_000_000)]
    at: u64,
}

impl Step for Torn {
    /// Stores what its entry below does not.
    fn step(&mut self, invocation: &opengpac::Invocation) -> Outcome {
        self.y = [code(self.tag, invocation.number); MANY];
        Outcome::Done
    }
}

/// The memory of an instance, as the generated entry has it.
#[repr(C)]
struct Instance {
    header: Header,
    y: *mut f64,
    own: Torn,
}

/// An entry as generated ones are (`block/src/abi.rs`), but for the signal.
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
                // The guard takes this signal as a spent budget without a look at a clock: the same in every run of the seed.
                libc::raise(libc::SIGXCPU);
            }
            (*m).y.add(index).write_volatile(value);
        }
    }
    0
}

/// `Torn` with that entry.
fn torn() -> &'static Descriptor {
    static DESCRIPTOR: OnceLock<&'static Descriptor> = OnceLock::new();
    DESCRIPTOR.get_or_init(|| Box::leak(Box::new(Descriptor { run, ..*Torn::descriptor() })))
}

/// Module `crashing`, which is not trusted after it crashed.
pub fn all() -> [&'static Descriptor; 2] {
    [Crash::descriptor(), torn()]
}
