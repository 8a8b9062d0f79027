// SPDX-License-Identifier: Apache-2.0
//! The plant under conditions that a servo does not see: time steps that differ from its period, and joints coupled to another one.
//!
//! As in `two_joint.rs`, `OPENGPAC_MUJOCO` names the library.
mod common;
use common::{Machine, scratch, with_mujoco};
use serde_json::json;

const MS: i64 = 1_000_000;
const G: f64 = 9.81;
/// Engaged channels of a machine with one joint: effort and decoupled effort.
const EFFORT: [bool; 2] = [true, false];
const DECOUPLED: [bool; 2] = [false, true];

/// Returns a flywheel of 1 kg.m^2 that is simulated in steps of `step_ms`.
fn flywheel(step_ms: f64) -> String {
    format!(
        r#"<mujoco><option timestep="{}"/><worldbody><body><joint name="j" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>
        <actuator><motor joint="j" ctrlrange="-100 100"/></actuator></mujoco>"#,
        1e-3 * step_ms
    )
}

#[test]
fn a_reading_is_of_its_release_whatever_the_time_step_is() {
    with_mujoco(|library| {
        for step_ms in [0.3, 0.7, 1.0, 1.5, 2.0, 2.5, 7.0] {
            let mut machine = Machine::open("mujoco", json!({ "path": scratch("flywheel", &flywheel(step_ms)), "library": library }));
            let (mut speed, mut last, mut least, mut most) = (0.0, 0.0, f64::INFINITY, 0.0_f64);
            for k in 0..200 {
                machine.read(k * MS);
                machine.set("j.effort", &[if k < 50 { 20.0 } else { 0.0 }]);
                machine.write(k * MS, &EFFORT);
                let position = machine.get("j.position")[0];
                if k > 60 {
                    speed = machine.get("j.velocity")[0];
                    (least, most) = (least.min(position - last), most.max(position - last));
                }
                last = position;
            }
            assert!(speed > 0.9 && (most - least) < 1e-12 && (most - 1e-3 * speed).abs() < 1e-12, "{step_ms} ms: {speed} rad/s, {least} to {most} rad");
        }
    });
}

#[test]
fn a_servo_beside_longer_steps_gives_a_smooth_effort() {
    with_mujoco(|library| {
        let mut machine = Machine::open("mujoco", json!({ "path": scratch("led_flywheel", &flywheel(2.5)), "library": library }));
        let of = |name: &str| machine.about["parts"][0]["decoupled"][name].as_f64().expect("a gain");
        let (kp, kd) = (of("kp"), of("kd"));
        let mut efforts = Vec::new();
        for k in 0..600 {
            machine.read(k * MS);
            // Acceleration of 2 rad/s^2, so that the set-point rises all the time.
            let time_s = k as f64 * 1e-3;
            let asked = kp * (time_s * time_s - machine.get("j.position")[0]) + kd * (2.0 * time_s - machine.get("j.velocity")[0]);
            machine.set("j.decoupled", &[asked]);
            machine.write(k * MS, &DECOUPLED);
            efforts.push(machine.get("j.motor_effort")[0]);
        }
        let settled = &efforts[300..];
        let swing = settled.iter().fold(0.0_f64, |most, effort| most.max((effort - 2.0).abs()));
        assert!(swing < 0.02, "it swings by {swing} N.m about 2 N.m");
    });
}

#[test]
fn a_motor_bears_what_follows_its_joint() {
    with_mujoco(|library| {
        let body = |name: &str, kg: u8| {
            format!(r#"<body pos="0 {kg} 0"><joint name="{name}" type="slide" axis="0 0 1"/><inertial pos="0 0 0" mass="{kg}" diaginertia="1 1 1"/></body>"#)
        };
        // The fingers of a gripper: 2 follows 1 at twice its travel, 3 follows 2 in the opposite direction. Each is a kinematic tree of
        // its own.
        let text = format!(
            r#"<mujoco><option timestep="0.001"/><worldbody>{}{}{}</worldbody>
            <equality><joint joint1="second" joint2="first" polycoef="0 2 0 0 0"/><joint joint1="third" joint2="second" polycoef="0 -1 0 0 0"/></equality>
            <actuator><motor joint="first" ctrlrange="-1000 1000"/></actuator></mujoco>"#,
            body("first", 1),
            body("second", 3),
            body("third", 2)
        );
        let mut machine = Machine::open("mujoco", json!({ "path": scratch("fingers", &text), "library": library }));
        for k in 0..1000 {
            machine.read(k * MS);
            machine.set("first.decoupled", &[0.0]);
            machine.write(k * MS, &DECOUPLED);
        }
        let weight = (1.0 + 2.0 * 3.0 - 2.0 * 2.0) * G;
        let told = [machine.get("first.motor_effort")[0], machine.get("first.bias")[0]];
        assert!(told.iter().all(|effort| (effort - weight).abs() < 1e-6), "{told:?} N, not {weight} N");
        let (position, velocity) = (machine.get("first.position")[0], machine.get("first.velocity")[0]);
        // It is not controlled, and the coupling is soft: it settles once.
        assert!(position.abs() < 1e-3 && velocity.abs() < 1e-9, "{position} m, {velocity} m/s");
        // A servo on decoupled efforts moves the inertia of all of them.
        let gains = &machine.about["parts"][0]["decoupled"];
        let (kp, kd) = (gains["kp"].as_f64().expect("a gain"), gains["kd"].as_f64().expect("a gain"));
        assert!((kd * kd / (4.0 * kp) - (1.0 + 4.0 * 3.0 + 4.0 * 2.0)).abs() < 1e-9, "{gains}");
    });
}
