// SPDX-License-Identifier: Apache-2.0
use super::*;

const MS: i64 = 1_000_000;

/// A process that beats at every poll while it runs, and the actions taken on it.
#[derive(Default)]
struct Process {
    beats: u64,
    has_ended: bool,
    is_stopped: bool,
    is_dying: bool,
    latches: bool,
    is_full: bool,
    done: Vec<&'static str>,
}

impl Subject for Process {
    fn notice_end(&mut self) -> bool {
        self.has_ended
    }
    fn notice_dying(&mut self) -> bool {
        self.is_dying
    }
    fn beats(&self) -> u64 {
        self.beats
    }
    fn is_stopped(&self) -> bool {
        self.is_stopped
    }
    fn latches(&self) -> bool {
        self.latches
    }
    fn kill(&mut self) {
        self.done.push("kill");
    }
    fn write(&mut self, afresh: bool) -> bool {
        self.done.push(if afresh { "write" } else { "again" });
        !self.is_full
    }
}

fn watch(is_spared: bool) -> (Watch, Process) {
    let process = Process { beats: 1, latches: is_spared, ..Process::default() };
    (Watch::new(Some(Pulse::new(Bounds::default(), 1, 0)), is_spared), process)
}

/// Polls every 20 ms from `from_ms` on for `for_ms`; returns the first event and its time.
fn looks(watch: &mut Watch, process: &mut Process, from_ms: i64, for_ms: i64) -> Option<(Event, i64)> {
    (from_ms..from_ms + for_ms).step_by(20).find_map(|ms| Some((watch.look(process, ms * MS)?, ms)))
}

#[test]
fn one_that_ends_is_written_for_once_and_at_once() {
    let (mut watch, mut process) = watch(false);
    process.has_ended = true;
    assert_eq!(watch.look(&mut process, MS), Some(Event::Lost { cause: Cause::Died, seen_ns: MS }));
    assert_eq!(looks(&mut watch, &mut process, 2, 20_000), None);
    assert_eq!((process.done, watch.is_settled()), (vec!["write"], true));
}

#[test]
fn one_that_is_dying_is_written_for_at_once_and_again_when_it_has_ended() {
    let (mut watch, mut process) = watch(false);
    process.is_dying = true;
    assert_eq!(watch.look(&mut process, MS), Some(Event::Lost { cause: Cause::Died, seen_ns: MS }));
    assert!(!watch.is_over());
    process.has_ended = true;
    assert_eq!(looks(&mut watch, &mut process, 2, 2_000), None);
    assert_eq!((process.done, watch.is_settled()), (vec!["kill", "write", "write"], true));
}

#[test]
fn one_that_is_stopped_is_killed_soon_and_written_for_when_it_has_ended() {
    let (mut watch, mut process) = watch(false);
    process.is_stopped = true;
    assert_eq!(looks(&mut watch, &mut process, 20, 120), None);
    assert_eq!(process.done, ["kill"], "100 ms after its last beat");
    process.has_ended = true;
    let lost = watch.look(&mut process, 141 * MS);
    assert!(matches!(lost, Some(Event::Lost { cause: Cause::Stopped, seen_ns }) if seen_ns <= 120 * MS), "{lost:?}");
    assert_eq!(process.done, ["kill", "write"]);
}

#[test]
fn one_that_is_only_silent_has_the_long_bound() {
    let (mut watch, mut process) = watch(false);
    assert_eq!(looks(&mut watch, &mut process, 20, 480), None);
    assert!(process.done.is_empty());
    looks(&mut watch, &mut process, 500, 40);
    assert_eq!(process.done, ["kill"]);
    // It takes time to die: its safe values are written nevertheless, and again after its end.
    let lost = looks(&mut watch, &mut process, 540, 200).expect("it is late");
    assert!(matches!(lost, (Event::Lost { cause: Cause::Frozen, .. }, 620)), "{lost:?}");
    process.has_ended = true;
    assert_eq!(watch.look(&mut process, 800 * MS), None);
    assert_eq!(process.done, ["kill", "write", "write"]);
}

#[test]
fn one_that_is_spared_is_written_for_and_goes_on() {
    let (mut watch, mut process) = watch(true);
    process.is_stopped = true;
    let seen = looks(&mut watch, &mut process, 20, 200).expect("it stands still");
    assert!(matches!(seen, (Event::MadeSafe { cause: Cause::Stopped, .. }, 100..=120)), "{seen:?}");
    assert_eq!(looks(&mut watch, &mut process, 200, 60_000), None, "said once");
    (process.is_stopped, process.beats) = (false, 2);
    assert_eq!(watch.look(&mut process, 61_000 * MS), Some(Event::GoesOn));
    process.has_ended = true;
    assert!(matches!(watch.look(&mut process, 61_001 * MS), Some(Event::Lost { cause: Cause::Died, .. })));
    assert_eq!(process.done, ["write", "write"], "it was never killed");
}

#[test]
fn beside_a_guard_that_serves_only_an_end_is_acted_upon() {
    let (mut watch, mut process) = watch(false);
    process.is_stopped = true;
    assert!((1..100).all(|look| watch.look_beside(&mut process, look * 20 * MS).is_none()) && process.done.is_empty());
    // The guard has exited: its previous observations count.
    watch.look(&mut process, 2_001 * MS);
    assert_eq!(process.done, ["kill"]);
    let (mut watch, mut process) = super::tests::watch(false);
    process.has_ended = true;
    assert!(matches!(watch.look_beside(&mut process, MS), Some(Event::Lost { cause: Cause::Died, .. })));
    assert_eq!(process.done, ["write"]);
}

#[test]
fn one_whose_outputs_do_not_latch_cannot_be_spared() {
    let (mut watch, mut process) = watch(true);
    (process.is_stopped, process.latches) = (true, false);
    looks(&mut watch, &mut process, 20, 200);
    assert_eq!(process.done[0], "kill");
}

#[test]
fn what_failed_is_written_again_for_some_seconds() {
    let (mut watch, mut process) = watch(false);
    (process.has_ended, process.is_full) = (true, true);
    watch.look(&mut process, 0);
    looks(&mut watch, &mut process, 20, 12_000);
    assert!(watch.is_settled(), "given up");
    let tried = process.done.len();
    looks(&mut watch, &mut process, 13_000, 1_000);
    assert!(tried > 100 && process.done.len() == tried);
}

#[test]
fn a_heart_that_has_not_beaten_yet_is_not_silent_and_may_be_stopped() {
    let mut pulse = Pulse::new(Bounds::default(), 0, 0);
    assert!((1..100).all(|look| pulse.look(0, || false, look * 20 * MS) == ProcessStanding::Serves));
    assert_eq!(pulse.look(0, || true, 2_000 * MS), ProcessStanding::Stopped);
}

#[test]
fn a_beat_starts_both_bounds_anew() {
    let mut pulse = Pulse::new(Bounds::default(), 1, 0);
    for look in 1..1000 {
        assert_eq!(pulse.look(look / 4, || true, look as i64 * 20 * MS), ProcessStanding::Serves);
    }
}

#[test]
fn who_was_held_up_himself_blames_nobody() {
    let mut pulse = Pulse::new(Bounds::default(), 1, 0);
    assert_eq!(pulse.look(1, || true, 20 * MS), ProcessStanding::Serves);
    assert_eq!(pulse.look(1, || true, 5_000 * MS), ProcessStanding::Serves, "one look: the machine stood still, not the process");
    assert_eq!(pulse.look(2, || true, 5_020 * MS), ProcessStanding::Serves);
}

#[test]
fn a_bound_that_somebody_gave_holds_for_a_stop_too() {
    let mut pulse = Pulse::new(Duration::from_secs(60).into(), 1, 0);
    assert!((1..2_990).all(|look| pulse.look(1, || true, look * 20 * MS) == ProcessStanding::Serves));
    assert!((2_990..3_010).any(|look| pulse.look(1, || true, look * 20 * MS) == ProcessStanding::Stopped));
}

#[test]
fn a_process_is_alone_where_both_who_watch_it_stand_still() {
    type Beats = fn(i64) -> u64;
    let alone = |guard: Beats, supervisor: Beats| {
        let mut watchers = Watchers::new(Duration::from_secs(10), 0);
        (1..1000).find(|look| watchers.look(guard(*look), supervisor(*look), look * 20 * MS))
    };
    let (beats, stands): (Beats, Beats) = (|look| look as u64, |_| 7);
    assert_eq!((alone(beats, stands), alone(stands, beats)), (None, None));
    assert!(matches!(alone(stands, stands), Some(500..=502)));
    assert!(matches!(alone(|_| 0, stands), Some(500..=502)), "one that never came is not there either");
}
