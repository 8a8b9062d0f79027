// SPDX-License-Identifier: Apache-2.0
//! Effort and speed limits that a model's actuators impose on its joints.
use super::fields::Fields;
use device::UNLIMITED;

const TRANSMISSION_JOINT: i32 = 0;
const TRANSMISSION_JOINT_IN_PARENT: i32 = 1;
/// Columns of `actuator_gear` and of `actuator_gainprm`.
const GEAR_COLUMNS: usize = 6;

/// Returns the effort limit of each joint, summed over its actuators; `None` for a joint without an actuator.
pub(super) fn efforts(fields: &Fields, joints: usize) -> Vec<Option<f64>> {
    let (kind, target, gear) = (fields.ints("actuator_trntype"), fields.ints("actuator_trnid"), fields.reals("actuator_gear"));
    let (force_limited, force) = (fields.flags("actuator_forcelimited"), fields.reals("actuator_forcerange"));
    let (input_limited, input) = (fields.flags("actuator_ctrllimited"), fields.reals("actuator_ctrlrange"));
    let (bias, gain) = (fields.ints("actuator_biastype"), fields.reals("actuator_gainprm"));
    let (joint_limited, joint_force) = (fields.flags("jnt_actfrclimited"), fields.reals("jnt_actfrcrange"));
    let gain_columns = gain.len() / kind.len().max(1);
    let reach = |range: &[f64], i: usize| range[2 * i].abs().max(range[2 * i + 1].abs());
    let mut efforts = vec![None; joints];
    for a in 0..kind.len() {
        if !matches!(kind[a], TRANSMISSION_JOINT | TRANSMISSION_JOINT_IN_PARENT) {
            continue;
        }
        let mut most = UNLIMITED;
        if force_limited[a] {
            most = reach(&force, a);
        }
        // An input is an effort only if the actuator is a motor: no bias, one input, force = gain * input.
        if bias[a] == 0 && input_limited.len() == kind.len() && input_limited[a] {
            most = most.min(reach(&input, a) * gain[a * gain_columns].abs());
        }
        let most = if most >= UNLIMITED { UNLIMITED } else { most * gear[a * GEAR_COLUMNS].abs() };
        let joint = target[2 * a] as usize;
        efforts[joint] = Some((efforts[joint].unwrap_or(0.0) + most).min(UNLIMITED));
    }
    for j in 0..joints {
        if joint_limited[j] {
            efforts[j] = efforts[j].map(|most| most.min(reach(&joint_force, j)));
        }
    }
    efforts
}

/// Returns the speed limit of each joint: the maximum that the input range of a velocity actuator allows.
pub(super) fn speeds(fields: &Fields, joints: usize) -> Vec<f64> {
    let (kind, target, gear) = (fields.ints("actuator_trntype"), fields.ints("actuator_trnid"), fields.reals("actuator_gear"));
    let (limited, input) = (fields.flags("actuator_ctrllimited"), fields.reals("actuator_ctrlrange"));
    let (gain, bias) = (fields.reals("actuator_gainprm"), fields.reals("actuator_biasprm"));
    let (gain_columns, bias_columns) = (gain.len() / kind.len().max(1), bias.len() / kind.len().max(1));
    let mut speeds = vec![UNLIMITED; joints];
    for a in 0..kind.len().min(limited.len()) {
        let (kv, bias, ratio) = (gain[a * gain_columns], &bias[a * bias_columns..], gear[a * GEAR_COLUMNS].abs());
        // force = kv (input - speed): independent of the position.
        let is_velocity = kv > 0.0 && bias[1] == 0.0 && bias[2] == -kv;
        if is_velocity && limited[a] && ratio > 0.0 && matches!(kind[a], TRANSMISSION_JOINT | TRANSMISSION_JOINT_IN_PARENT) {
            let most = input[2 * a].abs().max(input[2 * a + 1].abs()) / ratio;
            let joint = target[2 * a] as usize;
            speeds[joint] = speeds[joint].min(most);
        }
    }
    speeds
}
