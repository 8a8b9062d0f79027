# SPDX-License-Identifier: Apache-2.0
"""A daemon with a journal that is killed while a policy runs has the policy again after its restart: the network is kept in the journal."""

from pathlib import Path

import numpy as np

import opengpac as gpac
from daemons import Daemon
from opengpac import activate
from policy_networks import dense

SEEN, OTHERS = [0.1, 0.2, 0.3], [-0.5, 0.7, 0.0]


def test_a_daemon_that_was_killed_runs_its_policy_again(tmp_path: Path) -> None:
    policy = gpac.policy(dense(tmp_path / "walk.onnx", [3, 16, 3]), every="20 ms")
    expected, of_others = (policy.run(obs=[seen]).actions[0] for seen in (SEEN, OTHERS))
    assert not np.array_equal(expected, of_others)
    verb = gpac.Verb(
        "walks",
        blocks={"walk": policy},
        instantiation_parameters={"x": "walk.obs", "y": "walk.actions"},
        command_lists={"start": [activate("walk", every="20 ms"), gpac.ready()]},
    )

    class Walker(gpac.LogicalDevice, verb=verb, name="walker"):
        """Device that a policy keeps running."""

        x = gpac.svv("double[3]", initial=SEEN)
        y = gpac.svv("double[3]")

    words = ("virtual", "--journal", str(tmp_path / "cell.journal"))
    daemon = Daemon(tmp_path, *words)
    cell = gpac.connect(daemon.url, name="panel")
    slow = cell.processor("rtp0").timer("slow", period="20 ms", priority=50)
    walker = Walker("robot", on=slow).enable()
    cell.advance("20 ms")
    np.testing.assert_array_equal(walker.y.value, expected)
    daemon.kill()
    policy.file.unlink()
    again = Daemon(tmp_path, *words)
    with gpac.connect(again.url, name="panel") as cell:
        cell.advance("20 ms")
        np.testing.assert_array_equal(cell.svv("robot.y").value, expected)
        # It is the network that runs, not a value that was kept.
        cell.svv("robot.x").value = OTHERS
        cell.advance("20 ms")
        np.testing.assert_array_equal(cell.svv("robot.y").value, of_others)
    again.stop()
