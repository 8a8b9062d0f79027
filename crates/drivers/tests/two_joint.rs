// SPDX-License-Identifier: Apache-2.0
//! The plant with an arm whose equations fit on a line: efforts, brakes, limits, time, and errors.
//!
//! As in `ur5e.rs`, `OPENGPAC_MUJOCO` names the library; without it these tests check the driver's message.
mod common;
use common::{Machine, robot, scratch, with_mujoco};
use serde_json::json;

const MS: i64 = 1_000_000;
const G: f64 = 9.81;

#[test]
fn its_parts_are_found_whatever_drives_them() {
    with_mujoco(|library| {
        let machine = Machine::open("mujoco", json!({ "path": robot("two_joint.xml"), "library": library }));
        let part = |i: usize, key: &str| machine.about["parts"][i][key].clone();
        assert_eq!((part(0, "name"), part(1, "name")), (json!("shoulder"), json!("elbow")));
        // A motor of gear 2 with inputs to 30; a position servo whose force is limited to 20.
        assert_eq!((part(0, "effort_max"), part(1, "effort_max")), (json!(60.0), json!(20.0)));
        assert_eq!((part(0, "range_min"), part(0, "range_max"), part(1, "home")), (json!(-3.0), json!(3.0), json!(0.0)));
        assert_eq!(machine.about["tool"], json!(false));
        let names: Vec<_> = machine.driver.channels().iter().map(|c| c.name.as_str()).collect();
        let expected = [
            "shoulder.position",
            "shoulder.velocity",
            "shoulder.bias",
            "shoulder.motor_effort",
            "shoulder.motor_limit",
            "elbow.position",
            "elbow.velocity",
            "elbow.bias",
            "elbow.motor_effort",
            "elbow.motor_limit",
            "shoulder.effort",
            "elbow.effort",
            "shoulder.decoupled",
            "elbow.decoupled",
        ];
        assert_eq!(names, expected);
    });
}

#[test]
fn it_is_drawn_from_its_bodies_joints_and_shapes() {
    with_mujoco(|library| {
        let options = json!({ "path": robot("two_joint.xml"), "library": library });
        let drawn = drivers::geometry("mujoco", &options).expect("it loads").expect("it has a shape");
        let plant = drivers::geometry("plant_process", &json!({ "driver": { "kind": "mujoco", "options": options } })).expect("it loads");
        assert_eq!(plant.as_ref(), Some(&drawn), "that it runs apart does not change how it looks");
        let drawn = json!(drawn);
        let bodies = drawn["bodies"].as_array().expect("bodies");
        assert_eq!((&bodies[0]["name"], &bodies[0]["parent"]), (&json!("world"), &json!(null)));
        let of_joint = |name: &str| bodies.iter().find(|body| body["joint"]["name"] == name).unwrap_or_else(|| panic!("no body turns with '{name}'"));
        let (shoulder, elbow) = (of_joint("shoulder"), of_joint("elbow"));
        assert_eq!((&shoulder["joint"]["kind"], &shoulder["parent"]), (&json!("hinge"), &json!("world")));
        assert_eq!(elbow["parent"], shoulder["name"]);
        assert_eq!((&elbow["quaternion"], &elbow["joint"]["reference"]), (&json!([1.0, 0.0, 0.0, 0.0]), &json!(0.0)));
        assert!(shoulder["geoms"].as_array().is_some_and(|geoms| geoms.iter().all(|geom| geom["rgba"].as_array().is_some_and(|rgba| rgba.len() == 4))));
    });
    with_mujoco(|library| {
        let text = r#"<mujoco><asset><material name="red" rgba="1 0 0 1"/><mesh name="t" vertex="0 0 0 2 0 0 0 2 0 0 0 2"/></asset><worldbody><body name="b">
            <joint name="j" axis="0 0 1"/><geom type="mesh" mesh="t" material="red" mass="1"/><geom type="sphere" size="0.1" group="3"/></body></worldbody>
            <actuator><motor joint="j"/></actuator></mujoco>"#;
        let drawn = drivers::geometry("mujoco", &json!({ "path": scratch("meshed", text), "library": library })).expect("it loads").expect("it has a shape");
        let drawn = json!(drawn);
        let shapes = drawn["bodies"][1]["geoms"].as_array().expect("shapes");
        assert_eq!(shapes.len(), 1, "what only collides is left out");
        assert_eq!(shapes[0]["rgba"], json!([1.0, 0.0, 0.0, 1.0]));
        // The triangles need MuJoCo's Python package, which a default interpreter may lack.
        let told = (shapes[0]["kind"].as_str(), shapes[0]["mesh"].as_u64(), drawn["meshes"].as_array().map_or(0, Vec::len));
        assert!([(Some("box"), None, 0), (Some("mesh"), Some(0), 1)].contains(&told), "{told:?}");
    });
    assert!(drivers::geometry("loopback", &json!({ "parts": ["x"] })).expect("nothing is loaded").is_none());
}

#[test]
fn a_free_body_tells_where_it_stands() {
    with_mujoco(|library| {
        let text = r#"<mujoco><worldbody><body name="b"><joint name="j" axis="0 0 1"/><geom size="0.1" mass="1"/></body>
            <body name="ball" pos="1 2 3"><freejoint/><geom size="0.05" mass="1"/></body></worldbody><actuator><motor joint="j"/></actuator></mujoco>"#;
        let mut machine = Machine::open("mujoco", json!({ "path": scratch("free", text), "library": library }));
        machine.read(0);
        assert_eq!(machine.get("ball.pose"), [1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0]);
        machine.read(500 * MS);
        let pose = machine.get("ball.pose");
        let fallen = 0.5 * G * 0.25;
        assert_eq!((pose[0], pose[1], &pose[3..]), (1.0, 2.0, &[1.0, 0.0, 0.0, 0.0][..]));
        assert!((3.0 - pose[2] - fallen).abs() < 0.01, "{pose:?}");
    });
}

#[test]
fn the_bias_is_the_weight_of_the_links_and_holds_them() {
    with_mujoco(|library| {
        let mut machine = Machine::open("mujoco", json!({ "path": robot("two_joint.xml"), "library": library }));
        machine.read(MS);
        let (shoulder, elbow) = (machine.get("shoulder.bias")[0], machine.get("elbow.bias")[0]);
        assert!((shoulder - G * (2.0 * 0.5 + 1.0 * 0.9)).abs() < 1e-9 && (elbow - G * 0.4).abs() < 1e-9, "{shoulder}, {elbow}");
        for k in 1..=1000 {
            machine.read(k * MS);
            for joint in ["shoulder", "elbow"] {
                let bias = machine.get(&format!("{joint}.bias"));
                machine.set(&format!("{joint}.effort"), &bias);
            }
            machine.write(k * MS, &[true, true]);
        }
        assert!(machine.get("shoulder.position")[0].abs() < 1e-9 && machine.get("elbow.position")[0].abs() < 1e-9);
    });
}

#[test]
fn a_joint_that_nobody_commands_is_held_by_its_brake() {
    with_mujoco(|library| {
        let mut machine = Machine::open("mujoco", json!({ "path": robot("two_joint.xml"), "library": library }));
        // The elbow is commanded with zero effort and falls; the shoulder is braked.
        for k in 1..=50 {
            machine.read(k * MS);
            machine.write(k * MS, &[false, true]);
        }
        machine.read(51 * MS);
        assert_eq!((machine.get("shoulder.position")[0], machine.get("shoulder.velocity")[0]), (0.0, 0.0));
        // A pendulum from the level: q'' = -m g l / (m l^2 + armature) at first.
        let acceleration = -G * 0.4 / (0.16 + 0.01 + 1e-6);
        let fallen = machine.get("elbow.position")[0];
        assert!((fallen - 0.5 * acceleration * 0.05f64.powi(2)).abs() < 2.0e-3, "the braked shoulder is as a wall: {fallen}");
        // Now it is not commanded: its brake slows it down with the 20 N.m of its drive, less its weight, and then holds it.
        let speed = machine.get("elbow.velocity")[0];
        machine.write(51 * MS, &[false, false]);
        machine.read(52 * MS);
        assert!((speed..0.0).contains(&machine.get("elbow.velocity")[0]) && speed < -1.0, "it takes time: {speed}");
        machine.read(300 * MS);
        let (held, way) = (machine.get("elbow.position")[0], speed.powi(2) / (2.0 * (20.0 - G * 0.4) / (0.16 + 0.01 + 1e-6)));
        assert!((fallen - held - way).abs() < 0.1 * way, "{fallen} to {held}, expected a way of {way}");
        machine.read(600 * MS);
        assert_eq!((machine.get("elbow.position")[0], machine.get("elbow.velocity")[0]), (held, 0.0));
    });
}

#[test]
fn an_effort_is_a_torque_within_the_limit_of_the_joint() {
    with_mujoco(|library| {
        let after = |effort: f64| {
            let mut machine = Machine::open("mujoco", json!({ "path": robot("two_joint.xml"), "library": library }));
            machine.set("elbow.effort", &[effort]);
            machine.write(0, &[false, true]);
            machine.read(MS);
            machine.get("elbow.velocity")[0]
        };
        let expected = (10.0 - G * 0.4) / (0.16 + 0.01 + 1e-6) * 1e-3;
        assert!((after(10.0) - expected).abs() < 1e-6, "{} rad/s, expected {expected}", after(10.0));
        assert_eq!(after(500.0), after(20.0));
        assert_eq!(after(-500.0), after(-20.0));
    });
}

#[test]
fn the_same_commands_give_the_same_bits_and_every_step_is_made() {
    with_mujoco(|library| {
        let run = |period: i64, timestep: f64| {
            let mut machine = Machine::open("mujoco", json!({ "path": robot("two_joint.xml"), "library": library, "timestep": timestep }));
            machine.set("elbow.effort", &[5.0]);
            machine.write(0, &[false, true]);
            for k in 1..=100 / period {
                machine.read(k * period * MS);
            }
            machine.readings().to_vec()
        };
        assert_eq!(run(1, 0.001), run(1, 0.001));
        assert_eq!(run(1, 0.001), run(20, 0.001), "how often it is read does not matter");
        assert_ne!(run(1, 0.001), run(1, 0.0005), "the time step does");
    });
}

#[test]
fn what_is_not_finite_is_refused_and_what_diverges_is_lost() {
    with_mujoco(|library| {
        let mut machine = Machine::open("mujoco", json!({ "path": robot("two_joint.xml"), "library": library }));
        machine.set("elbow.effort", &[f64::NAN]);
        let error = machine.try_write(0, &[false, true]).expect_err("refused");
        assert!(error.contains("'elbow.effort'"), "{error}");
        // A spring that makes the arm's state overflow within some tenths of a second.
        let text = std::fs::read_to_string(robot("two_joint.xml"))
            .expect("the model")
            .replace(r#"axis="0 -1 0" range="-2.5 2.5""#, r#"axis="0 -1 0" stiffness="-1e4""#);
        let mut machine = Machine::open("mujoco", json!({ "path": scratch("diverges", &text), "library": library }));
        machine.set("elbow.effort", &[1.0]);
        machine.write(0, &[true, true]);
        let error = (1..2000).find_map(|k| machine.try_read(k * MS).err()).expect("it is lost");
        assert!(error.contains("simulated arm failed") && error.contains("Nan") && error.contains("(joint '"), "{error}");
    });
}

#[test]
fn after_the_safe_state_every_brake_holds() {
    with_mujoco(|library| {
        let mut machine = Machine::open("mujoco", json!({ "path": robot("two_joint.xml"), "library": library }));
        machine.set("elbow.effort", &[15.0]);
        machine.write(0, &[true, true]);
        machine.read(20 * MS);
        machine.driver.safe_state();
        let (before, speed) = (machine.get("elbow.position")[0], machine.get("elbow.velocity")[0]);
        machine.read(100 * MS);
        let held = machine.get("elbow.position")[0];
        // Its brake needs some distance, but less than for the elbow alone: the shoulder's brake holds against it.
        let way = speed.powi(2) / (2.0 * (20.0 + G * 0.4) / (0.16 + 0.01 + 1e-6));
        assert!(speed > 1.0 && (before + 0.1 * way..before + way).contains(&held), "{before} to {held} at {speed} rad/s, alone a way of {way}");
        machine.read(500 * MS);
        assert_eq!(["elbow.position", "elbow.velocity", "shoulder.velocity"].map(|name| machine.get(name)[0]), [held, 0.0, 0.0]);
    });
}

#[test]
fn it_is_placed_at_rest_and_what_was_before_leaves_no_trace() {
    with_mujoco(|library| {
        let mut machine = Machine::open("mujoco", json!({ "path": robot("two_joint.xml"), "library": library }));
        let services = machine.driver.services().expect("it has a service");
        let mut moved = |begun: i64| {
            services.call("place", &json!({ "positions": [0.3, -0.2] })).expect("it is placed");
            machine.set("elbow.effort", &[5.0]);
            machine.read(begun * MS);
            let state = ["shoulder.position", "shoulder.velocity", "elbow.position", "elbow.velocity"].map(|name| machine.get(name)[0]);
            assert_eq!(state, [0.3, 0.0, -0.2, 0.0]);
            machine.write(begun * MS, &[false, true]);
            machine.read((begun + 50) * MS);
            machine.readings().to_vec()
        };
        assert_eq!(moved(1), moved(100));
        let refused = |positions| services.call("place", &json!({ "positions": positions })).expect_err("refused").message;
        assert!(refused(json!([0.3])).contains("1 positions for 2 joints: give one for each of shoulder, elbow"));
        assert!(refused(json!([0.3, 9.0])).contains("9 rad of 'elbow' is outside its range, -2.5 to 2.5 rad"));
        services.call("place", &json!({})).expect("back where it was at the start");
        machine.read(200 * MS);
        assert_eq!(machine.get("elbow.position"), [0.0]);
    });
}

#[test]
fn a_model_that_does_not_do_says_why() {
    with_mujoco(|library| {
        let error = |text: &str| drivers::open("mujoco", &json!({ "path": scratch("wrong", text), "library": library })).err().expect("refused").to_string();
        let parse = error("<mujoco><worldbody><body><joint nme='a'/></body></worldbody></mujoco>");
        assert!(parse.contains("cannot load the model") && parse.contains("nme"), "{parse}");
        let idle = error("<mujoco><worldbody><body><joint name='a'/><geom size='1'/></body></worldbody></mujoco>");
        assert!(idle.contains("no actuated joint"), "{idle}");
        let rubbing =
            "<mujoco><worldbody><body><joint name='a' frictionloss='-1'/><geom size='1'/></body></worldbody><actuator><motor joint='a'/></actuator></mujoco>";
        let rubbing = error(rubbing);
        assert!(rubbing.contains("joint 'a' cannot have the frictionloss -1; give 0 or more"), "{rubbing}");
        let missing = drivers::open("mujoco", &json!({ "path": "no_such.xml", "library": library })).err().expect("refused").to_string();
        assert!(missing.contains("no_such.xml"), "{missing}");
        let option =
            drivers::open("mujoco", &json!({ "path": robot("two_joint.xml"), "library": library, "timestep": 5.0 })).err().expect("refused").to_string();
        assert!(option.contains("timestep"), "{option}");
    });
}

#[test]
fn a_model_that_ends_its_process_is_refused_and_this_one_goes_on() {
    with_mujoco(|library| {
        let of = |size: &str| {
            let text = format!(
                "<mujoco><size {size}/><worldbody><body><joint name='a'/><geom size='1'/></body></worldbody><actuator><motor joint='a'/></actuator></mujoco>"
            );
            drivers::open("mujoco", &json!({ "path": scratch("sized", &text), "library": library })).map(|_| ()).map_err(|why| why.to_string())
        };
        let refused = of("nuser_body='2000000000'").expect_err("no memory holds it");
        assert!(refused.contains("MuJoCo ends the process that tries to load it (signal 6) and reports '") && refused.contains("bad_alloc"), "{refused}");
        assert_eq!(of("nuser_body='2'"), Ok(()), "the file is another one now");
    });
}

#[test]
fn every_sensor_of_the_model_is_a_channel_with_its_unit() {
    with_mujoco(|library| {
        let sensors = r#"<sensor><jointpos name="q" joint="elbow"/><jointvel joint="elbow"/><framepos name="place" objtype="xbody" objname="lower"/>
            <touch name="pad" site="pad"/><actuatorpos name="motor" actuator="shoulder"/></sensor></mujoco>"#;
        let text = std::fs::read_to_string(robot("two_joint.xml"))
            .expect("the model")
            .replace("<worldbody>", "<worldbody><geom name='stop' type='box' size='.1 .1 .1' pos='0.9 0 0.9'/>")
            .replace("fromto=\"0 0 0 0.4 0 0\" contype=\"0\" conaffinity=\"0\"/>", "fromto=\"0 0 0 0.4 0 0\"/><site name='pad' size='0.5'/>")
            .replace("</mujoco>", sensors);
        let mut machine = Machine::open("mujoco", json!({ "path": scratch("sensors", &text), "library": library }));
        let found: Vec<_> = machine.driver.channels().iter().filter(|c| c.name.starts_with("sensor.")).cloned().collect();
        let told: Vec<_> = found.iter().map(|c| (c.name.as_str(), c.type_text.as_str(), c.unit.as_str())).collect();
        let expected = [
            ("sensor.q", "double", "rad"),
            ("sensor.sensor_1", "double", "rad/s"),
            ("sensor.place", "double[3]", "m"),
            ("sensor.pad", "double", "N"),
            ("sensor.motor", "double", ""),
        ];
        assert_eq!(told, expected);
        // The forearm is pressed onto the stop, first gently, then harder.
        let mut pressed = |effort: f64, until_ms: i64| {
            machine.set("elbow.effort", &[effort]);
            machine.write(0, &[false, true]);
            machine.read(until_ms * MS);
            assert_eq!(machine.get("sensor.q"), machine.get("elbow.position"));
            assert_eq!(machine.get("sensor.place"), [0.5, 0.0, 1.0], "the elbow is where the braked shoulder holds it");
            machine.get("sensor.pad")[0]
        };
        let (lightly, hard) = (pressed(-5.0, 1_000), pressed(-15.0, 2_000));
        assert!(lightly > 5.0 && hard > 1.5 * lightly, "{lightly} N, {hard} N");
    });
}

#[test]
fn a_free_body_beside_the_arm_shifts_no_channel() {
    with_mujoco(|library| {
        let text = std::fs::read_to_string(robot("two_joint.xml"))
            .expect("the model")
            .replace("<worldbody>", "<worldbody><geom type='plane' size='2 2 .1'/><body name='ball' pos='3 0 1'><freejoint/><geom size='.1' mass='1'/></body>")
            .replace("</mujoco>", "<keyframe><key name='home' qpos='3 0 1 1 0 0 0 0.25 -0.5'/></keyframe></mujoco>");
        let mut machine = Machine::open("mujoco", json!({ "path": scratch("ball", &text), "library": library }));
        machine.read(200 * MS);
        assert_eq!((machine.get("shoulder.position"), machine.get("elbow.position")), (vec![0.25], vec![-0.5]));
        assert_eq!(machine.about["parts"][1]["home"], json!(-0.5));
    });
}

/// A chain of three links whose joints have no inertia of their own: a servo that ignores the other links makes it oscillate.
const THREE_LINKS: &str = r#"<mujoco><option timestep="0.002"/><worldbody><body><joint name="a" axis="0 1 0"/>
    <inertial pos="0.2 0 0" mass="4" diaginertia="0.008 0.06 0.06"/><body pos="0.4 0 0"><joint name="b" axis="0 1 0"/>
    <inertial pos="0.2 0 0" mass="3" diaginertia="0.006 0.045 0.045"/><body pos="0.4 0 0"><joint name="c" axis="0 1 0"/>
    <inertial pos="0.2 0 0" mass="1" diaginertia="0.002 0.015 0.015"/></body></body></body></worldbody>
    <actuator><motor joint="a" ctrlrange="-100 100"/><motor joint="b" ctrlrange="-100 100"/><motor joint="c" ctrlrange="-100 100"/></actuator></mujoco>"#;

/// Returns the gains of a joint: for efforts ("servo") or decoupled efforts.
fn gains(machine: &Machine, joint: usize, of: &str) -> (f64, f64) {
    let number = |name: &str| machine.about["parts"][joint][of][name].as_f64().expect("a gain");
    (number("kp"), number("kd"))
}

#[test]
fn a_servo_of_decoupled_efforts_holds_and_moves_a_chain_without_rotor_inertia() {
    with_mujoco(|library| {
        let mut machine = Machine::open("mujoco", json!({ "path": scratch("three_links", THREE_LINKS), "library": library }));
        let servo: Vec<_> = (0..3).map(|j| gains(&machine, j, "decoupled")).collect();
        let mut worst: f64 = 0.0;
        for k in 0..3000 {
            machine.read(k * MS);
            // Half a cosine to 0.5 rad in one second, then rest.
            let phase = (k as f64 * 1e-3).min(1.0) * std::f64::consts::PI;
            let (goal, speed) = (0.25 * (1.0 - phase.cos()), 0.25 * std::f64::consts::PI * phase.sin());
            for (j, name) in ["a", "b", "c"].iter().enumerate() {
                let at = |what: &str| machine.get(&format!("{name}.{what}"))[0];
                let error = goal - at("position");
                worst = worst.max(error.abs());
                let decoupled = servo[j].0 * error + servo[j].1 * (speed - at("velocity"));
                machine.set(&format!("{name}.decoupled"), &[decoupled]);
            }
            machine.write(k * MS, &[false, false, false, true, true, true]);
        }
        assert!(worst < 0.01, "greatest error {worst} rad");
        for name in ["a", "b", "c"] {
            let (position, velocity) = (machine.get(&format!("{name}.position"))[0], machine.get(&format!("{name}.velocity"))[0]);
            assert!((position - 0.5).abs() < 1e-6 && velocity.abs() < 1e-6, "{name}: {position} rad, {velocity} rad/s");
        }
    });
}

#[test]
fn a_motor_tells_what_it_gave_within_its_limit() {
    with_mujoco(|library| {
        let mut machine = Machine::open("mujoco", json!({ "path": scratch("three_links_weak", THREE_LINKS), "library": library }));
        machine.read(MS);
        assert_eq!((machine.get("a.motor_effort"), machine.get("a.motor_limit")), (vec![0.0], vec![100.0]), "its brake holds it");
        machine.set("a.effort", &[250.0]);
        machine.set("b.decoupled", &[1e4]);
        machine.write(MS, &[true, false, false, false, true, false]);
        // The step is 2 ms: the one during which the effort was written continues without it.
        machine.read(3 * MS);
        assert_eq!((machine.get("a.motor_effort"), machine.get("b.motor_effort")), (vec![100.0], vec![100.0]));
        machine.set("a.effort", &[5.0]);
        machine.write(3 * MS, &[true, false, false, false, true, false]);
        machine.read(5 * MS);
        assert_eq!(machine.get("a.motor_effort"), [5.0]);
    });
}

#[test]
fn a_servo_of_efforts_alone_holds_such_a_chain_too() {
    with_mujoco(|library| {
        let mut machine = Machine::open("mujoco", json!({ "path": scratch("three_links_alone", THREE_LINKS), "library": library }));
        let servo: Vec<_> = (0..3).map(|j| gains(&machine, j, "servo")).collect();
        let goals = [0.02, -0.01, 0.03];
        for k in 0..4000 {
            machine.read(k * MS);
            for (j, name) in ["a", "b", "c"].iter().enumerate() {
                let at = |what: &str| machine.get(&format!("{name}.{what}"))[0];
                let effort = servo[j].0 * (goals[j] - at("position")) - servo[j].1 * at("velocity") + at("bias");
                machine.set(&format!("{name}.effort"), &[effort]);
            }
            machine.write(k * MS, &[true, true, true, false, false, false]);
        }
        for (name, goal) in ["a", "b", "c"].iter().zip(goals) {
            let error = machine.get(&format!("{name}.position"))[0] - goal;
            assert!(error.abs() < 1e-3, "{name}: {error} rad off");
        }
    });
}

#[test]
fn an_arm_starts_inside_its_ranges() {
    with_mujoco(|library| {
        let text = r#"<mujoco><compiler angle="radian"/><worldbody><body><joint name="a" axis="0 0 1" range="-3 -0.5"/><geom size="0.1"/></body></worldbody>
            <actuator><motor joint="a"/></actuator></mujoco>"#;
        let mut machine = Machine::open("mujoco", json!({ "path": scratch("outside", text), "library": library }));
        machine.read(MS);
        assert_eq!((machine.get("a.position")[0], &machine.about["parts"][0]["home"]), (-0.5, &json!(-0.5)), "its zero is outside");
    });
}
