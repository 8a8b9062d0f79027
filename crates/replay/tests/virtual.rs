// SPDX-License-Identifier: Apache-2.0
//! Checks arbitrary calls under the virtual clock, with sources that preempt each other: recording twice gives the same record, and
//! replaying it gives the same values, bit for bit.
#[path = "../../supervisor/tests/common/mod.rs"]
mod common;
mod support;
use common::*;
use model::value::Value;
use proptest::prelude::*;
use replay::{Condition, Item};
use runtime::ClockKind;
use runtime::trace::Entry;
use serde_json::json;
use supervisor::Limits;
use support::*;

#[derive(Clone, Copy, Debug)]
enum Call {
    Start { which: usize, limit: u8 },
    Suspend(usize),
    Resume(usize),
    Halt(usize),
    Write { svv: usize, value: u8 },
    Advance { us: u16 },
    Delete(usize),
    Create { place: usize },
}

fn call() -> impl Strategy<Value = Call> {
    prop_oneof![
        6 => (0..4usize, 0..12u8).prop_map(|(which, limit)| Call::Start { which, limit }),
        2 => (0..4usize).prop_map(Call::Suspend),
        3 => (0..4usize).prop_map(Call::Resume),
        2 => (0..4usize).prop_map(Call::Halt),
        2 => (0..2usize, 0..9u8).prop_map(|(svv, value)| Call::Write { svv, value }),
        8 => (0..9_000u16).prop_map(|us| Call::Advance { us }),
        1 => (0..4usize).prop_map(Call::Delete),
        2 => (0..3usize).prop_map(|place| Call::Create { place }),
    ]
}

const PLACES: [&[&str]; 3] =
    [&["*@rtp0.fast"], &["a@rtp0.fast", "p@rtp1.soft", "b@rtp1.other", "bad@rtp1.other"], &["a@rtp0.slow", "p@rtp0.slow", "b@rtp0.fast", "bad@rtp1.other"]];

/// Runs these calls; returns the record.
fn run(link: Link, seed: u64, calls: &[Call]) -> Vec<Item> {
    let (rig, mut recording) = recorded(ClockKind::Virtual { seed }, link);
    rig.svvs(&["x", "y"]);
    rig.define(busy());
    let mut made: Vec<u64> = PLACES.iter().enumerate().map(|(at, place)| rig.instance("busy", &with_svv(place, ["x", "y"][at % 2]))).collect();
    let mut items = Vec::new();
    for call in calls {
        let pick = |which: usize| made[which % made.len()];
        // Refusals are included: they leave nothing behind.
        let _refused = match *call {
            Call::Start { which, limit } => rig.try_start(pick(which), json!({"limit": f64::from(limit)}), Limits::default()),
            Call::Suspend(which) => rig.system.suspend(pick(which)),
            Call::Resume(which) => rig.system.resume(pick(which)),
            Call::Halt(which) => rig.system.halt(pick(which)),
            Call::Write { svv, value } => rig.system.write(["x", "y"][svv], &Value::Number(f64::from(value))).map(drop),
            Call::Advance { us } => rig.system.advance(i64::from(us) * 1_000),
            Call::Delete(which) if made.len() > 1 => rig.system.delete(made.swap_remove(which % made.len())),
            Call::Delete(_) => Ok(()),
            Call::Create { place } => {
                if made.len() < 5 {
                    made.push(rig.instance("busy", &with_svv(PLACES[place], "x")));
                }
                Ok(())
            }
        };
        recording.take(&mut items);
    }
    rig.system.close();
    recording.take(&mut items);
    items
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_record_is_the_same_again_and_runs_the_same_again(seed in 1..1_000u64, faulty in any::<bool>(), calls in prop::collection::vec(call(), 1..40)) {
        let link = if faulty { Link::Faulty(seed) } else { Link::Memory };
        let (first, second) = (run(link, seed, &calls), run(link, seed, &calls));
        prop_assert_eq!(outline(&first), outline(&second));
        let (firings, _) = play(&first).map_err(TestCaseError::fail)?;
        prop_assert_eq!(firings, first.iter().filter(|item| is_firing(item)).count() as u64);
    }
}

#[test]
fn a_record_goes_through_bytes() {
    let items = run(Link::Memory, 3, &[Call::Start { which: 1, limit: 9 }, Call::Advance { us: 8_000 }]);
    let again: Vec<Item> = items.iter().map(|item| Item::of(&item.bytes()).unwrap()).collect();
    assert_eq!(outline(&items), outline(&again));
    assert!(play(&again).unwrap().0 > 20);
    assert!(Item::of(&[255, 255]).unwrap_err().contains("damaged"));
}

#[test]
fn a_value_that_was_changed_in_the_record_is_seen() {
    let mut items = run(Link::Memory, 3, &[Call::Start { which: 0, limit: 9 }, Call::Advance { us: 8_000 }]);
    let place = items.iter().rposition(is_firing).unwrap();
    let Item::Entry(Entry::Stretch(_, stretch)) = &mut items[place] else { unreachable!() };
    stretch.digest ^= 1;
    let why = play(&items).unwrap_err();
    assert!(why.contains("not the same"), "{why}");
}

#[test]
fn a_run_stops_where_a_condition_holds() {
    let items = run(Link::Memory, 3, &[Call::Start { which: 0, limit: 11 }, Call::Advance { us: 9_000 }]);
    let until = Condition::read("x >= 2").unwrap();
    let mut player = player();
    let mut stopped = None;
    for item in &items {
        let moment = player.play(item).unwrap();
        if let Some(moment) = moment
            && until.holds(&mut player).unwrap()
        {
            stopped = Some(moment);
            break;
        }
    }
    let moment = stopped.expect("x comes to 2");
    assert_eq!(player.svv("x").unwrap().number(0), Some(2.0));
    assert_eq!(moment.time_ns % MS, 0);
}
