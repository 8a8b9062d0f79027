# SPDX-License-Identifier: Apache-2.0
"""Joints of drivers in Python: a vendor's SDK as an arm."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from afar import until
from opengpac.driver import Driver, part, read

COBOT = '''
import math

from opengpac.driver import Driver, Option, part, read


class Cobot(Driver):
    """Two joints whose controller takes positions; its motors need some exchanges until they are on."""

    slow: int = Option("exchanges until its motors are on", 0)
    base = part(range=("-90 deg", "90 deg"), speed_max=2.0, home=0.5, operating=True)
    lift = part(unit="m", range=(0.0, 0.4), operating=True)
    current = read("double", unit="A")

    def open(self):
        self.joints = [self.base, self.lift]
        self.base.position, self.waited = 0.5, 0

    def exchange(self):
        engaged = any(joint.engaged for joint in self.joints)
        self.waited = self.waited + 1 if engaged else 0
        for joint in self.joints:
            joint.operating = engaged and self.waited > self.slow
            if joint.operating and math.isfinite(joint.goal):
                joint.velocity = (joint.goal - joint.position) / 0.01
                joint.position = joint.goal
        self.current = 2.0 if self.base.operating else 0.0

    def safe_state(self):
        for joint in self.joints:
            joint.operating = False
'''


@pytest.fixture
def cell() -> Iterator[gpac.System]:
    with gpac.System("cell", clock="virtual", progress=False) as made:
        yield made


def arm(cell: gpac.System, tmp_path: Path, **options: Any) -> gpac.Group[gpac.robots.Joint]:
    """Returns the two joints as an arm."""
    (tmp_path / "cobot.py").write_text(COBOT)
    rtp = cell.processor("rtp0")
    fast = rtp.timer("fast", period="10 ms", priority=80)
    cobot = rtp.physical_device("cobot", gpac.drivers.python(tmp_path / "cobot.py", **options), exchange=fast)
    return gpac.Group("arm", *(gpac.robots.Joint(name, drive=cobot[name], on=fast, max_following_error=1.0) for name in ("base", "lift")))


def test_parts_are_joints_with_limits_and_channels(cell: gpac.System, tmp_path: Path) -> None:
    joints = arm(cell, tmp_path)
    cobot = cell.physical_devices["cobot"]
    about = cobot["base"].about
    assert cobot.parts == ["base", "lift"]
    assert (about["unit"], about["range_min"], about["speed_max"], about["home"]) == ("rad", pytest.approx(-1.5707963), 2.0, 0.5)
    assert (cobot["lift"].position.unit, cobot["lift"].goal.unit, cobot["lift"].velocity.unit) == ("m", "m", "m/s")
    joints.enable()
    assert joints.values("sensed") == [0.5, 0.0]
    gpac.motion.move_absolute(joints, goal=[-0.5, 0.3])
    assert joints.values("sensed") == pytest.approx([-0.5, 0.3])
    assert cell.read(cobot["current"])[0] == 2.0
    joints.disable()
    cell.advance("50 ms")
    assert cell.read(cobot["current"])[0] == 0.0, "nobody commands it"


def test_enabling_waits_until_the_machine_says_that_it_follows(cell: gpac.System, tmp_path: Path) -> None:
    joints = arm(cell, tmp_path, slow=20)
    began = cell.now
    joints.enable()
    assert cell.now - began > 0.2


def test_enabling_a_machine_that_never_follows_ends_with_its_timeout(cell: gpac.System, tmp_path: Path) -> None:
    joints = arm(cell, tmp_path, slow=1_000_000)
    with pytest.raises(TimeoutError, match="was not ready within 1 s"):
        joints["base"].enable(timeout="1 s")
    assert joints["base"].state == "disabled"


def test_it_moves_in_a_process_of_its_own(tmp_path: Path) -> None:
    with gpac.System("cell", progress=False) as cell:
        joints = arm(cell, tmp_path, age_max="20 s").enable()
        gpac.motion.move_absolute(joints, goal=[-0.5, 0.3])
        until(lambda: abs(joints.values("sensed")[0] + 0.5) < 1e-3, "it is there")


def test_a_channel_that_a_part_does_not_have_is_named() -> None:
    class Gate(Driver):
        """Gate with one part."""

        wing = part(command="effort", kp=3.0)
        wind = read("double")

    gate = Gate()
    assert (gate.wing.effort, gate.wing.bias, gate.wing.engaged) == (0.0, 0.0, False)
    with pytest.raises(AttributeError, match="a part has no channel 'positon'; did you mean 'position'"):
        gate.wing.positon = 1.0
    with pytest.raises(AttributeError, match="a part has no channel 'goal'"):
        _ = gate.wing.goal


@pytest.mark.parametrize(
    "given", [{"unit": "deg"}, {"command": "velocity"}, {"range": (1.0, -1.0)}, {"speed_max": -1.0}, {"range": (float("nan"), 1.0)}]
)
def test_what_is_no_part_is_refused(given: dict[str, Any]) -> None:
    with pytest.raises(gpac.DefinitionError, match="a part"):
        part(**given)
