"""A policy gives the same bits under the virtual clock, in a process, and tried alone."""

from pathlib import Path

import numpy as np
import pytest

import opengpac as gpac
from opengpac import activate, library, on
from policy_networks import dense

SEEN = [0.1, 0.2, 0.3]


@pytest.mark.parametrize("place", ["virtual", "process"])
def test_a_policy_gives_the_same_bits_wherever_it_runs(tmp_path: Path, place: str) -> None:
    policy = gpac.policy(dense(tmp_path / "walk.onnx", [3, 16, 3]), every="20 ms")
    verb = gpac.Verb(
        "walking",
        blocks={"walk": policy, "clock": library.time_limit(limit=0.1)},
        instantiation_parameters={"x": "walk.obs", "y": "walk.actions"},
        command_lists={"start": [activate("walk", every="20 ms"), activate("clock", every="20 ms")]},
        conditions={"over": on("clock.expired", returns=[])},
    )
    cell = gpac.System("cell", clock="virtual" if place == "virtual" else "monotonic")
    source = cell.processor("rtp0", process=place == "process").timer("slow", period="20 ms", priority=50)
    y = cell.svv("y", "double[3]")
    verb.on(source)(cell.svv("x", "double[3]", initial=SEEN), y)
    assert np.array_equal(y.value, policy.run(obs=[SEEN]).actions[0])
    assert "walk" in dir(cell.download(str(policy.file), "again"))
    cell.close()
