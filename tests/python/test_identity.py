# SPDX-License-Identifier: Apache-2.0
"""A deleted object created again under its name is a different object: a reference to the old one never returns the new one's values."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from daemons import Daemon


class Counted(gpac.LogicalDevice):
    """Type with an integer."""

    level: gpac.SVV[int] = gpac.svv(int)
    step = gpac.parameter(1.0)


class Measured(gpac.LogicalDevice):
    """Type with a floating-point number."""

    level: gpac.SVV[float] = gpac.svv(unit="m")
    step = gpac.parameter(0.5)


def refused(ask: Callable[[], Any]) -> str:
    """Returns the message of the refusal."""
    with pytest.raises(gpac.UnknownName) as caught:
        ask()
    assert caught.value.place is not None and Path(caught.value.place.file).name == Path(__file__).name
    return caught.value.message


def test_a_handle_of_an_svv_does_not_read_its_successor(cell: gpac.System) -> None:
    old = cell.svv("level", int, initial=3, history=5)
    unused = cell._svvs["level"]
    assert old.value == 3
    old.delete()
    new = cell.svv("level", "double", initial=2.5, history=5)
    gone = "the requested SVV 'level' no longer exists: it was deleted, and its name is now used by another SVV"
    reads = [lambda: old.value, lambda: old.number, lambda: old.history[:], lambda: cell.read(new, old), lambda: unused.value]
    for ask in [*reads, old.delete]:
        assert refused(ask) == gone

    def store() -> None:
        old.value = 4

    assert refused(store) == gone
    assert (new.value, new.type) == (2.5, "double")
    new.value = 7.25
    assert (new.value, new.history[-1]["value"]) == (7.25, 7.25)
    new.delete()
    assert refused(lambda: new.value).startswith("there is no SVV 'level'")


def test_of_a_system_that_is_shared(tmp_path: Path) -> None:
    """Another program created the object again; this one was not notified."""
    daemon = Daemon(tmp_path)
    with gpac.connect(daemon.url, name="one") as one, gpac.connect(daemon.url, name="two", command=False) as two:
        one.svv("level", int, initial=3)
        seen = two.svv("level")
        assert seen.value == 3
        one.svv("level").delete()
        one.svv("level", "double", initial=3.0)
        assert "was deleted, and its name" in refused(lambda: seen.value)
        assert "was deleted, and its name" in refused(lambda: two.read(seen))
        assert two.svv("level").value == 3.0
    daemon.stop()


def test_a_verb_does_not_take_the_successor_of_what_it_was_given(cell: gpac.System) -> None:
    fast = cell.processor("rtp0").timer("fast", period="1 ms")
    wave = gpac.Verb(
        "wave",
        blocks={"wave": gpac.library.signal_generator},
        instantiation_parameters={"y": "wave.y"},
        command_lists={"start": [gpac.activate("wave", every="1 ms")]},
    )
    old = cell.svv("level")
    old.delete()
    new = cell.svv("level")
    assert "was deleted, and its name" in refused(lambda: wave.on(fast).new_instance(old))
    wave.on(fast).new_instance(new).delete()


def test_a_handle_of_a_device_does_not_read_its_successor(cell: gpac.System) -> None:
    old = Counted("gauge", system=cell)
    level = old.level
    old.level = 3
    old.delete()
    new = Measured("gauge", system=cell)
    new.level = 2.5
    assert "was deleted, and its name" in refused(lambda: old.level.value)
    assert "was deleted, and its name" in refused(lambda: level.value)

    def store() -> None:
        old.step = 5.0

    gone = "this Counted 'gauge' was deleted, and its name is now used by another device of type Measured"
    assert [refused(ask) for ask in (lambda: old.step, store, lambda: old.state, old.enable, old.disable, old.delete)] == [gone] * 6
    assert (new.level.value, new.step, cell.device("gauge", Measured).level.value) == (2.5, 0.5, 2.5)
    new.step = 0.25
    assert cell.device("gauge").step == new.step == 0.25, "two handles of one device are both good"


def test_a_handle_of_a_physical_device_does_not_give_the_channels_of_its_successor(cell: gpac.System) -> None:
    fast = cell.processor("rtp0").timer("fast", period="1 ms")
    old = cell.processors["rtp0"].physical_device("drives", gpac.drivers.loopback("elbow"), exchange=fast)
    part, door = old["elbow"], cell.processors["rtp0"].trigger("door")
    channel = next(iter(part.channels.values()))
    old.delete()
    cell.processors["rtp0"].physical_device("drives", gpac.drivers.loopback("wrist"), exchange=fast)
    assert "was deleted, and its name" in refused(lambda: gpac.robots.Joint("elbow", drive=part, on=fast))
    assert "was deleted, and its name" in refused(old.delete)
    assert "its name is now used by another one" in refused(lambda: channel.raises(door))
    assert "was deleted, and its name" in refused(lambda: cell.read(channel)), "a snapshot takes no channel of it either"
