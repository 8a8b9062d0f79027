# SPDX-License-Identifier: Apache-2.0
"""A policy gives the same bits under the virtual clock, in a process, and in a trial."""

from pathlib import Path

import numpy as np
import pytest

import opengpac as gpac
from opengpac import activate, library, on
from policy_networks import dense

SEEN = [0.1, 0.2, 0.3]


def walking(file: Path) -> tuple[gpac.Policy, gpac.Verb[..., gpac.Report]]:
    """Returns a policy of one small network, and a verb that runs it for 100 ms."""
    policy = gpac.policy(dense(file, [3, 16, 3]), every="20 ms")
    verb = gpac.Verb(
        "walking",
        blocks={"walk": policy, "clock": library.time_limit(limit=0.1)},
        instantiation_parameters={"x": "walk.obs", "y": "walk.actions"},
        command_lists={"start": [activate("walk", every="20 ms"), activate("clock", every="20 ms")]},
        conditions={"over": on("clock.expired", returns=[])},
    )
    return policy, verb


@pytest.mark.parametrize("place", ["virtual", "process"])
def test_a_policy_gives_the_same_bits_wherever_it_runs(tmp_path: Path, place: str) -> None:
    policy, verb = walking(tmp_path / "walk.onnx")
    cell = gpac.System("cell", clock="virtual" if place == "virtual" else "monotonic")
    source = cell.processor("rtp0", process=place == "process").timer("slow", period="20 ms", priority=50)
    y = cell.svv("y", "double[3]")
    verb.on(source)(cell.svv("x", "double[3]", initial=SEEN), y)
    assert np.array_equal(y.value, policy.run(obs=[SEEN]).actions[0])
    assert "walk" in dir(cell.download(str(policy.file), "again"))
    cell.close()


def test_a_recorded_policy_is_run_again_without_its_file(tmp_path: Path) -> None:
    policy, verb = walking(tmp_path / "walk.onnx")
    record = tmp_path / "run.mcap"
    with gpac.System("cell", clock="virtual") as cell:
        cell.record(record, replay=True)
        source = cell.processor("rtp0").timer("slow", period="20 ms")
        verb.on(source)(cell.svv("x", "double[3]", initial=SEEN), cell.svv("y", "double[3]"))
    policy.file.unlink()
    (tmp_path / "walk.onnx").unlink(missing_ok=True)
    again = gpac.replay(record, show=["y"], trust=True)
    assert again.same and again.firings >= 5 and set(again.svvs) == {"y"}
