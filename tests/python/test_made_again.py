# SPDX-License-Identifier: Apache-2.0
"""A notebook cell that is run twice: equal requests return the same object, and differences are reported."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

import opengpac as gpac

CELL = """
cell = gpac.System("again", clock="virtual", progress=False)
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
later = rtp.software("later")
goal = cell.svv("goal", unit="rad", initial=0.5)
io = rtp.physical_device("io", gpac.drivers.loopback("x"), exchange=fast)
arm = gpac.robots.load("ur5e", on=fast)
"""


@pytest.fixture
def notebook() -> Iterator[dict[str, Any]]:
    """Yields the names defined by the cells of a notebook that has been run, while an instance is running."""
    defined: dict[str, Any] = {"gpac": gpac}
    exec(CELL, defined)
    defined["arm"].enable()
    yield defined
    defined["cell"].close()


def test_a_cell_that_is_run_again_finds_what_it_made(notebook: dict[str, Any]) -> None:
    before = dict(notebook)
    notebook["goal"].value = 0.25
    exec(CELL, notebook)
    for name in ("cell", "rtp", "fast", "later", "goal", "io", "arm"):
        assert notebook[name] is before[name], name
    assert notebook["goal"].value == 0.25, "it goes on with the value that it has"
    assert {joint.state for joint in notebook["arm"]} == {"standstill"}, "it stays enabled"


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("gpac.System('again', clock='virtual', progress=False, seed=3)", "its seed is 0, not 3"),
        ("gpac.System('again', progress=False)", "its clock is 'virtual', not 'monotonic'"),
        ("cell.processor('rtp0', lost_after='1 s')", "its lost after is None, not '1 s'"),
        ("rtp.timer('fast', period='2 ms', priority=70)", "its period is '1 ms', not '2 ms', its priority is 80, not 70"),
        ("rtp.trigger('later')", "its kind is 'software', not 'trigger'"),
        ("cell.svv('goal', unit='m', initial=0.5)", "its unit is 'rad', not 'm'"),
        ("rtp.physical_device('io', gpac.drivers.loopback('y'), exchange=fast)", "its options is "),
        ("gpac.robots.load('ur5e', on=fast, arbitration='abort')", "its arbitration is 'refuse', not 'abort'"),
    ],
)
def test_what_differs_is_said_with_both_values(notebook: dict[str, Any], line: str, said: str) -> None:
    with pytest.raises(gpac.InUse) as caught:
        eval(line, notebook)
    assert said in str(caught.value)


def test_a_system_in_which_nothing_runs_is_built_anew(notebook: dict[str, Any]) -> None:
    before = dict(notebook)
    notebook["arm"].disable()
    exec(CELL.replace("1 ms", "0.5 ms"), notebook)
    assert before["cell"].closed and notebook["cell"] is not before["cell"]
    assert notebook["fast"].period == 0.0005


def test_what_was_deleted_may_be_made_otherwise(notebook: dict[str, Any]) -> None:
    cell, rtp, fast = notebook["cell"], notebook["rtp"], notebook["fast"]
    notebook["goal"].delete()
    assert cell.svv("goal", "int32_t").value == 0
    notebook["io"].delete()
    assert rtp.physical_device("io", gpac.drivers.loopback("y"), exchange=fast)["y"]
    notebook["arm"].disable()
    for joint in notebook["arm"]:
        joint.delete()
    cell.physical_devices["ur5e"].delete()
    again = gpac.robots.load("ur5e", on=fast, arbitration="abort")
    assert again is not notebook["arm"] and {joint.state for joint in again} == {"disabled"}
