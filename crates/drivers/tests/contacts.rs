// SPDX-License-Identifier: Apache-2.0
//! The contacts of a plant: their positions and forces, compared with statics.
//!
//! As in `ur5e.rs`, `OPENGPAC_MUJOCO` names the library; without it these tests check the driver's message.
mod common;
use common::{Machine, scratch, with_mujoco};
use serde_json::{Value, json};

const MS: i64 = 1_000_000;
const G: f64 = 9.81;

/// Writes a model with a ball of 2 kg and a box of 1 kg on a floor, next to an arm with one joint; `name` is the file's name.
fn table(name: &str) -> std::path::PathBuf {
    let text = r#"<mujoco><worldbody><geom type="plane" size="2 2 .1"/>
        <body name="b" pos="0 0 1"><joint name="j" axis="0 0 1"/><geom size="0.1" mass="1"/><site name="s"/></body>
        <body name="ball" pos="0.1 0.2 0.1"><freejoint/><geom size="0.1" mass="2"/></body>
        <body name="box" pos="0.6 0 0.1"><freejoint/><geom type="box" size="0.1 0.1 0.1" mass="1"/></body></worldbody>
        <sensor><framepos objtype="body" objname="ball"/></sensor><actuator><motor joint="j"/></actuator></mujoco>"#;
    scratch(name, text)
}

/// Waits until everything is at rest.
fn rest(machine: &mut Machine) {
    (0..40).for_each(|at| machine.read(at * 100 * MS));
}

/// Returns position and force of each reported contact.
fn contacts(machine: &Machine) -> Vec<([f64; 3], [f64; 3])> {
    let of = |row: &[f64]| ([row[0], row[1], row[2]], [row[3], row[4], row[5]]);
    machine.get("contacts").chunks(6).map(of).filter(|(_, force)| *force != [0.0; 3]).collect()
}

#[test]
fn what_rests_is_carried() {
    with_mujoco(|library| {
        let mut machine = Machine::open("mujoco", json!({ "path": table("carried"), "library": library, "contacts": 8 }));
        rest(&mut machine);
        let told = contacts(&machine);
        assert_eq!(told.len(), 5, "one of the ball, four of the box: {told:?}");
        // Contacts are sorted by force, largest first.
        let (place, force) = told[0];
        assert!((place[0] - 0.1).abs() < 1e-3 && (place[1] - 0.2).abs() < 1e-3 && place[2].abs() < 1e-3, "{place:?}");
        assert!((force[2] - 2.0 * G).abs() < 0.01 && force[0].abs() < 0.01 && force[1].abs() < 0.01, "{force:?}");
        let of_box: f64 = told[1..].iter().map(|(_, force)| force[2]).sum();
        assert!((of_box - G).abs() < 0.01, "{of_box}");
        for (place, _) in &told[1..] {
            assert!(((place[0] - 0.6).abs() - 0.1).abs() < 1e-3 && (place[1].abs() - 0.1).abs() < 1e-3, "{place:?}");
        }
    });
}

#[test]
fn a_plant_moves_to_the_same_bits_whether_contacts_are_told_or_not() {
    with_mujoco(|library| {
        let run = |contacts: Value| {
            let mut machine = Machine::open("mujoco", json!({ "path": table(&format!("bits{contacts}")), "library": library, "contacts": contacts }));
            (0..200).map(|at| (machine.read(at * 10 * MS), bits(&machine)).1).collect::<Vec<_>>()
        };
        assert_eq!(run(json!(0)), run(json!(3)));
    });
}

/// Returns the values of the plant without its contacts.
fn bits(machine: &Machine) -> Vec<u64> {
    ["ball.pose", "box.pose", "sensor.sensor_0", "j.position"].iter().flat_map(|name| machine.get(name)).map(f64::to_bits).collect()
}

#[test]
fn fewer_are_told_than_there_are_and_none_where_none_is_asked_for() {
    with_mujoco(|library| {
        let mut machine = Machine::open("mujoco", json!({ "path": table("fewer"), "library": library, "contacts": 2 }));
        rest(&mut machine);
        assert_eq!(machine.get("contacts").len(), 12);
        assert_eq!(contacts(&machine).len(), 2);
        let names = |machine: &Machine| machine.driver.channels().iter().map(|channel| channel.name.clone()).collect::<Vec<_>>();
        assert!(names(&machine).contains(&"sensor.sensor_0".to_owned()) && !names(&machine).iter().any(|name| name.contains("opengpac")));
        let machine = Machine::open("mujoco", json!({ "path": table("none"), "library": library }));
        assert!(!names(&machine).contains(&"contacts".to_owned()));
        let refused = drivers::open("mujoco", &json!({ "path": table("many"), "library": library, "contacts": 65 }));
        let refused = refused.err().expect("too many").to_string();
        assert!(refused.contains("'contacts'") && refused.contains("it cannot be 65: its range is 0 to 64"), "{refused}");
    });
}
