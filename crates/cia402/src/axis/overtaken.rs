// SPDX-License-Identifier: Apache-2.0
//! Tests of a stop that occurs during homing: the drive takes some time to accept objects, and the stop occurs in the meantime.
use super::homing::HomingProgress;
use super::services::{Reach, ServiceState};
use crate::commander::{Commander, Scale};
use crate::homing::HomingState;
use crate::objects::Entry;
use crate::states::Mode;
use serde_json::{Value, json};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

const SCALE: Scale = Scale { mode: Mode::Position, counts: 1000.0, offset: 0.0, speed_max: 1.0, rated_torque: 1.0 };

/// A drive that reports the arrival of an object, and accepts it only when permitted.
struct HeldDrive {
    came: Sender<()>,
    takes: Receiver<()>,
}

impl Reach for HeldDrive {
    fn upload(&mut self, _: usize, _: Entry) -> Result<Vec<u8>, String> {
        Err("nothing is read".to_owned())
    }

    fn download(&mut self, _: usize, _: Entry, _: &[u8]) -> Result<(), String> {
        self.came.send(()).map_err(|gone| gone.to_string())?;
        self.takes.recv().map_err(|gone| gone.to_string())
    }
}

/// An axis and its cycle.
struct Rig {
    shared: ServiceState<HeldDrive>,
    came: Receiver<()>,
    takes: Sender<()>,
}

impl Rig {
    fn new() -> Rig {
        let (came, takes) = (channel(), channel());
        let shared = ServiceState::new("the bus", [("x".to_owned(), "axis 'x'".to_owned(), SCALE)].into_iter());
        shared.reach(HeldDrive { came: came.0, takes: takes.1 });
        Rig { shared, came: came.1, takes: takes.0 }
    }

    /// Brings the axes to their safe state, as a driver does.
    fn rest(&self, commander: &mut Commander) {
        self.shared.homes.rest();
        commander.stop();
    }

    /// Performs a write as a driver does.
    fn write(&self, commander: &mut Commander) -> HomingState {
        self.shared.homes.serve(0, commander, true, false);
        commander.homed()
    }

    /// Requests homing, runs `meanwhile` while the object is in transit, then performs writes until the service has answered.
    fn home(&self, meanwhile: impl FnOnce(&mut Commander)) -> (Result<Value, String>, HomingState) {
        let (mut commander, shared) = (Commander::new(SCALE, None), &self.shared);
        let answer = std::thread::scope(|scope| {
            let asked = scope.spawn(|| shared.carry_out("home", &json!({ "axis": "x", "method": 35, "timeout_s": 3600 }), &|| false));
            self.came.recv().expect("an object comes");
            meanwhile(&mut commander);
            self.takes.send(()).expect("it waits for it");
            while !asked.is_finished() {
                if self.write(&mut commander) == HomingState::GoingOn {
                    self.shared.homes.answer(0, HomingProgress::Attained);
                }
                std::thread::yield_now();
            }
            asked.join().expect("it does not panic")
        });
        (answer, commander.homed())
    }
}

fn stopped() -> Result<Value, String> {
    Err("axis 'x': homing was stopped: its device was brought to its safe state".to_owned())
}

#[test]
fn nothing_comes_between_and_it_begins() {
    let (answer, homed) = Rig::new().home(|_| ());
    assert_eq!((answer, homed), (Ok(Value::Null), HomingState::GoingOn));
}

#[test]
fn a_safe_state_between_the_first_object_and_the_question_keeps_it_from_beginning() {
    let rig = Rig::new();
    assert_eq!(rig.home(|commander| rig.rest(commander)), (stopped(), HomingState::No));
    assert_eq!(rig.home(|_| ()).0, Ok(Value::Null), "the next one is another");
}

#[test]
fn so_does_one_with_writes_behind_it() {
    let rig = Rig::new();
    let homed = rig.home(|commander| {
        rig.rest(commander);
        rig.write(commander);
        rig.write(commander);
    });
    assert_eq!(homed, (stopped(), HomingState::No));
}

#[test]
fn what_was_asked_and_not_yet_served_is_dropped() {
    let rig = Rig::new();
    let (mut commander, homes) = (Commander::new(SCALE, None), &rig.shared.homes);
    let begun = homes.begin(&|| false).expect("no stop is latched");
    std::thread::scope(|scope| {
        let asked = scope.spawn(move || homes.go(0, begun, &json!({})));
        while homes.asked(0) != HomingProgress::Home {
            std::thread::yield_now();
        }
        rig.rest(&mut commander);
        assert_eq!(rig.write(&mut commander), HomingState::No);
        let stopped = asked.join().expect("it does not panic");
        assert_eq!(stopped, Err("homing was stopped: its device was brought to its safe state".to_owned()));
    });
}

#[test]
fn one_that_comes_to_a_latched_stop_sends_nothing() {
    let rig = Rig::new();
    let refused = rig.shared.home(&json!({ "axis": "x", "method": 35 }), &|| true);
    assert_eq!(refused, Err(format!("axis 'x': {}", device::under_a_stop("home").message)));
    assert!(rig.came.try_recv().is_err(), "its drive is sent nothing");
}

#[test]
fn under_a_latched_stop_an_object_that_moves_is_not_written_and_a_setting_is() {
    let rig = Rig::new();
    let write = |index: u16, is_stopped: bool| {
        let arguments = json!({ "axis": "x", "index": index, "value": 15, "bits": 16 });
        rig.shared.carry_out("write_object", &arguments, &|| is_stopped)
    };
    let refused = "axis 'x': object 0x6040:0 is its control word, but an emergency stop is latched: remove its cause and reset it first";
    assert_eq!(write(0x6040, true), Err(refused.to_owned()));
    assert!(rig.came.try_recv().is_err(), "its drive is sent nothing");
    for (index, is_stopped) in [(0x6065, true), (0x6040, false)] {
        rig.takes.send(()).expect("it waits for it");
        assert_eq!(write(index, is_stopped), Ok(Value::Null));
        rig.came.recv().expect("an object comes");
    }
}

#[test]
fn a_stop_that_is_latched_while_an_object_waits_for_another_is_seen() {
    let rig = Rig::new();
    let (shared, is_stopped) = (&rig.shared, AtomicBool::new(false));
    let word = json!({ "axis": "x", "index": 0x6040, "value": 15, "bits": 16 });
    std::thread::scope(|scope| {
        let first = scope.spawn(|| shared.carry_out("write_object", &word, &|| false));
        rig.came.recv().expect("the first one has the way to the drives");
        let second = scope.spawn(|| shared.carry_out("write_object", &word, &|| is_stopped.load(Ordering::Acquire)));
        is_stopped.store(true, Ordering::Release);
        rig.takes.send(()).expect("it waits for it");
        assert_eq!(first.join().expect("it does not panic"), Ok(Value::Null));
        assert!(second.join().expect("it does not panic").is_err_and(|why| why.contains("an emergency stop is latched")));
    });
    assert!(rig.came.try_recv().is_err(), "nothing more was sent");
}

#[test]
fn a_stop_between_the_number_and_the_look_is_seen_by_one_of_both() {
    let rig = Rig::new();
    let mut commander = Commander::new(SCALE, None);
    let begun = rig.shared.homes.begin(&|| {
        rig.shared.homes.rest();
        false
    });
    let (answer, homes) = (begun.expect("the stop was reset already"), &rig.shared.homes);
    std::thread::scope(|scope| {
        let asked = scope.spawn(move || homes.go(0, answer, &json!({})));
        while !asked.is_finished() {
            assert_eq!(rig.write(&mut commander), HomingState::No);
        }
        assert!(asked.join().expect("it does not panic").is_err_and(|why| why.starts_with("homing was stopped")));
    });
}
