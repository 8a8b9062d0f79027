# SPDX-License-Identifier: Apache-2.0
"""A process that is forked beside a running system has no part in it, says so, and ends; errors travel between processes."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from opengpac.errors import End, several
from opengpac.places import Place
from rig import Rig

FORKS = """
import os, sys, time
import opengpac as gpac
from opengpac import activate, library as lib
cell = gpac.System("cell")
fast = cell.processor("rtp0", process="process" in sys.argv).timer("fast", period="1 ms")
verb = gpac.Verb("v", blocks={"g": lib.signal_generator}, instantiation_parameters={"y": "g.y"},
                 command_lists={"start": [activate("g", every="1 ms")]})
y = cell.svv("y")
running = verb.on(fast).asynch(y)
child = os.fork()
if child == 0:
    for what in (lambda: cell.now, lambda: y.value, lambda: running.state, lambda: running.halt(), lambda: cell.svv("z")):
        try:
            what()
        except gpac.InvalidState as error:
            print("refused:", error)
    print(repr(cell), repr(y), repr(running), sep="\\n")
    cell.close()
    with gpac.System("own", clock="virtual") as own:
        own.advance("1 s")
        print("own:", own.now)
    sys.exit(7)
_, status = os.waitpid(child, 0)
print("child ended with", os.waitstatus_to_exitcode(status), "and the verb is", running.state)
with cell:
    pass
"""


@pytest.mark.parametrize("where", ["threads", "process"])
def test_a_fork_ends_cleanly_and_says_what_it_cannot_do(where: str) -> None:
    ran = subprocess.run([sys.executable, "-W", "ignore", "-c", FORKS, where], capture_output=True, text=True, timeout=120, check=False)
    said = ran.stdout.splitlines()
    assert sum("refused: system 'cell' runs in process" in line for line in said) == 5, ran.stdout + ran.stderr
    assert "own: 1.0" in said and said[-1] == "child ended with 7 and the verb is running", ran.stdout + ran.stderr
    assert ran.returncode == 0, ran.stderr


A_BLOCK_FORKS = """
import os, sys
import opengpac as gpac
from opengpac import activate
cell = gpac.System("cell")
fast = cell.processor("copied", process="process" in sys.argv).timer("fast", period="1 ms")
drive = fast.processor.physical_device("drive", gpac.drivers.loopback("x"), exchange=fast)
forks = cell.download(sys.argv[1], "forks").forks
verb = gpac.Verb("v", blocks={"b": forks}, instantiation_parameters={"y": "b.y"}, command_lists={"start": [activate("b", every="1 ms")]})
try:
    verb.on(fast)(cell.svv("y"), time_limit="60 s")
except gpac.Terminated as end:
    print("ended:", end.condition, end.block, end.message)
print("logged:", any("called fork()" in entry["text"] for entry in cell.log()))
cell.close()
for process in filter(str.isdecimal, os.listdir("/proc")):
    try:
        name, state = (open(f"/proc/{process}/{what}").read() for what in ("comm", "stat"))
    except OSError:
        continue
    if name.startswith("copied") and state.rpartition(")")[2].split()[0] != "Z":
        print("left:", process, name)
print("closed")
"""

FORKING = """
#include <opengpac.h>
#include <unistd.h>
FUNCTION_BLOCK(forks, "Calls fork() at its invocation 20.", out(double, y, "invocations"))
{
    self->y = (double)invocation->number;
    if (invocation->number == 20) fork();
    return OK;
}
"""


@pytest.mark.parametrize("where", ["threads", "process"])
def test_a_block_that_forks_is_a_fault_and_leaves_no_process(where: str, tmp_path: Path) -> None:
    (tmp_path / "forks.c").write_text(FORKING)
    command = [sys.executable, "-c", A_BLOCK_FORKS, str(tmp_path / "forks.c"), where]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    said = ran.stdout.splitlines()
    assert said[0].startswith("ended: fault b "), ran.stdout + ran.stderr
    assert "block 'b' (forks.forks) called fork(); the copy of the process was ended" in said[0], ran.stdout + ran.stderr
    assert said[1:] == ["logged: True", "closed"], ran.stdout + ran.stderr
    assert ran.returncode == 0, ran.stderr


KINDS = [kind for kind in vars(gpac).values() if isinstance(kind, type) and issubclass(kind, gpac.Error)]


@pytest.mark.parametrize("kind", KINDS)
def test_every_error_can_be_pickled(kind: Any) -> None:
    if kind is gpac.InstallationErrors:
        error = kind([gpac.CallError("no", remedy="say yes"), gpac.ValueRefused("no")])
    else:
        error = kind("no", remedy="say yes", ends=[End("a port", Place("p.py", 3))], place=Place("p.py", 1))
    for same in (pickle.loads(pickle.dumps(error)), copy.copy(error)):
        assert type(same) is type(error) and str(same) == str(error)
        assert (same.remedy, same.ends, same.place) == (error.remedy, error.ends, error.place)


def test_several_errors_of_a_kind_and_an_end_can_be_pickled(rig: Rig) -> None:
    error = several([gpac.NotEnabled("a"), gpac.NotEnabled("b")])
    same = pickle.loads(pickle.dumps(error))
    assert isinstance(same, gpac.NotEnabled) and isinstance(same, gpac.InstallationErrors) and len(same.errors) == 2
    with pytest.raises(gpac.Terminated) as caught:
        rig.counting().on(rig.fast)(rig.cell.svv("y"), time_limit="5 ms")
    ended = pickle.loads(pickle.dumps(caught.value))
    assert (ended.condition, str(ended), ended.report.time) == ("time_limit", str(caught.value), caught.value.report.time)


def test_everything_that_is_deleted_has_a_repr(rig: Rig) -> None:
    (y, gone) = rig.svvs("y", "gone")
    drive = rig.rtp.physical_device("drive", gpac.drivers.loopback("x"), exchange=rig.fast)
    joint = gpac.robots.Joint("j", drive=drive["x"], on=rig.fast)
    sensed, group = joint.sensed, gpac.Group("g", joint)
    running = rig.counting().on(rig.fast).asynch(y)
    history = rig.cell.svv("h", history=3).history
    shown = [gone, joint, sensed, group, running, drive, drive["x"], drive["x"].position, history, gone > 1.0]
    running.halt()
    running.delete()
    joint.delete()
    drive.delete()
    gone.delete()
    history._svv.delete()
    for thing in shown:
        assert repr(thing)
        if hasattr(thing, "_repr_html_"):
            thing._repr_html_()
    assert "deleted" in repr(gone) and "deleted" in repr(joint) and "deleted" in repr(running)
    rig.cell.close()
    assert all(repr(thing) for thing in [*shown, rig.cell, rig.rtp, rig.fast, rig.cell.alarms])
