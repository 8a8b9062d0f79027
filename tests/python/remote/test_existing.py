# SPDX-License-Identifier: Apache-2.0
"""Existing objects are found by name, in an embedded system and in a remote one."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

import opengpac as gpac
import swing
from daemons import Daemon
from opengpac.robots import Joint


@pytest.fixture(params=["near", "far"])
def cell(request: pytest.FixtureRequest) -> Iterator[gpac.System]:
    """Yields a system with the joint `axis`; if it is remote, its program has exited."""
    if request.param == "near":
        with gpac.System("near", clock="virtual") as near:
            swing.build(near)
            yield near
        return
    daemon: Daemon = request.getfixturevalue("daemon")
    with gpac.connect(daemon.url, name="first") as first:
        swing.build(first)
    with gpac.connect(daemon.url, name="second") as second:
        yield second


def test_a_device_of_its_class(cell: gpac.System) -> None:
    axis = cell.device("axis", Joint).enable()
    axis.kp = 45.0
    assert (axis.kp, axis.sensed.unit, axis.sensed.name) == (45.0, "rad", "axis.sensed")
    assert swing.swing().on(cell.sources["rtp0.slow"])(axis, seconds=0.2).condition == "over"
    axis.disable()
    assert cell.devices["axis"] is axis


def test_a_device_of_which_the_class_is_not_known(cell: gpac.System) -> None:
    axis = cell.device("axis")
    assert "robot_joint" in repr(axis).lower() or "Joint axis: disabled" in repr(axis)
    assert {"sensed", "commanded", "goal"} <= {*axis.svv_members()} and "max_speed" in axis.parameter_members()
    axis.enable()
    known: object = axis
    known.kp = 45.0  # type: ignore[attr-defined]
    assert cell.device("axis", Joint).kp == 45.0
    with pytest.raises(gpac.CallError, match="has no member 'pk'"):
        known.pk = 1.0  # type: ignore[attr-defined]
    assert swing.swing().on(cell.sources["rtp0.slow"])(axis, seconds=0.2).condition == "over"


def test_a_device_is_of_one_class(cell: gpac.System) -> None:
    class Other(gpac.LogicalDevice):
        """Unrelated type."""

        level: gpac.SVV[float] = gpac.svv()

    with pytest.raises(gpac.CallError, match=r"device 'axis' is a .*, not a Other"):
        cell.device("axis", Other)
    with pytest.raises(gpac.UnknownName, match="did you mean 'axis'"):
        cell.device("axes")


def test_an_instance_with_its_verb_and_without(cell: gpac.System) -> None:
    class TooLong(gpac.Terminated):
        pass

    axis = cell.device("axis", Joint).enable()
    verb = swing.swing(conditions={"over": gpac.on("clock.expired", raises=TooLong)}, output_values={})
    made = verb.on(cell.sources["rtp0.slow"]).named("one").new_instance(axis)
    made.start(seconds=0.2)
    with pytest.raises(TooLong):
        cell.instance("one", verb).wait()
    plain = cell.instance("one")
    with pytest.raises(gpac.Terminated) as ended:
        plain.wait()
    assert type(ended.value) is gpac.Terminated and ended.value.condition == "over"
    with pytest.raises(gpac.CallError):
        plain.start(seconds=1.0)
    with pytest.raises(gpac.CallError, match="belongs to verb 'swing', not 'other'"):
        cell.instance("one", swing.swing("other"))
    with pytest.raises(gpac.UnknownName, match="did you mean 'one'"):
        cell.instance("onee")
    plain.delete()
    assert [i.name for i in cell.instances if i.device is None] == []
