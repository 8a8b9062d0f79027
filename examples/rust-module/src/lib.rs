// SPDX-License-Identifier: Apache-2.0
//! A code module in Rust: `cargo build --release`, then download `target/release/librust_module.so`.

use opengpac::{FunctionBlock, Invocation, Outcome, Step};

#[path = "../../blocks/lowpass.rs"]
mod lowpass;

pub use lowpass::Lowpass;

/// Divides, and panics where it cannot: y = a / b.
#[derive(FunctionBlock)]
pub struct Divide {
    /// dividend
    #[input]
    a: i64,
    /// divisor
    #[input]
    b: i64,
    /// quotient
    #[output]
    y: i64,
}
impl Step for Divide {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.a / self.b;
        Outcome::Done
    }
}

opengpac::module!(Lowpass, Divide);
