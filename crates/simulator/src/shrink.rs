// SPDX-License-Identifier: Apache-2.0
//! Reduces the operations of a failing seed by delta debugging (Zeller, Hildebrandt 2002), as long as the same invariant is violated.
use crate::outcome::Failure;
use crate::run::run;

/// Maximum number of runs during shrinking.
const RUNS: usize = 2_000;

/// Returns the smallest failure found.
pub fn shrink(of: &Failure) -> Failure {
    let mut best = of.clone();
    let mut runs = 0;
    let mut size = best.kept.len().div_ceil(2);
    while size > 0 && runs < RUNS {
        let mut at = 0;
        let mut smaller = false;
        while at < best.kept.len() && runs < RUNS {
            let mut kept = best.kept.clone();
            kept.drain(at..(at + size).min(kept.len()));
            runs += 1;
            match run(of.seed, Some(&kept)).failure {
                Some(failure) if failure.broken.invariant == of.broken.invariant => {
                    best = failure;
                    smaller = true;
                }
                _ => at += size,
            }
        }
        if !smaller || size > 1 {
            size = if size == 1 { 0 } else { size.div_ceil(2) };
        }
    }
    best
}
