// SPDX-License-Identifier: Apache-2.0
//! Tests of an arm of two servos that exchange in place: torque, goals, errors, recording.
use super::peer::Peer;
use crate::servos::bus::Count;
use crate::servos::protocol::Protocol;
use crate::servos::registers::Map;
use device::{Channel, Direction, Driver, Services};
use serde_json::{Value, json};
use std::sync::Arc;

const BOTH: [Protocol; 2] = [Protocol::Sts, Protocol::Dynamixel];
const PERIOD_NS: i64 = 10_000_000;

struct Arm {
    driver: Box<dyn Driver>,
    channels: Vec<Channel>,
    readings: Vec<u8>,
    commands: Vec<u8>,
    now_ns: i64,
}

fn kind(protocol: Protocol) -> &'static str {
    if protocol == Protocol::Sts { "feetech" } else { "dynamixel" }
}

impl Arm {
    fn made(protocol: Protocol, options: Value) -> Arm {
        let (driver, _) = crate::open(kind(protocol), &options).expect("the options are right");
        let channels = driver.channels().to_vec();
        let end = |direction| channels.iter().filter(|of| of.direction == direction).map(|of| of.offset + of.len).max().unwrap_or(0);
        let (readings, commands) = (vec![0; end(Direction::Read)], vec![0; end(Direction::Write)]);
        Arm { driver, channels, readings, commands, now_ns: 0 }
    }

    fn new(peer: &Peer) -> Arm {
        Arm::made(peer.protocol, options(peer))
    }

    fn at(&self, name: &str) -> usize {
        self.channels.iter().find(|channel| channel.name == name).expect("there is such a channel").offset
    }

    fn get(&self, name: &str) -> f64 {
        f64::from_ne_bytes(self.readings[self.at(name)..][..8].try_into().expect("eight bytes"))
    }

    fn goal(&mut self, name: &str, goal: f64) {
        let at = self.at(name);
        self.commands[at..at + 8].copy_from_slice(&goal.to_ne_bytes());
    }

    fn exchange(&mut self, engaged: [bool; 2]) -> Result<(), String> {
        self.now_ns += PERIOD_NS;
        self.driver.write(self.now_ns, &self.commands, &engaged).and_then(|()| self.driver.read(self.now_ns, &mut self.readings)).map_err(|why| why.message)
    }

    fn opened(mut self) -> Arm {
        self.driver.open(0).expect("it is there");
        self.driver.read(0, &mut self.readings).expect("it answers");
        self
    }

    fn count(&self, counter: Count) -> u64 {
        self.driver.counters().expect("it counts").get(counter)
    }
}

/// Returns options with a latency limit that even the slowest machine meets; no test ever waits that long.
fn options(peer: &Peer) -> Value {
    let servos = json!({ "a": { "id": 1 }, "b": { "id": 2, "direction": -1, "min": -1.0, "max": 1.0 } });
    json!({ "port": peer.path, "servos": servos, "in_place": true, "latency_ns": 60_000_000_000_u64, "retries": 0 })
}

#[test]
fn torque_comes_on_where_the_servo_is_and_goals_move_no_faster_than_allowed() {
    for protocol in BOTH {
        let peer = Peer::new(protocol);
        peer.set(1, Map::of(protocol).goal, 3000);
        let mut arm = Arm::new(&peer).opened();
        arm.goal("a.goal", 1.0);
        arm.goal("b.goal", f64::NAN);
        arm.exchange([true, false]).expect("it answers");
        assert_eq!((peer.torque(1), peer.torque(2), peer.position(1)), (1, 0, 2048), "the goal that it had is forgotten");
        arm.exchange([true, true]).expect("it answers");
        // 3 rad/s for 10 ms are 19.6 counts.
        assert_eq!((peer.position(1), peer.position(2), peer.torque(2)), (2068, 2048, 1));
        for _ in 0..60 {
            arm.exchange([true, true]).expect("it answers");
        }
        assert_eq!(peer.position(1), 2048 + 652);
        assert!((arm.get("a.position") - 1.0).abs() < 1e-3);
        let before = arm.count(Count::GoalsLimited);
        arm.goal("b.goal", 7.0);
        for _ in 0..60 {
            arm.exchange([true, true]).expect("it answers");
        }
        assert_eq!((peer.position(2), arm.count(Count::GoalsLimited) - before), (2048 - 652, 60), "to the end of its range, the other way round");
        arm.exchange([false, true]).expect("it answers");
        assert_eq!((peer.torque(1), peer.torque(2)), (0, 1));
        arm.driver.safe_state();
        assert_eq!((peer.torque(1), peer.torque(2)), (0, 0));
        assert_eq!(arm.count(Count::Exchanges), 124);
        drop(arm);
        peer.join();
    }
}

#[test]
fn an_adapter_may_give_back_what_it_is_given() {
    for protocol in BOTH {
        let peer = Peer::echoing(protocol);
        let mut arm = Arm::new(&peer).opened();
        arm.goal("a.goal", 0.1);
        for _ in 0..20 {
            arm.exchange([true, false]).expect("it answers");
        }
        assert_eq!(peer.position(1), 2048 + 65);
        arm.driver.safe_state();
        assert_eq!(peer.torque(1), 0);
        drop(arm);
        peer.join();
    }
}

#[test]
fn closing_takes_the_torque() {
    let peer = Peer::new(Protocol::Sts);
    let mut arm = Arm::new(&peer).opened();
    arm.goal("a.goal", 0.0);
    arm.exchange([true, false]).expect("it answers");
    assert_eq!(peer.torque(1), 1);
    arm.driver.close();
    assert_eq!(peer.torque(1), 0);
    drop(arm);
    peer.join();
}

#[test]
fn the_guard_takes_the_torque() {
    use std::io::Write;
    for protocol in BOTH {
        let peer = Peer::new(protocol);
        let mut arm = Arm::new(&peer).opened();
        arm.exchange([true, true]).expect("it answers");
        for handle in arm.driver.safe_handles() {
            let mut line = std::fs::File::from(handle.descriptor);
            handle.writes.iter().for_each(|(_, bytes)| line.write_all(bytes).expect("the line is there"));
        }
        // A register read through the same line follows later.
        let register = Map::of(protocol).torque;
        let services = arm.driver.services().expect("it has some");
        let read = std::thread::spawn(move || services.call("read", &json!({ "servo": "a", "address": register.address, "length": 1 })));
        while !read.is_finished() {
            arm.driver.read(0, &mut arm.readings).expect("it answers");
        }
        assert_eq!(read.join().expect("it ends").expect("it answers"), 0);
        drop(arm);
        peer.join();
    }
}

#[test]
fn a_servo_that_is_in_trouble_is_named() {
    for (protocol, bits, word) in [(Protocol::Sts, 0b100, "overheat"), (Protocol::Sts, 0b10_0000, "overload")] {
        let peer = Peer::new(protocol);
        let mut arm = Arm::new(&peer).opened();
        peer.set(2, Map::of(protocol).error, bits);
        let why = arm.exchange([false, false]).expect_err("it is lost");
        assert!(why.contains(&format!("servo 'b' (id 2) on {} reports {word} at ", peer.path)), "{why}");
        peer.set(2, Map::of(protocol).error, 1);
        arm.exchange([false, false]).expect("a low voltage is told and no more");
        drop(arm);
        peer.join();
    }
}

#[test]
fn what_is_not_as_described_is_refused() {
    let map = Map::of(Protocol::Sts);
    let opens = |peer: &Peer, options: Value| Arm::made(Protocol::Sts, options).driver.open(0).map_err(|why| why.message).expect_err(&peer.path);
    let peer = Peer::new(Protocol::Sts);
    let mut other = options(&peer);
    other["servos"]["a"]["model"] = "sts3250".into();
    assert!(opens(&peer, other).contains("is of model 777 (sts3215), not 2825 (sts3250); correct option 'servos'"));
    peer.set(1, map.mode, 1);
    assert!(opens(&peer, options(&peer)).contains("is in mode 1, in which it does not accept positions; set its register 33 to 0"));
    peer.set(1, map.mode, 0);
    peer.set(2, map.answers, 0);
    assert!(opens(&peer, options(&peer)).contains("'b' (id 2)"));
    peer.set(2, map.answers, 1);
    peer.set(2, map.error, 0b10_0000);
    assert!(opens(&peer, options(&peer)).contains("reports overload; reduce its load"));
    peer.lose(1);
    let mut short = options(&peer);
    short["latency_ns"] = 1_000_000.into();
    assert!(opens(&peer, short).contains("does not answer at 1000000 baud; check its power and cable, or run a scan, which finds ids and baud rates"));
    peer.join();
    let gone = Arm::made(Protocol::Sts, json!({ "port": "/dev/null", "servos": { "a": { "id": 1 } } })).driver.open(0).expect_err("no line");
    assert!(gone.message.contains("the serial line /dev/null cannot be opened"), "{}", gone.message);
}

#[test]
fn a_dynamixel_with_a_hardware_error_is_started_anew() {
    let peer = Peer::new(Protocol::Dynamixel);
    peer.set(2, Map::of(Protocol::Dynamixel).error, 0b10_0000);
    drop(Arm::new(&peer).opened());
    assert_eq!(peer.get(2, Map::of(Protocol::Dynamixel).error), 0);
    peer.join();
}

#[test]
fn options_are_checked() {
    let refused = |options: Value| crate::open("feetech", &options).err().expect("it is refused").to_string();
    let of = |servo: Value| refused(json!({ "port": "/dev/x", "servos": { "a": servo } }));
    assert!(refused(json!({ "port": "/dev/x" })).contains("option 'servos': it is missing; give name: {\"id\": 1} for each joint"));
    assert!(of(json!({})).contains("option 'servos.a.id': it is missing"));
    assert!(of(json!({ "id": 253 })).contains("option 'servos.a.id': it cannot be 253: its range is 0 to 252"));
    assert!(of(json!({ "id": 1, "model": "ax12" })).contains("there is no model 'ax12'; the models are sts3215, sts3250, sts"));
    assert!(of(json!({ "id": 1, "min": 1, "max": 0 })).contains("its range is 1 to 0 rad, which is empty"));
    assert!(of(json!({ "id": 1, "direction": 0.5 })).contains("it must be 1 or -1"));
    assert!(of(json!({ "id": 1, "offset": 2 })).contains("option 'servos.a.offset': unknown field `offset`"));
    assert!(of(json!({ "id": "1" })).contains("option 'servos.a.id': invalid type"));
    let twice = refused(json!({ "port": "/dev/x", "servos": { "a": { "id": 1 }, "b": { "id": 1 } } }));
    assert!(twice.contains("'b' and 'a' have the same id, 1"), "{twice}");
    assert!(
        refused(json!({ "port": "/dev/x", "servos": { "a": { "id": 1 } }, "max_speed": 0 }))
            .contains("it cannot be 0 rad/s: its range is above 0 rad/s to 100 rad/s")
    );
}

#[test]
fn travel_across_the_seam_of_an_encoder_is_no_range() {
    let file = std::env::temp_dir().join(format!("servos-seam-{}.json", std::process::id()));
    let peer = Peer::new(Protocol::Sts);
    let position = |counts: u32, id: u8| peer.set(id, crate::servos::registers::Register { address: 56, len: 2 }, counts);
    let mut arm = Arm::new(&peer).opened();
    let travel = |arm: &mut Arm, way: [u32; 4]| {
        for counts in way {
            position(counts, 1);
            position(counts / 2, 2);
            arm.exchange([false, false]).expect("it answers");
        }
    };
    travel(&mut arm, [3000, 3000, 3000, 3000]);
    asked(&mut arm, "record_ranges", json!({})).expect("it begins");
    travel(&mut arm, [3700, 4090, 6, 900]);
    let why = asked(&mut arm, "save_calibration", json!({ "path": file })).expect_err("it is no range");
    assert!(why.contains("was moved across the zero point of its encoder, from count 4090 to 6") && !file.exists(), "{why}");
    travel(&mut arm, [3000, 3000, 3000, 3000]);
    asked(&mut arm, "record_ranges", json!({})).expect("it begins anew");
    travel(&mut arm, [2200, 1400, 3000, 3700]);
    let entries = asked(&mut arm, "save_calibration", json!({ "path": file })).expect("it is saved");
    assert_eq!((&entries["a"]["range_min"], &entries["a"]["range_max"]), (&json!(1400.0), &json!(3700.0)));
    drop(arm);
    peer.join();
    std::fs::remove_file(&file).expect("it is there");
}

/// Makes a request from another thread while the device is exchanging.
fn asked(arm: &mut Arm, service: &'static str, arguments: Value) -> Result<Value, String> {
    let services: Arc<dyn Services> = arm.driver.services().expect("it has some");
    let caller = std::thread::spawn(move || services.call(service, &arguments));
    while !caller.is_finished() {
        arm.driver.read(0, &mut arm.readings).expect("it answers");
    }
    caller.join().expect("it ends").map_err(|why| why.message)
}

#[test]
fn a_calibration_is_recorded_and_read_again() {
    let folder = std::env::temp_dir().join(format!("servos-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("it can be made");
    let file = folder.join("arm.json");
    let (protocol, map) = (Protocol::Sts, Map::of(Protocol::Sts));
    let peer = Peer::new(protocol);
    let position = |counts: u32, id: u8| peer.set(id, crate::servos::registers::Register { address: 56, len: 2 }, counts);
    peer.set(1, map.offset, 0x0800 | 12);
    let mut arm = Arm::new(&peer).opened();
    position(2000, 1);
    arm.exchange([false, false]).expect("it answers");
    assert_eq!(asked(&mut arm, "record_zero", json!({ "servo": "a" })), Ok(json!({ "a": 2000.0, "b": 2048.0 })));
    asked(&mut arm, "record_ranges", json!({})).expect("it begins");
    assert!(asked(&mut arm, "save_calibration", json!({ "path": file })).expect_err("nothing moved").contains("move it from end to end"));
    for (low, high) in [(1000, 1048), (2000, 2048), (3200, 3048)] {
        position(low, 1);
        position(high, 2);
        arm.exchange([false, false]).expect("it answers");
    }
    let entries = asked(&mut arm, "save_calibration", json!({ "path": file })).expect("it is saved");
    assert_eq!(entries["a"], json!({ "id": 1, "drive_mode": 0, "homing_offset": -12, "range_min": 1000.0, "range_max": 3200.0, "zero": 2000.0 }));
    assert_eq!(entries["b"], json!({ "id": 2, "drive_mode": 1, "homing_offset": 0, "range_min": 1048.0, "range_max": 3048.0 }), "as lerobot has it");
    drop(arm);
    let of = json!({ "port": peer.path, "calibration": file, "in_place": true, "latency_ns": 60_000_000_000_u64 });
    let mut arm = Arm::made(protocol, of.clone()).opened();
    assert_eq!(arm.get("a.position"), 1200.0 * std::f64::consts::TAU / 4096.0);
    assert!(asked(&mut arm, "read", json!({ "servo": "c", "address": 5, "length": 1 })).expect_err("none").contains("there is no servo 'c'"));
    assert_eq!(asked(&mut arm, "write", json!({ "servo": "a", "address": 31, "length": 2, "value": 7 })), Ok(Value::Null));
    drop(arm);
    let refused = |options: Value| crate::open("feetech", &options).err().expect("it is refused").to_string();
    for (low, high) in [(0, 4096), (-50, 900)] {
        let beyond = folder.join("beyond.json");
        std::fs::write(&beyond, json!({ "a": { "id": 1, "range_min": low, "range_max": high } }).to_string()).expect("ours");
        let why = refused(json!({ "port": "/dev/x", "calibration": beyond }));
        assert!(why.contains(&format!("its range in the calibration is {low} to {high}, but its encoder counts 0 to 4095; record it again")), "{why}");
    }
    let reversed = folder.join("reversed.json");
    std::fs::write(&reversed, json!({ "a": { "id": 1, "range_min": 3200, "range_max": 1000 } }).to_string()).expect("ours");
    let why = refused(json!({ "port": "/dev/x", "calibration": reversed }));
    assert!(why.contains("the range of 'a', 3200 to 1000, is empty; record it again"), "{why}");
    let why = Arm::made(protocol, of).driver.open(0).expect_err("its offset is another");
    assert!(why.message.contains("has an offset of 7 counts, but the calibration was made with -12"), "{}", why.message);
    peer.join();
    std::fs::remove_dir_all(&folder).expect("it is there");
}

/// Checks that a scan finds IDs and models. A servo may be missed if the machine is busy during the request; another scan then finds it.
#[test]
fn a_scan_finds_ids_and_models() {
    for (protocol, model) in [(Protocol::Sts, "sts3215"), (Protocol::Dynamixel, "xl330-m288")] {
        let peer = Peer::new(protocol);
        let port = json!({ "port": peer.path, "baud": 1_000_000, "latency_ns": 5_000_000 });
        let expected = json!({ "servo_1": { "id": 1, "model": model }, "servo_2": { "id": 2, "model": model } });
        let scan = || device::scan(kind(protocol), &port).expect("the line is there");
        assert!((0..30).any(|_| scan().iter().any(|found| found.options["servos"] == expected && found.options["baud"] == 1_000_000)));
        peer.join();
    }
}
