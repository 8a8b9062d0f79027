# SPDX-License-Identifier: Apache-2.0
"""Requirement 122: one application on several architectures, by another configuration only."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import opengpac as gpac
from opengpac import activate, on
from opengpac import library as lib
from opengpac.robots import Joint, move

Sources = dict[str, gpac.Source]
LINK: dict[str, Any] = {"kind": "message", "seed": 3, "delay_ns": [0, 200_000], "drop": 0.01, "reorder": 0.01}


def application(cell: gpac.System, at: Sources, module: str) -> tuple[float, list[float], float]:
    """Two axes move together while a verb with a block in C counts; it knows the names of sources, and nothing of processors."""
    drives = at["servo"].processor.physical_device("drives", gpac.drivers.loopback("x", "y"), exchange=at["servo"])
    arm = gpac.Group("arm", *(Joint(f"arm.{p.name}", drive=p, on=at["servo"], kp=50.0, kd=0.0) for p in drives))
    counting = gpac.Verb(
        "counting",
        blocks={"count": cell.download(module, "count").count, "filter": lib.lowpass(alpha=1.0)},
        instantiation_parameters={"y": "filter.y"},
        cells={"raw": ["count.y", "filter.u"]},
        command_lists={"start": [activate("count", every="20 ms"), activate("filter")]},
        conditions={"enough": on("count.enough", returns=["y"])},
        input_parameters={"limit": "count.enough"},
        output_values={"y": "filter.y"},
    )
    with arm.enabled():
        running = counting.on(at["work"]).asynch(cell.svv("y"), limit=5)
        report = move.on(at["motion"])(arm, goal=[0.5, -0.25], speed=1.0, time_limit="10 s")
        return report.duration, [round(float(q), 2) for q in report.position], running.wait().y


def one_processor() -> tuple[gpac.System, Sources]:
    cell = gpac.System("one", clock="virtual")
    rtp = cell.processor("rtp0")
    slow = rtp.timer("slow", period="20 ms", priority=60)
    return cell, {"servo": rtp.timer("fast", period="1 ms", priority=80), "motion": slow, "work": slow}


def three_processors() -> tuple[gpac.System, Sources]:
    cell = gpac.System("three", clock="virtual", seed=5, interconnect=LINK)
    servo, motion, work = (cell.processor(name) for name in ("servos", "motions", "rest"))
    return cell, {
        "servo": servo.timer("servo", period="0.5 ms", priority=90),
        "motion": motion.timer("motion", period="20 ms", priority=50),
        "work": work.timer("work", period="10 ms", priority=10),
    }


ARCHITECTURES = [one_processor, three_processors]


@pytest.mark.parametrize("architecture", ARCHITECTURES, ids=lambda a: a.__name__)
def test_r122_an_application_moves_by_its_configuration_only(
    architecture: Callable[[], tuple[gpac.System, Sources]], built: dict[str, str]
) -> None:
    cell, at = architecture()
    with cell:
        duration, position, counted = application(cell, at, built["count"])
    assert (position, counted) == ([0.5, -0.25], 5.0)
    assert duration == pytest.approx(0.86, abs=0.2), "the same plan on each"


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
