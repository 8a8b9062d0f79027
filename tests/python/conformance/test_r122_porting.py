# SPDX-License-Identifier: Apache-2.0
"""Requirement 122: one application on several architectures, with only the configuration changed."""

from __future__ import annotations

from collections.abc import Callable
from itertools import accumulate
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from mappings.mapping import MAPPINGS
from opengpac import activate, on
from opengpac import library as lib
from opengpac.robots import Joint, move

Sources = dict[str, gpac.Source]
LINK: dict[str, Any] = {"kind": "message", "seed": 3, "delay_ns": [0, 200_000], "drop": 0.01, "reorder": 0.01}
VALUES = 40


def application(cell: gpac.System, at: Sources, module: str) -> tuple[dict[str, Any], list[float]]:
    """Moves two axes together while a counter with a block in C drives a filter elsewhere. The application refers to sources by name,
    and never to processors. Returns the move's report, and the first values of the filter.

    A servo without its processor for 80 ms, as can happen on a busy machine to a thread without real-time privileges, is 0.1 rad
    behind at this speed: the joints allow ten times as much.
    """
    drives = at["servo"].processor.physical_device("drives", gpac.drivers.loopback("x", "y"), exchange=at["servo"])
    tuned: dict[str, Any] = {"kp": 50.0, "kd": 0.0, "max_following_error": 1.0}
    arm = gpac.Group("arm", *(Joint(f"arm.{p.name}", drive=p, on=at["servo"], **tuned) for p in drives))
    filtering = gpac.Verb(
        "filtering",
        blocks={"count": cell.download(module, "count").count, "filter": lib.lowpass(alpha=0.25)},
        instantiation_parameters={"y": "filter.y"},
        cells={"raw": ["count.y", "filter.u"]},
        input_parameters={"limit": "count.enough"},
        command_lists={"start": [activate("filter"), activate("count", every="20 ms")]},
        conditions={"enough": on("count.enough", returns=[])},
    )
    y = cell.svv("y", history=VALUES + 20)
    with arm.enabled():
        running = filtering.on({"count": at["work"], "filter": at["driven"]}).asynch(y, limit=VALUES + 10)
        report = move.on(at["motion"])(arm, goal=[0.5, -0.25], speed=1.0, time_limit="10 s")
        assert running.wait().condition == "enough"
        assert len({source.processor.name for source in at.values()}) == len(cell.names["processors"])
        return {"condition": report.condition, "position": [round(float(q), 2) for q in report.position]}, y.history[:]["value"].tolist()[
            :VALUES
        ]


def one_processor() -> tuple[gpac.System, Sources]:
    cell = gpac.System("one", clock="virtual")
    rtp = cell.processor("rtp0")
    slow = rtp.timer("slow", period="20 ms", priority=60)
    driven = rtp.software("driven", priority=55)
    return cell, {"servo": rtp.timer("fast", period="1 ms", priority=80), "motion": slow, "work": slow, "driven": driven}


def three_processors() -> tuple[gpac.System, Sources]:
    return three(gpac.System("three", clock="virtual", seed=5, interconnect=LINK))


def three_threads() -> tuple[gpac.System, Sources]:
    return three(MAPPINGS["threads"].open("three"))


def three_processes() -> tuple[gpac.System, Sources]:
    return three(MAPPINGS["processes"].open("three"))


def three(cell: gpac.System) -> tuple[gpac.System, Sources]:
    servo, motion, work = (cell.processor(name) for name in ("servos", "motions", "rest"))
    return cell, {
        "servo": servo.timer("servo", period="1 ms", priority=90),
        "motion": motion.timer("motion", period="20 ms", priority=50),
        "work": work.timer("work", period="10 ms", priority=10),
        "driven": motion.software("driven", priority=40),
    }


ARCHITECTURES = [one_processor, three_processors, three_threads, three_processes]


@pytest.mark.parametrize("architecture", ARCHITECTURES, ids=lambda a: a.__name__)
def test_r122_an_application_moves_by_its_configuration_only(
    architecture: Callable[[], tuple[gpac.System, Sources]], built: dict[str, str]
) -> None:
    """With one processor or three, memory or a bad link, threads or processes, virtual or real time, the application moves and gives the
    same values."""
    before = Path(built["count"]).stat()
    cell, at = architecture()
    with cell:
        told, values = application(cell, at, built["count"])
    assert told == {"condition": "arrived", "position": [0.5, -0.25]}
    expected = [*accumulate(range(VALUES), lambda y, u: y + 0.25 * (u - y), initial=0.0)][1:]
    assert values == expected
    after = Path(built["count"]).stat()
    assert (after.st_mtime_ns, after.st_ino) == (before.st_mtime_ns, before.st_ino), "nothing was compiled"


def test_r122_a_configuration_that_lacks_something_is_refused(built: dict[str, str]) -> None:
    """A device of another processor or a source that is not a timer: the application is refused before it runs."""
    cell, at = three(gpac.System("three", clock="virtual"))
    with cell:
        drives = at["motion"].processor.physical_device("elsewhere", gpac.drivers.loopback("x"), exchange=at["motion"])
        with pytest.raises(gpac.PlacementError, match="elsewhere"):
            Joint("wrong", drive=drives["x"], on=at["servo"], kp=50.0, kd=0.0)
        with pytest.raises(gpac.SchedulingError, match="count"):
            application(cell, {**at, "work": at["driven"]}, built["count"])


def test_r122_devices_and_processors_come_while_it_runs() -> None:
    cell, at = one_processor()
    with cell:
        drives = at["servo"].processor.physical_device("drives", gpac.drivers.loopback("x"), exchange=at["servo"])
        old = gpac.Group("old", Joint("old.x", drive=drives["x"], on=at["servo"], kp=50.0, kd=0.0)).enable()
        moving = move.on(at["motion"]).asynch(old, goal=[1.0], speed=0.5)
        cell.advance("100 ms")
        more = cell.processor("rtp1")
        fast = more.timer("fast", period="1 ms", priority=80)
        new_drives = more.physical_device("new_drives", gpac.drivers.loopback("x"), exchange=fast)
        new = gpac.Group("new", Joint("new.x", drive=new_drives["x"], on=fast, kp=50.0, kd=0.0)).enable()
        assert moving.state == "running", "the old one moves on"
        assert move.on(at["motion"])(new, goal=[0.2], speed=1.0).position == pytest.approx([0.2], abs=0.01)
        assert moving.wait().position == pytest.approx([1.0], abs=0.01)
