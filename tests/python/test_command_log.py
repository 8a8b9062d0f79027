# SPDX-License-Identifier: Apache-2.0
"""Commands of the program in the log: executed ones before their consequences, refused ones with the reason."""

from __future__ import annotations

import pytest

import opengpac as gpac
from rig import Rig


def commands(rig: Rig) -> list[str]:
    """Returns the program's commands that concern the instance."""
    return [entry["text"] for entry in rig.cell.log() if entry["kind"] == "command" and entry["about"] == "mine"]


def test_what_is_refused_is_told_and_hides_nothing(memory_rig: Rig) -> None:
    rig = memory_rig
    vi = rig.counting().on(rig.fast).named("mine").new_instance(rig.svvs("a")[0])
    for refused in (vi.resume, vi.suspend, vi.resume):
        with pytest.raises(gpac.InvalidState):
            refused()
    told = commands(rig)
    assert [text.split(":")[0] for text in told] == ["resume was refused", "suspend was refused"], "the third is counted"
    assert all("'mine'" in text and "created" in text for text in told)
    for carried_out in (vi.start, vi.suspend, vi.resume, vi.halt):
        carried_out()
    assert commands(rig)[2:] == ["start", "suspend", "resume", "halt"]


def test_a_command_comes_before_what_it_leads_to(memory_rig: Rig) -> None:
    rig = memory_rig
    vi = rig.counting().on(rig.fast).named("mine").new_instance(rig.svvs("a")[0])
    vi.start()
    vi.halt()
    kinds = [(entry["kind"], entry["text"].split(":")[0]) for entry in rig.cell.log() if entry["about"] == "mine"]
    assert [kind for kind, _ in kinds] == ["command", "start", "command", "end"]
    assert kinds[2] == ("command", "halt")


def test_other_things_are_refused_too(memory_rig: Rig) -> None:
    rig = memory_rig
    (written,) = rig.svvs("a")
    vi = rig.counting().on(rig.fast).named("mine").new_instance(written)
    vi.start()
    with pytest.raises(gpac.SecondWriter):
        written.value = 1.0
    entry = next(entry for entry in rig.cell.log() if entry["text"].startswith("write"))
    assert entry["text"].startswith("write was refused: ") and entry["who"] == "program"


def test_a_start_that_is_refused_is_the_only_line_about_it(memory_rig: Rig) -> None:
    rig = memory_rig
    (written,) = rig.svvs("a")
    counting = rig.counting().on(rig.fast).named("mine")
    with counting.new_instance(written):
        pass
    first = rig.counting("first").on(rig.fast).asynch(written)
    with pytest.raises(gpac.SecondWriter):
        counting.asynch(written)
    assert [text.split(":")[0] for text in commands(rig)] == ["start was refused"]
    first.halt()
