# SPDX-License-Identifier: Apache-2.0
"""The trained policy of the examples: in its environment, in its verb with the guard, and within the limits of its arm."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import numpy as np
import onnx
import pytest
from onnx import numpy_helper
from onnx.reference import ReferenceEvaluator

import opengpac as gpac
import reach

GOALS = int(os.environ.get("OPENGPAC_GOALS", "10"))
"""Number of goals; `make faults` tries 100."""

UNSEEN = 5_000
"""First seed of the unseen goals, which training did not use."""


@pytest.fixture
def work() -> Iterator[reach.Work]:
    """Yields the cell of the example, enabled, with a camera that sees."""
    with gpac.System("reach", clock="virtual") as cell:
        made = reach.Work(cell)
        with made.arm.enabled():
            made.camera.start()
            yield made


def test_its_file_is_small_and_says_how_it_was_made() -> None:
    model = onnx.load(reach.NETWORK)
    said = {entry.key: entry.value for entry in model.metadata_props}
    assert reach.NETWORK.stat().st_size < 200_000
    assert said["joint_names"].split(",") == reach.JOINTS and said["period"] == "0.02" and said["seed"].isdigit()
    assert sum(numpy_helper.to_array(tensor).size for tensor in model.graph.initializer) > 1000


def test_it_reaches_goals_that_it_has_not_seen_within_the_acceleration_of_its_arm(work: reach.Work) -> None:
    limits = np.array([joint.max_acceleration for joint in work.arm])
    missed, looked = [], work.cell.now
    for seed in range(UNSEEN, UNSEEN + GOALS):
        goal = work.middle + np.random.default_rng(seed).uniform(-reach.SPREAD, reach.SPREAD)
        report = work.reach(goal)
        if report.condition != "arrived" or np.abs(np.array(work.arm.pose().position) - goal).max() > reach.TOLERANCE:
            missed.append((seed, report.condition))
        # The histories cover ten seconds, and one goal takes at most six.
        if work.cell.now - looked > 3.5 or seed == UNSEEN + GOALS - 1:
            assert (reach.accelerations(work.arm) <= limits * 1.001).all() and work.cell.now - looked < 10.0
            looked = work.cell.now
    assert len(missed) <= GOALS * 5 // 100, missed


def test_in_its_environment_it_does_the_same_with_the_reference_evaluator() -> None:
    network = ReferenceEvaluator(str(reach.NETWORK))
    env = reach.environment("reach_tried", seconds=4.0)
    seen, _ = env.reset(seed=UNSEEN)
    over = False
    while not over:
        given: Any = network.run(None, {"obs": seen[None]})[0]
        seen, _, _, over, _ = env.step(given[0])
    assert np.abs(env.values["error"]).max() < reach.TOLERANCE
    # An episode leaves no trace in the next one.
    first = [env.reset(seed=1)[0], *(env.step(np.full(6, 0.3, np.float32))[0] for _ in range(5))]
    env.step(np.full(6, -1.0, np.float32))
    again = [env.reset(seed=1)[0], *(env.step(np.full(6, 0.3, np.float32))[0] for _ in range(5))]
    np.testing.assert_array_equal(first, again)
    env.close()


def test_the_program_reaches_and_the_guard_takes_over(programs: Any) -> None:
    done = programs.run("reach")
    assert done.code == 0, done.printed
    assert "All verbs ended as they should" in done.printed
