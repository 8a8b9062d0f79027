# SPDX-License-Identifier: Apache-2.0
"""A payload is found from the efforts of a motion. MuJoCo computes the efforts of the arm with a body at its flange."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac.robots import Dynamics, Payload, identify_payload

mujoco: Any = importlib.import_module("mujoco")

LOAD = Payload(2.3, centre=(0.03, -0.02, 0.09), inertia=(0.011, 0.014, 0.008, 0.001, -0.002, 0.0005))
STEP = 0.004


def with_load(arm: gpac.robots.Arm, load: Payload) -> Any:
    """Returns the simulated model of an arm with a body at the flange; no actuator or contact matters for its efforts."""
    spec = mujoco.MjSpec.from_file(str(arm._scene))
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    joint = model.joint(arm.kinematics.axes[-1].name)
    last = model.body(joint.bodyid[0]).name
    q = [data.qpos[model.joint(axis.name).qposadr[0]] for axis in arm.kinematics.axes]
    body = gpac.Pose(data.body(last).xpos, quaternion=data.body(last).xquat)
    flange = body.inverse() @ arm.dynamics.kinematics.forward(q)
    added = spec.body(last).add_body(name="load", pos=list(flange.position), quat=list(flange.quaternion))
    added.explicitinertial = True
    added.mass, added.ipos, added.fullinertia = load.mass, list(load.centre), list(load.inertia)
    return spec


def motion(seconds: float, faster: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Returns times, and positions, velocities and accelerations of six joints that swing about a bent arm."""
    random, t = np.random.default_rng(3), np.arange(0, seconds, STEP)
    middle = np.array([0.2, -1.2, 1.4, -1.0, -1.3, 0.3])
    amplitude, rate, phase = random.uniform(0.3, 0.6, 6), faster * random.uniform(1.0, 2.5, 6), random.uniform(0, 6, 6)
    turn = t[:, None] * rate + phase
    return t, middle + amplitude * np.sin(turn), amplitude * rate * np.cos(turn), -amplitude * rate**2 * np.sin(turn)


def efforts_of(model: Any, arm: gpac.robots.Arm, moved: tuple[np.ndarray, ...]) -> np.ndarray:
    """Returns the efforts of a motion by MuJoCo's inverse dynamics, without its friction and limits."""
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_DAMPER
    data, found = mujoco.MjData(model), []
    joints = [model.joint(axis.name) for axis in arm.kinematics.axes]
    places, dofs = [j.qposadr[0] for j in joints], [j.dofadr[0] for j in joints]
    for q, velocity, acceleration in zip(*moved[1:], strict=True):
        data.qpos[places], data.qvel[dofs], data.qacc[dofs] = q, velocity, acceleration
        mujoco.mj_inverse(model, data)
        found.append(data.qfrc_inverse[dofs].copy())
    return np.array(found)


@pytest.fixture(scope="module")
def arm() -> gpac.robots.Arm:
    return gpac.robots.load("ur5e", clock="virtual")


@pytest.fixture(scope="module")
def measured(arm: gpac.robots.Arm) -> Callable[..., tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Returns times, positions and efforts with noise and friction."""

    def of(load: Payload, noise: float = 0.1, faster: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        random, moved = np.random.default_rng(5), motion(8.0, faster)
        model = with_load(arm, load).compile() if load.mass else mujoco.MjModel.from_xml_path(str(arm._scene))
        friction = np.array([3.0, 4.0, 3.0, 1.0, 0.8, 0.5])
        rubbing = friction * np.tanh(moved[2] / 0.01) + 0.3 * friction * moved[2]
        effort = efforts_of(model, arm, moved) + rubbing + random.normal(0, noise, moved[1].shape)
        return moved[0], moved[1] + random.normal(0, 1e-5 * noise, moved[1].shape), effort

    return of


def test_mass_and_centre_are_found_within_two_per_cent_of_mujocos(arm: gpac.robots.Arm, measured: Any) -> None:
    found = identify_payload(arm, *measured(LOAD))
    assert found.payload.mass == pytest.approx(LOAD.mass, rel=0.02)
    assert np.allclose(found.payload.centre, LOAD.centre, atol=0.02 * np.linalg.norm(LOAD.centre))
    assert abs(found.payload.mass - LOAD.mass) < 4 * found.mass_error + 0.02 and max(found.centre_error) < 0.002
    assert np.allclose(found.friction[:, 0], [3.0, 4.0, 3.0, 1.0, 0.8, 0.5], rtol=0.1, atol=0.1)
    assert found.residual.shape == (6,) and found.residual.max() < 0.3


def test_the_inertia_is_found_from_fast_rotations(arm: gpac.robots.Arm, measured: Any) -> None:
    found = identify_payload(arm, *measured(LOAD, noise=0.02, faster=2.5), inertia=True)
    assert np.allclose(found.payload.inertia, LOAD.inertia, atol=0.1 * max(LOAD.inertia)), found


def test_the_dynamics_with_a_payload_are_those_of_a_body_in_mujoco(arm: gpac.robots.Arm) -> None:
    moved = motion(0.4)
    wanted = efforts_of(with_load(arm, LOAD).compile(), arm, moved)
    found = [arm.dynamics.carrying(LOAD).effort(*sample) for sample in zip(*moved[1:], strict=True)]
    assert np.allclose(found, wanted, atol=1e-9 * np.abs(wanted).max())


def test_an_arm_that_carries_nothing_has_no_payload(arm: gpac.robots.Arm, measured: Any) -> None:
    assert identify_payload(arm, *measured(Payload(0.0))).payload == Payload(0.0)


def test_the_load_of_a_simulated_arm_is_found_while_it_moves(arm: gpac.robots.Arm, tmp_path: Path) -> None:
    loaded, spec = tmp_path / "loaded.xml", with_load(arm, LOAD)
    spec.meshdir = str(Path(str(arm._scene)).parent / spec.meshdir)
    loaded.write_text(spec.to_xml())
    simulated = gpac.robots.load(loaded, clock="virtual")
    with simulated.system:
        simulated.enable()
        (machine,) = simulated.system.physical_devices.values()
        channels = [machine.channels[f"{joint.short_name}.motor_effort"] for joint in simulated]
        samples: list[tuple[float, Any, list[float]]] = []
        start = np.array(simulated.values("sensed"))
        for goal in ([0.5, -0.4, 0.5, 0.9, 0.8, 0.7], [-0.4, 0.2, -0.3, -0.8, -0.9, -0.6], [0.0] * 6):
            moving = gpac.motion.move_absolute.asynch(simulated, list(start + goal))
            while not moving.done:
                simulated.system.advance("4 ms")
                efforts = [float(simulated.system.read(channel)[0]) for channel in channels]
                samples.append((simulated.system.now, simulated.values("sensed"), efforts))
    found = identify_payload(arm.dynamics, *(np.array(column) for column in zip(*samples, strict=True)))
    assert found.payload.mass == pytest.approx(LOAD.mass, rel=0.02), found
    assert np.allclose(found.payload.centre, LOAD.centre, atol=0.02 * np.linalg.norm(LOAD.centre)), found


def of_dynamics(dynamics: Dynamics, moved: tuple[np.ndarray, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return moved[0], moved[1], dynamics.effort_of_each(*moved[1:])


@pytest.mark.parametrize("noise", [1e-5, 1e-4])
def test_an_arm_at_rest_is_refused_however_noisy_its_encoders_are(arm: gpac.robots.Arm, noise: float) -> None:
    random, t = np.random.default_rng(1), np.arange(0, 4, STEP)
    still = np.tile(motion(0.01)[1][0], (len(t), 1))
    efforts = arm.dynamics.carrying(LOAD).effort_of_each(still, still * 0, still * 0) + random.normal(0, 0.1, still.shape)
    with pytest.raises(gpac.ValueRefused, match=r"does not determine the payload"):
        identify_payload(arm, t, still + random.normal(0, noise, still.shape), efforts)


def test_an_arm_that_is_lighter_than_its_model_carries_nothing(arm: gpac.robots.Arm) -> None:
    found = identify_payload(arm.dynamics.carrying(Payload(0.05)), *of_dynamics(arm.dynamics, motion(4.0)))
    assert found.payload == Payload(0.0) and found.mass == pytest.approx(-0.05, rel=0.02)


def test_errors_are_those_of_repeated_motions(arm: gpac.robots.Arm) -> None:
    t, q, efforts = of_dynamics(arm.dynamics.carrying(LOAD), motion(2.0))
    random = np.random.default_rng(2)
    found = [identify_payload(arm, t, q, efforts + random.normal(0, 0.1, efforts.shape)) for _ in range(8)]
    scatter = np.std([[each.mass, *each.payload.centre] for each in found], axis=0, ddof=1)
    claimed = np.mean([[each.mass_error, *each.centre_error] for each in found], axis=0)
    assert (scatter < 3 * claimed).all() and (claimed < 3 * scatter).all(), (scatter, claimed)


def test_samples_that_do_not_determine_a_payload_are_refused(arm: gpac.robots.Arm) -> None:
    dynamics, (t, q, velocity, acceleration) = arm.dynamics, motion(4.0)
    heavy = dynamics.carrying(LOAD)
    still = (t, q * 0 + q[0], velocity * 0, acceleration * 0)
    with pytest.raises(gpac.ValueRefused, match=r"the motion does not determine the payload: .* on .*centre along"):
        identify_payload(arm, *of_dynamics(heavy, still))
    time, positions, efforts = of_dynamics(heavy, (t, q, velocity, acceleration))
    with pytest.raises(gpac.ValueRefused, match=r"the efforts are those of a payload of -2\.\d+ kg, and the arm of the model has"):
        identify_payload(arm, time, positions, 2 * dynamics.effort_of_each(q, velocity, acceleration) - efforts)
    with pytest.raises(gpac.ValueRefused, match=r"a payload of 7\.\d+e\+03 kg, and the arm of .* kg; check that .* are in N\.m"):
        identify_payload(arm, time, positions, 1000 * efforts)
    with pytest.raises(gpac.CallError, match="the samples are not numbers, or their rows differ in length; pass 6 numbers for each sample"):
        identify_payload(arm, time, positions, [[1.0], *efforts.tolist()[1:]])
    with pytest.raises(gpac.CallError, match=r"the window must be above 0 s, not '0 ms'"):
        identify_payload(arm, time, positions, efforts, window="0 ms")
    with pytest.raises(gpac.CallError, match=r"the samples have the shapes \(1000,\), \(1000, 5\) and \(1000, 6\); pass the time of each"):
        identify_payload(arm, time, positions[:, :5], efforts)
    with pytest.raises(gpac.CallError, match="numbers that are not finite"):
        identify_payload(arm, time, positions, efforts * np.nan)
    with pytest.raises(gpac.CallError, match=r"a gap of 2 s at 0\.400 s"):
        identify_payload(arm, *(np.delete(values, slice(101, 600), axis=0) for values in (time, positions, efforts)))
    with pytest.raises(gpac.CallError, match="the times of the samples do not increase"):
        identify_payload(arm, time[::-1], positions, efforts)
    with pytest.raises(gpac.CallError, match=r"30 samples are too few for a window of 0\.06 s"):
        identify_payload(arm, time[:30], positions[:30], efforts[:30])


@pytest.mark.parametrize(
    "inertia",
    [
        (1, 1, 1),
        (1.0, 1.0, 1.0, 2.0, 0.0, 0.0),
        (0.0, 0.0, 1.0, 0.0, 0.0, 0.0),
        (-0.1, 1.0, 1.0, 0.0, 0.0, 0.0),
        (float("inf"), *[0.0] * 5),
    ],
)
def test_an_inertia_that_no_body_has_is_refused(inertia: Any) -> None:
    with pytest.raises(gpac.Error, match=r"inertia"):
        Payload(1.0, inertia=inertia)
