# SPDX-License-Identifier: Apache-2.0
"""Episodes: a Gymnasium environment over the virtual clock, compared with a bare Python loop over MuJoCo with the same physics.

The loop has the controller written out in NumPy, as short as possible: joint speeds are integrated to set-points, and a PID law
without its I part, with the weight of the arm fed forward, turns them into efforts 1,000 times a second. Ours runs the whole system:
six joints as devices, their servos with limits, a generator within acceleration and jerk limits, kinematics at 50 Hz. The physics run
at 2 kHz in both, each on one core.
"""

from __future__ import annotations

import importlib
import sys
import time as clock
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from lines import Line, digits, median, time

import opengpac as gpac

sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))

BAR = 0.7
SECONDS = 3.0
STEPS = 150
MODEL = Path(gpac.__file__).parent / "robots" / "ur5e.xml"


def measure(rounds: int, quick: bool) -> Iterator[Line]:
    """Measures episodes of 3 s with actions drawn beforehand."""
    what = f"episodes of {SECONDS:g} s, UR5e, actions at 50 Hz, servos at 1 kHz"
    try:
        environment: Any = importlib.import_module("reach").environment
        bare, physics = _bare(), _physics()
        env = environment("bench", SECONDS)
    except (ImportError, gpac.Error) as why:
        yield Line("episodes", what, bar_text=f"≥ {BAR} ×", note=f"not taken: {why}")
        return
    actions = np.random.default_rng(1).uniform(-0.3, 0.3, (STEPS, 6)).astype(np.float32)

    def ours() -> None:
        env.reset(seed=1)
        for action in actions:
            env.step(action)

    count = 2 if quick else 8
    turns = [(_taken(ours, count), _taken(lambda: bare(actions), count), _taken(physics, count)) for _ in range(rounds)]
    resets = _taken(lambda: env.reset(seed=1), 10)
    env.close()
    ratio = median([theirs / mine for mine, theirs, _ in turns])
    mine, theirs, alone = (median([turn[k] for turn in turns]) for k in range(3))
    yield Line(
        "episodes", what, f"{1 / mine:.1f}/s", f"bare loop: {1 / theirs:.1f}/s", ratio, f"{digits(ratio)} ×", BAR, f"≥ {BAR} ×",
        note=f"a reset {time(resets * 1e9)}; mj_step alone, without any controller: {1 / alone:.1f}/s", at_least=True,
    )  # fmt: skip


def _taken(does: Callable[[], object], count: int) -> float:
    """Returns the time per call, s."""
    begun = clock.perf_counter()
    for _ in range(count):
        does()
    return (clock.perf_counter() - begun) / count


def _bare() -> Callable[[np.ndarray], None]:
    """Returns the bare loop with its controller."""
    mujoco: Any = importlib.import_module("mujoco")
    model = mujoco.MjModel.from_xml_path(str(MODEL))
    data = mujoco.MjData(model)
    limit = model.actuator_ctrlrange[:, 1].copy()
    kp, kd, dt = np.full(6, 2000.0), np.full(6, 100.0), 1e-3
    per_ms = round(dt / model.opt.timestep)

    def run(actions: np.ndarray) -> None:
        mujoco.mj_resetDataKeyframe(model, data, 0)
        setpoint = data.qpos.copy()
        for action in actions:
            for _ in range(20):
                setpoint += action * dt
                effort = kp * (setpoint - data.qpos) + kd * (action - data.qvel) + data.qfrc_bias
                data.ctrl[:] = np.clip(effort, -limit, limit)
                mujoco.mj_step(model, data, per_ms)
            np.concatenate([data.qpos, data.site_xpos[0]])

    return run


def _physics() -> Callable[[], None]:
    """Returns the physics steps of an episode alone."""
    mujoco: Any = importlib.import_module("mujoco")
    model = mujoco.MjModel.from_xml_path(str(MODEL))
    data = mujoco.MjData(model)

    def run() -> None:
        mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_step(model, data, round(SECONDS / model.opt.timestep))

    return run
