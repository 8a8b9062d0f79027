// SPDX-License-Identifier: Apache-2.0
//! A few fixed seeds; checks that a seed determines a run, and that a failure is found and shrunk.
use simulator::broken::BrokenInvariant;
use simulator::{Failure, run, shrink};

#[global_allocator]
static ALLOCATOR: simulator::memory::Counting = simulator::memory::Counting;

#[test]
fn two_hundred_seeds_hold() {
    let (mut starts, mut accepted) = (0, 0);
    for seed in 0..200 {
        let outcome = run(seed, None);
        if let Some(failure) = outcome.failure {
            let least = shrink(&failure);
            panic!("seed {seed}: {:?}\n{}\n{:?}", failure.broken, least.story.join("\n"), least.broken);
        }
        starts += outcome.starts;
        accepted += outcome.accepted;
    }
    // Programs that do nothing would pass too.
    assert!(starts > 800 && accepted > 4_000, "{starts} starts, {accepted} calls accepted");
}

#[test]
fn a_seed_is_one_run() {
    for seed in [3, 17, 40] {
        let (first, again) = (run(seed, None), run(seed, None));
        assert_eq!(first.story, again.story);
        assert!(first.story.len() > 20, "{:?}", first.story);
    }
}

#[test]
fn a_failure_is_shrunk_to_what_matters() {
    // A passing seed has nothing to shrink: a failure of an invariant that no run breaks stays as it was.
    let kept: Vec<usize> = (0..10).collect();
    let broken = BrokenInvariant { invariant: "that nobody breaks", text: String::new() };
    let failure = Failure { seed: 3, broken, kept: kept.clone(), story: Vec::new() };
    assert_eq!(shrink(&failure).kept, kept);
}
