// SPDX-License-Identifier: Apache-2.0
//! The block interface: the C ABI of a function block and its Rust form.
//!
//! A block is a struct whose fields are the items of its interface, and one method. Field comments are the descriptions; the first
//! sentence of the struct's comment states what the block computes, and the rest is its manual:
//!
//! ```
//! use opengpac::{FunctionBlock, Invocation, Outcome, Step, trial::Trial};
//!
//! /// First-order low-pass filter: y += alpha (u - y).
//! #[derive(FunctionBlock)]
//! pub struct Lowpass {
//!     /// raw signal
//!     #[input]                u: f64,
//!     /// filtered signal
//!     #[output]               y: f64,
//!     /// smoothing factor, 0 to 1
//!     #[param(default = 0.1)] alpha: f64,
//! }
//! impl Step for Lowpass {
//!     fn step(&mut self, _: &Invocation) -> Outcome { self.y += self.alpha * (self.u - self.y); Outcome::Done }
//! }
//!
//! let mut trial = Trial::new(Lowpass::descriptor());
//! trial.set_number("u", 10.0).unwrap();
//! trial.run().unwrap();
//! assert_eq!(trial.number("y").unwrap(), 1.0);
//! ```
//!
//! | attribute | meaning of the field |
//! |---|---|
//! | `#[input]`, `#[input(asynchronous)]`, `#[input(ratio = n)]`, `#[input(default = v)]` | an input, latched; `default`: it may stay unbound |
//! | `#[input(history)] u: [f64; 8]` | the last 8 values, oldest first |
//! | `#[output]`, `#[output(ratio = n)]`, `#[output(nonfinite)]` | an output, stored after success |
//! | `#[input(in_place)] table: InPlace<T>`, `#[output(in_place)] table: InPlaceMut<T>` | a table too large to be copied in each invocation |
//! | `#[param(default = v)]` | a parameter |
//! | `#[state]`, `#[state(initial = v)]`, `#[state(keep)]`, `#[state(opaque)]` | memory; `opaque`: any `Copy + Default` type |
//! | `#[device(read)]`, `#[device(write)]` | a channel of a physical device |
//! | `#[condition] done: Condition` | a condition, reported by `self.done.report()` |
//! | `#[condition(preset = v)] above: ConditionOf<f64>` | a condition with a value: `self.above.preset`, `self.above.report(x)` |
//! | `#[size(1, 16)] n: u32` | the number of elements of the items declared `sized`: `#[input(sized)] q: [f64; 16]` |
//!
//! Each attribute accepts `unit = "rad"`. The allowed types are the [`Type`]s.

pub mod abi;
#[doc(hidden)]
pub mod bank;
mod condition;
mod fault;
#[doc(hidden)]
pub mod floats;
pub mod generated;
mod in_place;
mod panics;
pub mod read;
mod step;
pub mod trial;
mod types;
mod what;

pub use abi::Invocation;
pub use condition::{Condition, ConditionOf};
pub use fault::{CALLED_FORK, FLOATS_CHANGED, lost_text, signal_text};
pub use in_place::{InPlace, InPlaceMut};
pub use opengpac_derive::{FunctionBlock, Type};
pub use step::{FunctionBlock, Outcome, Step};
pub use types::Type;
pub use what::What;

/// Text of the C header `opengpac.h`, which code modules in C include.
pub const HEADER: &str = include_str!("../include/opengpac.h");

/// Text of the C header of drivers, `opengpac_driver.h`. Placed here next to the other header, for the crates that ship and compile C.
pub const DRIVER_HEADER: &str = include_str!("../include/opengpac_driver.h");

/// Makes a `cdylib` crate a code module with these blocks: `opengpac::module!(Lowpass, Gain);`, once per crate.
#[macro_export]
macro_rules! module {
    ($($block:ty),+ $(,)?) => {
        /// Returns the table of this code module's blocks.
        #[unsafe(no_mangle)]
        pub extern "C" fn opengpac_module() -> *const $crate::abi::Module {
            static MODULE: ::std::sync::OnceLock<&'static $crate::abi::Module> = ::std::sync::OnceLock::new();
            *MODULE.get_or_init(|| {
                let mut types = ::std::vec::Vec::new();
                $(types.extend(<$block as $crate::FunctionBlock>::types());)+
                $crate::generated::describe_module(vec![$(<$block as $crate::FunctionBlock>::descriptor()),+], types)
            })
        }
        /// Returns the bank entry of a block of this code module. Callers that do not use it run its blocks one by one.
        #[unsafe(no_mangle)]
        pub extern "C" fn opengpac_bank_1(run: $crate::abi::Run) -> ::std::option::Option<$crate::bank::Bank> {
            $crate::bank::of(run)
        }
    };
}
