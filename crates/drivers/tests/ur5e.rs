// SPDX-License-Identifier: Apache-2.0
//! Our UR5e against its published numbers, and a servo on it, with the real MuJoCo library.
//!
//! `OPENGPAC_MUJOCO` names the library (`make test` sets it). Without it these tests check that the driver reports what is missing.
mod common;
use common::{Machine, robot, with_mujoco};
use serde_json::json;
use std::f64::consts::PI;

const JOINTS: [&str; 6] = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"];

#[test]
fn the_parts_are_the_published_joints() {
    with_mujoco(|library| {
        let (_, about) = drivers::open("mujoco", &json!({ "path": robot("ur5e.xml"), "library": library })).expect("it loads");
        let parts = about["parts"].as_array().expect("a list");
        let names: Vec<_> = parts.iter().map(|p| p["name"].as_str().expect("a name")).collect();
        assert_eq!(names, JOINTS);
        let home = [0.0, -90.0, 90.0, -90.0, -90.0, 0.0];
        for (i, part) in parts.iter().enumerate() {
            let number = |key: &str| part[key].as_f64().expect("a number");
            let range = if i == 2 { PI } else { 2.0 * PI };
            assert!((number("range_max") - range).abs() < 1e-12 && (number("range_min") + range).abs() < 1e-12, "{part}");
            assert_eq!(number("effort_max"), if i < 3 { 150.0 } else { 28.0 });
            assert!((number("home") - home[i] * PI / 180.0).abs() < 1e-12, "{part}");
            assert!(part["servo"]["kp"].as_f64() > Some(100.0), "{part}");
        }
        assert_eq!(about["tool"], json!(true));
    });
}

/// Returns the potential energy of the arm at joint angles `q`, from the DH parameters, masses and centres of mass of the support
/// article.
fn potential_energy(q: &[f64; 6]) -> f64 {
    let d = [0.1625, 0.0, 0.0, 0.1333, 0.0997, 0.0996];
    let a = [0.0, -0.425, -0.3922, 0.0, 0.0, 0.0];
    let alpha = [PI / 2.0, 0.0, 0.0, PI / 2.0, -PI / 2.0, 0.0];
    let mass = [3.761, 8.058, 2.846, 1.37, 1.3, 0.365];
    let centre =
        [[0.0, -0.02561, 0.00193], [0.2125, 0.0, 0.11336], [0.15, 0.0, 0.0265], [0.0, -0.0018, 0.01634], [0.0, 0.0018, 0.01634], [0.0, 0.0, -0.001159]];
    let mut pose = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    let mut energy = 0.0;
    for i in 0..6 {
        let (s, c) = q[i].sin_cos();
        let (sa, ca) = alpha[i].sin_cos();
        let link = [[c, -s * ca, s * sa, a[i] * c], [s, c * ca, -c * sa, a[i] * s], [0.0, sa, ca, d[i]]];
        let before = pose;
        for r in 0..3 {
            for k in 0..4 {
                pose[r][k] = (0..3).map(|m| before[r][m] * link[m][k]).sum::<f64>() + if k == 3 { before[r][3] } else { 0.0 };
            }
        }
        let height = (0..3).map(|k| pose[2][k] * centre[i][k]).sum::<f64>() + pose[2][3];
        energy += mass[i] * 9.81 * height;
    }
    // The tool: 10 g at the origin of the last frame.
    energy + 0.01 * 9.81 * pose[2][3]
}

/// The bias at rest is the gradient of the potential energy: this ties frames, signs, masses and centres to the article at once.
#[test]
fn gravity_torques_are_those_of_the_dh_parameters() {
    with_mujoco(|library| {
        let poses = [[0.0, -PI / 2.0, PI / 2.0, -PI / 2.0, -PI / 2.0, 0.0], [0.3, -0.7, 1.1, -0.4, 0.9, -1.3], [-2.0, 0.2, -1.5, 2.2, -0.6, 0.8]];
        let text = std::fs::read_to_string(robot("ur5e.xml")).expect("the model");
        for q in poses {
            let key = q.map(|x| x.to_string()).join(" ");
            let from = text.find("qpos=\"").expect("a keyframe") + 6;
            let to = from + text[from..].find('"').expect("its end");
            let path = common::scratch("ur5e_pose", &format!("{}{key}{}", &text[..from], &text[to..]));
            let mut machine = Machine::open("mujoco", json!({ "path": path, "library": library }));
            machine.read(1_000_000);
            for (i, joint) in JOINTS.iter().enumerate() {
                let (mut up, mut down) = (q, q);
                up[i] += 1e-5;
                down[i] -= 1e-5;
                let expected = (potential_energy(&up) - potential_energy(&down)) / 2e-5;
                let bias = machine.get(&format!("{joint}.bias"))[0];
                assert!((bias - expected).abs() < 1e-5, "{joint}: {bias} N.m, by the article {expected} N.m at {q:?}");
            }
        }
    });
}

#[test]
fn with_the_default_gains_a_servo_tracks_one_radian_a_second() {
    with_mujoco(|library| {
        let mut machine = Machine::open("mujoco", json!({ "path": robot("ur5e.xml"), "library": library }));
        let servo: Vec<(f64, f64)> = machine.about["parts"]
            .as_array()
            .expect("parts")
            .iter()
            .map(|p| (p["servo"]["kp"].as_f64().expect("kp"), p["servo"]["kd"].as_f64().expect("kd")))
            .collect();
        machine.read(0);
        let start: Vec<f64> = JOINTS.iter().map(|j| machine.get(&format!("{j}.position"))[0]).collect();
        let mut worst: f64 = 0.0;
        for k in 1..=2500i64 {
            let t = k as f64 * 1e-3;
            machine.read(k * 1_000_000);
            // Half a cosine: rest to rest over 2 s, 1 rad/s at the peak.
            let phase = (t / 2.0).min(1.0) * PI;
            let (turn, rate) = (0.5 * (1.0 - phase.cos()) * 4.0 / PI, if t < 2.0 { phase.sin() } else { 0.0 });
            for (i, joint) in JOINTS.iter().enumerate() {
                let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
                let at = |name: &str| machine.get(&format!("{joint}.{name}"))[0];
                let error = start[i] + sign * turn - at("position");
                worst = worst.max(error.abs());
                let effort = servo[i].0 * error + servo[i].1 * (sign * rate - at("velocity")) + at("bias");
                machine.set(&format!("{joint}.effort"), &[effort]);
            }
            machine.write(k * 1_000_000, &[true; 7]);
        }
        assert!(worst < 0.01, "greatest error {worst} rad");
        for joint in JOINTS {
            assert!(machine.get(&format!("{joint}.velocity"))[0].abs() < 1e-3, "{joint} is at rest");
        }
    });
}

#[test]
fn the_tool_feels_a_push() {
    with_mujoco(|library| {
        let mut machine = Machine::open("mujoco", json!({ "path": robot("ur5e.xml"), "library": library }));
        machine.set("tool.push", &[0.0, 0.0, 30.0]);
        machine.write(0, &[false, false, false, false, false, false, true]);
        machine.read(2_000_000);
        let force = machine.get("tool.force");
        // 30 N up, less the weight of the tool, 0.1 N; the tool's z axis points down, and the force on the tool acts on the flange.
        assert!((force[2] + 29.9).abs() < 0.05 && force[0].abs() < 0.1 && force[1].abs() < 0.1, "{force:?}");
    });
}
