# SPDX-License-Identifier: Apache-2.0
"""An assignment to an undeclared attribute is refused with the probable intention; a member of a group is set in all its devices."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from typing import Any

import pytest

import opengpac as gpac
from opengpac import library as lib
from opengpac import motion


@pytest.fixture(scope="module")
def arm() -> Iterator[gpac.robots.Arm]:
    """Yields a simulated arm that is disabled."""
    made = gpac.robots.load("ur5e", clock="virtual")
    with made.system:
        yield made


def graph() -> gpac.Graph:
    """Returns a gain as a graph."""
    return gpac.Graph("smooth", blocks={"gain": lib.gain}, inputs={"u": "gain.u"}, outputs={"y": "gain.y"})


def instance(arm: gpac.robots.Arm) -> Any:
    """Returns an instance that is created but not started."""
    return motion.move_absolute.new_instance(arm)


WRONG: dict[str, tuple[Callable[[gpac.robots.Arm], Any], str, str]] = {
    "group": (lambda a: a, "overide", "group 'ur5e' has no member 'overide'; did you mean 'override'?"),
    "member of a group's devices": (lambda a: a, "comanded", "group 'ur5e' has no member 'comanded'; did you mean 'commanded'"),
    "device of a group": (lambda a: a, "elbow", "it is a device, so set one of its members"),
    "system": (lambda a: a.system, "overide", "system 'ur5e' has no member 'overide'; did you mean 'override'?"),
    "call of a system": (lambda a: a.system, "pause", "'pause' of system 'ur5e' is a method and cannot be assigned; write pause(…)"),
    "what a system tells": (lambda a: a.system, "now", "'now' of system 'ur5e' is read-only"),
    "device": (lambda a: a.elbow, "comanded", "robot_joint 'ur5e.elbow' has no member 'comanded'; did you mean 'commanded'"),
    "state of a device": (lambda a: a.elbow, "state", "'state' of robot_joint 'ur5e.elbow' is read-only"),
    "SVV": (lambda a: a.elbow.sensed, "vale", "SVV 'ur5e.elbow.sensed' has no member 'vale'; did you mean 'value'?"),
    "number of an SVV": (lambda a: a.elbow.sensed, "number", "'number' of SVV 'ur5e.elbow.sensed' is read-only"),
    "verb": (lambda a: motion.move_absolute, "speed", "pass it in a call: move_absolute(…, speed=…)"),
    "instance": (instance, "speed", "an instance of verb 'move_absolute' has no member 'speed'; write vi.set(speed=…)"),
    "graph": (lambda a: graph(), "u", "pass constants where it is used: smooth(u=…)"),
    "block": (lambda a: lib.pid, "kp", "block 'library.pid' has no member 'kp'; pass constants where it is used: pid(kp=…)"),
    "use of a block": (lambda a: lib.pid(kp=1.0), "ki", "pass constants where it is used: pid(ki=…)"),
    "source": (lambda a: a.system.sources["rtp0.fast"], "period", "'period' of timer 'rtp0.fast' is read-only; set it when"),
    "processor": (lambda a: a.system.processors["rtp0"], "core", "processor 'rtp0' has no member 'core'"),
    "machine": (lambda a: a.system.physical_devices["ur5e"], "speed", "physical device 'ur5e' has no member 'speed'"),
    "channel": (lambda a: a.system.physical_devices["ur5e"]["elbow"].effort, "value", "write it with a block"),
    "alarms": (lambda a: a.system.alarms, "limit", "the alarms of system 'ur5e' has no member 'limit'"),
    "geometry": (lambda a: a.kinematics, "tol", "has no member 'tol'; did you mean 'tool'?"),
}


@pytest.mark.parametrize("what", WRONG)
def test_what_nobody_declared_cannot_be_set(arm: gpac.robots.Arm, what: str) -> None:
    of, name, message = WRONG[what]
    target = of(arm)
    before = dict(vars(target))
    with pytest.raises(gpac.CallError) as caught:
        setattr(target, name, 1.0)
    assert message in str(caught.value) and caught.value.file == __file__
    assert vars(target) == before
    if isinstance(target, gpac.VerbInstance):
        target.delete()


def test_a_member_of_a_group_is_set_in_all_its_devices(arm: gpac.robots.Arm) -> None:
    settable: Any = arm
    settable.kp = 5
    assert arm.values("kp") == [5.0] * 6
    settable.kp = [1, 2, 3, 4, 5, 6]
    assert arm.values("kp") == [1, 2, 3, 4, 5, 6]
    settable.kp = {"elbow": 60}
    assert arm.values("kp") == [1, 2, 60, 4, 5, 6]
    settable.commanded = [0.1] * 6
    assert arm.values("commanded") == [0.1] * 6


def test_where_one_device_refuses_a_value_none_has_it(arm: gpac.robots.Arm) -> None:
    settable: Any = arm
    settable.kd = 7.0
    with pytest.raises(gpac.ValueRefused, match="'kd'"):
        settable.kd = [1, 2, 3, 4, 5, "much"]
    with pytest.raises(gpac.CallError, match="'kd' of group 'ur5e' needs one value for each of its 6 devices, not 2; pass one for all"):
        settable.kd = [1, 2]
    assert arm.values("kd") == [7.0] * 6


def test_a_constructor_keeps_its_signature() -> None:
    assert [*inspect.signature(gpac.Group).parameters] == ["name", "devices"]
    assert [*inspect.signature(gpac.System).parameters][:2] == ["name", "clock"]


def test_a_class_of_ones_own_declares_what_it_sets(arm: gpac.robots.Arm) -> None:
    class Cell(gpac.Group[gpac.robots.Joint]):
        shift = 1

        def __init__(self, name: str, *joints: gpac.robots.Joint) -> None:
            super().__init__(name, *joints)
            self.parts = 0

    cell = Cell("cell", *arm)
    cell.parts += 3
    cell.shift = 2
    assert (cell.parts, cell.shift) == (3, 2)
    with pytest.raises(gpac.CallError, match="group 'cell' has no member 'part'; did you mean 'parts'"):
        cell.part = 4
