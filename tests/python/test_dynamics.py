# SPDX-License-Identifier: Apache-2.0
"""The efforts that a motion of an arm requires, compared with MuJoCo's and with those of the servos of an arm at rest."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac import library as lib
from opengpac.robots.catalogue import EXTRA, KNOWN, OWN
from opengpac.robots.kinematics import NONE

mujoco: Any = importlib.import_module("mujoco")

NAMED = [name for name, arm in KNOWN.items() if arm.package.name in (*EXTRA, OWN)]
POSES = 20
"""Number of motions tried with each arm."""


@pytest.fixture(scope="module", params=NAMED)
def arm(request: pytest.FixtureRequest) -> Iterator[gpac.robots.Arm]:
    loaded = gpac.robots.load(request.param, clock="virtual")
    with loaded.system:
        yield loaded


def model_of(arm: gpac.robots.Arm) -> tuple[Any, Any, list[int]]:
    """Returns the simulated model of an arm, its data and the numbers of the arm's joints there."""
    model = mujoco.MjModel.from_xml_path(str(arm._scene))
    known = {model.joint(j).name or f"joint_{j}": j for j in range(model.njnt)}
    return model, mujoco.MjData(model), [known[axis.name] for axis in arm.kinematics.axes]


def inertia_of(model: Any, data: Any) -> np.ndarray:
    """Returns MuJoCo's inertia matrix of all degrees of freedom."""
    columns = np.zeros((model.nv, model.nv))
    for column, unit in zip(columns, np.eye(model.nv), strict=True):
        mujoco.mj_mulM(model, data, column, unit)
    return columns


def motions(arm: gpac.robots.Arm) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Yields random positions in the ranges of the joints, velocities and accelerations; joints that do not move the tool rest at 0."""
    random = np.random.default_rng(7)
    low, high = np.clip(arm.values("position_min"), -np.pi, None), np.clip(arm.values("position_max"), None, np.pi)
    moves = np.array([axis.kind != NONE for axis in arm.kinematics.axes])
    for _ in range(POSES):
        q, velocity, acceleration = (random.uniform(a, b, len(moves)) for a, b in ((low, high), (-3.0, 3.0), (-10.0, 10.0)))
        yield q * moves, velocity * moves, acceleration * moves


def test_efforts_and_inertia_are_those_of_mujoco(arm: gpac.robots.Arm) -> None:
    model, data, joints = model_of(arm)
    places, dofs = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
    moves = [i for i, axis in enumerate(arm.kinematics.axes) if axis.kind != NONE]
    for q, velocity, acceleration in motions(arm):
        data.qpos[:] = model.qpos0
        data.qpos[places], data.qvel[dofs] = q, velocity
        mujoco.mj_forward(model, data)
        full = inertia_of(model, data)
        wanted = full[:, dofs] @ acceleration + data.qfrc_bias
        found = arm.dynamics.effort(q, velocity, acceleration)
        assert np.abs(found - wanted[dofs])[moves].max() < 1e-9 * max(1.0, np.abs(wanted[dofs]).max())
        inertia = arm.dynamics.inertia(q)
        among = np.ix_(moves, moves)
        assert np.abs(inertia[among] - full[np.ix_(dofs, dofs)][among]).max() < 1e-9 * max(1.0, np.abs(full).max())


def test_at_rest_the_servos_apply_the_gravity_effort() -> None:
    arm = gpac.robots.load("ur5e", clock="virtual")
    with arm.system:
        arm.enable()
        gpac.motion.move_absolute(arm, [0.3, -1.0, 1.2, -0.7, -1.1, 0.4])
        arm.system.advance("2 s")
        (machine,) = arm.system.physical_devices.values()
        applied = [arm.system.read(machine.channels[f"{joint.short_name}.motor_effort"])[0] for joint in arm]
        assert np.abs(np.array(applied) - arm.dynamics.effort(arm.values("sensed"))).max() < 1e-6


def test_a_payload_is_carried_as_a_point_mass_at_the_flange() -> None:
    arm = gpac.robots.load("ur5e", clock="virtual")
    with arm.system:
        q, payload = [0.3, -1.0, 1.2, -0.7, -1.1, 0.4], gpac.robots.Payload(2.0, centre=(0.01, 0.02, 0.1))
        more = arm.dynamics.carrying(payload).effort(q) - arm.dynamics.effort(q)
        block = lib.block("payload_effort").run(n=6, chain=arm.standing, q=[q] * 2, mass=2.0, centre=payload.centre, rate=1e9, every="1 s")
        assert np.allclose(more, block.effort[-1], atol=1e-9)
        fast = arm.dynamics.carrying(payload).inertia(q)
        assert (np.linalg.eigvalsh(fast - arm.dynamics.inertia(q)) > -1e-12).all(), "a mass adds inertia in each direction"


def test_wrong_numbers_are_refused_and_arms_without_a_model_say_so() -> None:
    arm = gpac.robots.load("two_joint", clock="virtual")
    with arm.system:
        with pytest.raises(gpac.CallError, match="the chain needs 2 joint positions, not 3"):
            arm.dynamics.effort([0.0, 0.0, 0.0])
        with pytest.raises(gpac.ValueRefused, match="must be finite, not"):
            arm.dynamics.effort([0.0, 0.0], velocity=[float("nan"), 0.0])
        assert arm.dynamics.effort([0.5, 0.7]) == pytest.approx(
            lib.block("inverse_dynamics").run(n=2, **arm.dynamics.parameters, q=[0.5, 0.7]).gravity_effort[0]
        )
