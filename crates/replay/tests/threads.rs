// SPDX-License-Identifier: Apache-2.0
//! Checks that a run of real threads under the monotonic clock is replayed bit for bit.
#[path = "../../supervisor/tests/common/mod.rs"]
mod common;
mod support;
use common::*;
use runtime::ClockKind;
use std::time::Duration;
use supervisor::WaitResult;
use support::*;

#[test]
fn what_threads_did_is_done_again() {
    let (rig, mut recording) = recorded(ClockKind::Monotonic, Link::Memory);
    rig.svvs(&["x", "y"]);
    rig.define(busy());
    let mut items = Vec::new();
    let places: [&[&str]; 2] =
        [&["a@rtp0.fast", "p@rtp1.soft", "b@rtp1.other", "bad@rtp1.other"], &["a@rtp0.slow", "p@rtp0.slow", "b@rtp0.fast", "bad@rtp1.other"]];
    let made: Vec<u64> = places.iter().zip(["x", "y"]).map(|(place, svv)| rig.instance("busy", &with_svv(place, svv))).collect();
    for _ in 0..3 {
        made.iter().for_each(|id| rig.start(*id));
        for id in &made {
            while !matches!(rig.system.wait(*id, None, Duration::from_millis(50)).unwrap(), WaitResult::Done(_)) {
                recording.take(&mut items);
            }
        }
    }
    rig.system.close();
    recording.take(&mut items);
    let recorded = items.iter().filter(|item| is_firing(item)).count() as u64;
    let (firings, _) = play(&items).unwrap();
    assert_eq!(firings, recorded);
    assert!(firings >= 100, "{firings} firings only");
}
