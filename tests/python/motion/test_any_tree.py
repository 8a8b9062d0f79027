# SPDX-License-Identifier: Apache-2.0
"""Servos on untuned arms: random trees of links hold still and arrive, or report that they lack the effort.

8 trees are tried, different ones each day; `OPENGPAC_TREES` sets their number, `OPENGPAC_SEED` the first seed.
"""

from __future__ import annotations

import datetime
import os
from pathlib import Path

import numpy as np
import pytest

import opengpac as gpac
from opengpac import robots

TREES = int(os.environ.get("OPENGPAC_TREES", "8"))
FIRST = int(os.environ.get("OPENGPAC_SEED", datetime.date.today().toordinal() * 1000))
RANGE = 2.0
"""Range of each joint in either direction, rad."""
FRICTION = 0.2
"""Maximum dry friction of a joint, as a fraction of the effort that holds the tree."""


def tree(seed: int) -> str:
    """Returns an MJCF model of 1 to 7 links of 0.05 to 50 kg, 0.05 to 1 m, ratios up to 1:100, a step of 0.2 to 2 ms, and more effort
    than the worst pose requires. Half of the joints have no damping, a third no dry friction."""
    rng, rubs = np.random.default_rng(seed), np.random.default_rng([seed, 1])
    links, step = int(rng.integers(1, 8)), float(np.exp(rng.uniform(np.log(2e-4), np.log(2e-3))))
    heaviest, ratio = float(np.exp(rng.uniform(np.log(0.05), np.log(50.0)))), 10.0 ** rng.uniform(0.0, 2.0)
    masses = np.clip(heaviest * ratio ** rng.uniform(-1.0, 0.0, links), 0.05, 50.0)
    lengths = rng.uniform(0.05, 1.0, links)
    most = float((masses * lengths).sum() * 9.81 + (masses.sum() * lengths.sum()) * 9.81)
    children: list[list[int]] = [[] for _ in range(links)]
    for link in range(1, links):
        children[link - 1 if rng.random() < 0.8 else int(rng.integers(0, link))].append(link)

    def body(link: int, z: float) -> str:
        mass, length = masses[link], lengths[link]
        across, along = mass * length**2 * (1 / 12 + 0.01 / 4), mass * length**2 * 0.005
        axis = rng.normal(size=3)
        damping = 0.0 if rng.random() < 0.5 else 10.0 ** rng.uniform(-2.0, 1.0)
        friction = 0.0 if rubs.random() < 1 / 3 else most * FRICTION * 10.0 ** rubs.uniform(-4.0, 0.0)
        inner = "".join(body(child, length) for child in children[link])
        return (
            f'<body pos="0 0 {z}"><joint name="j{link}" axis="{axis[0]} {axis[1]} {axis[2]}" range="-{RANGE} {RANGE}" damping="{damping}" '
            f'frictionloss="{friction}"/>'
            f'<inertial pos="0 0 {length / 2}" mass="{mass}" diaginertia="{across} {across} {along}"/>{inner}</body>'
        )

    effort = most * rng.uniform(1.0, 3.0)
    motors = "".join(f'<motor name="m{link}" joint="j{link}" ctrlrange="-{effort} {effort}"/>' for link in range(links))
    return (
        f'<mujoco><compiler angle="radian"/><option timestep="{step}"/><worldbody>{body(0, 0.0)}</worldbody>'
        f"<actuator>{motors}</actuator></mujoco>"
    )


ALIGNED = 744
"""Seed of a tree whose first two joints have nearly the same axis: if the motor of one alone is cut off, the other can throw the arm."""


@pytest.mark.parametrize("seed", sorted({*range(FIRST, FIRST + TREES), ALIGNED}))
def test_a_random_tree_holds_still_and_arrives(tmp_path: Path, seed: int) -> None:
    file = tmp_path / "tree.xml"
    file.write_text(tree(seed))
    arm = robots.load(file, clock="virtual", name=f"tree{seed}")
    with arm.system as cell:
        arm.enable()
        cell.advance("500 ms")
        assert max(abs(q) for q in arm.values("sensed")) < 1e-3, "it holds"
        rng = np.random.default_rng(seed)
        goal = [float(q) for q in 0.4 * rng.choice([-1.0, 1.0], size=len(arm))]
        # A joint with strong damping is slow.
        gpac.motion.move_absolute(arm, goal, time_limit=60.0 + max(0.8 / joint.max_speed for joint in arm))
        cell.advance("500 ms")
        held = np.array([joint.sensed.history[-200:]["value"] for joint in arm])
        assert np.abs(held - np.array(goal)[:, None]).max() < 1e-3, "every joint arrives"
        assert np.ptp(held, axis=1).max() < 1e-3, "and stands still there"
