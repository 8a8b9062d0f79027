// SPDX-License-Identifier: Apache-2.0
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// A block with this mistake.
#[derive(FunctionBlock)]
struct Block {
    /// raw
    #[input(async)]
    u: f64,
}
impl Step for Block {
    fn step(&mut self, _: &Invocation) -> Outcome { Outcome::Done }
}
type _Unused = Condition;

fn main() {}
