// SPDX-License-Identifier: Apache-2.0
use crate::queue::QueueProgress;
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Outputs of a queue of moves: yᵢ = the value to which a `queue_generator` has switched output i at its current position, otherwise the
/// value at the start.
///
/// Activate it after the generator, bound to its `progress`. The outputs depend only on the position on the path: if the motion runs
/// backwards, they are switched back.
#[derive(FunctionBlock)]
pub struct QueueOutputs {
    /// number of outputs
    #[size(1, 16)]
    n: u32,
    /// progress of the queue
    #[input(asynchronous)]
    progress: QueueProgress,
    /// current state of each output
    #[input(asynchronous, sized)]
    start: [bool; 16],
    /// state of each output
    #[output(sized)]
    y: [bool; 16],
    /// state of each output at the start
    #[state]
    kept: [bool; 16],
    /// true after the first invocation
    #[state]
    has_begun: bool,
}

impl Step for QueueOutputs {
    fn step(&mut self, _: &Invocation) -> Outcome {
        if !self.has_begun {
            (self.kept, self.has_begun) = (self.start, true);
        }
        for i in 0..self.n as usize {
            let is = |bits: i64| bits >> i & 1 == 1;
            self.y[i] = if is(self.progress.switched) { is(self.progress.on) } else { self.kept[i] };
        }
        Outcome::Done
    }
}
