# SPDX-License-Identifier: Apache-2.0
"""Everything of a system has been released when `close()` returns, even if a program keeps its parts: threads, descriptors, names."""

from __future__ import annotations

import gc
import os
import signal
import socket
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

import opengpac as gpac
from afar import children, resident_kb, until
from daemons import Daemon, environment
from opengpac import activate
from opengpac import library as lib


@pytest.fixture(autouse=True)
def _no_collection() -> Iterator[None]:
    """Disables garbage collection: no result may depend on its time."""
    gc.collect()
    gc.disable()
    yield
    gc.enable()


@pytest.fixture
def folder(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Yields the folder of a user who runs nothing else."""
    with tempfile.TemporaryDirectory(prefix="opengpac-left-") as of_user:
        monkeypatch.setenv("XDG_RUNTIME_DIR", of_user)
        yield Path(of_user)


def threads() -> Counter[str]:
    """Returns the threads of this process, by name."""
    names: Counter[str] = Counter()
    for task in Path("/proc/self/task").iterdir():
        try:
            names[(task / "comm").read_text().strip()] += 1
        except OSError:
            continue
    return names


def descriptors() -> Counter[str]:
    """Returns the open descriptors of this process, except that by which event loops are notified of ends, even after `close()`."""
    found: Counter[str] = Counter()
    for link in Path("/proc/self/fd").iterdir():
        try:
            to = os.readlink(link)
        except OSError:
            continue
        if to == "anon_inode:[eventfd]":
            continue
        found["socket" if to.startswith("socket:") else "pipe" if to.startswith("pipe:") else to] += 1
    return found


def shared() -> set[str]:
    """Returns the folders in shared memory that belong to systems of these tests."""
    return {path.name for path in Path("/dev/shm").iterdir() if path.name.startswith("opengpac-left-")}


def sockets(folder: Path) -> list[str]:
    """Returns the names left in the user's folder."""
    return sorted(path.name for path in (folder / "opengpac").glob("*-*") if path.name != "hosts-secret")


def used(cell: gpac.System, plant: str) -> list[object]:
    """Returns the parts of a system with a process, connections to it in both directions, and a device in each process."""
    near, far = cell.processor("near"), cell.processor("far", process=True)
    here, there = near.timer("here", period="5 ms", priority=50), far.timer("there", period="5 ms", priority=50)
    steps, beyond = near.software("steps"), far.software("beyond")
    held: list[object] = [near, far, here, there, steps, beyond]
    for name, places in (("in", {"a": there, "g": steps}), ("out", {"a": here, "g": beyond})):
        y = cell.svv(f"y_{name}")
        verb = gpac.Verb(
            f"goes_{name}",
            blocks={"a": lib.signal_generator(shape=0, offset=3.0), "g": lib.gain},
            instantiation_parameters={"y": "g.y"},
            cells={"u": ["a.y", "g.u"]},
            command_lists={"start": [activate("a", every="5 ms"), activate("g")]},
        )
        held += [y, verb, verb.on(places).asynch(y)]
        until(lambda y=y: y.value == 3.0, "a value has come through")
    for processor, exchange in ((near, here), (far, there)):
        driver = gpac.drivers.plant_process(gpac.drivers.loopback("x"), name=f"{plant}-{processor.name}")
        held.append(processor.physical_device(f"drive_{processor.name}", driver, exchange=exchange))
    return held


def test_close_ends_everything_while_the_program_holds_on(folder: Path) -> None:
    with gpac.System("left-warm", progress=False) as warm:
        used(warm, "warm")
    before = threads(), descriptors(), shared(), sockets(folder)
    cell = gpac.System("left-held", progress=False)
    held = used(cell, "held")
    cell.close()
    after = threads(), descriptors(), shared(), sockets(folder)
    assert held and not after[0] - before[0]
    assert not after[1] - before[1]
    assert (after[2] - before[2], after[3]) == (set(), before[3])


def test_a_reset_leaves_no_name_of_the_processes_that_were_killed() -> None:
    def names() -> list[Path]:
        return [name for folder in Path("/dev/shm").glob("opengpac-left-reset-*") for name in folder.iterdir()]

    with gpac.System("left-reset", progress=False) as cell:
        near, far = cell.processor("near"), cell.processor("far", process=True)
        here, there = near.timer("here", period="5 ms", priority=50), far.timer("there", period="5 ms", priority=50)
        verb = gpac.Verb(
            "goes_out",
            blocks={"a": lib.signal_generator(shape=0, offset=3.0), "g": lib.gain},
            instantiation_parameters={"y": "g.y"},
            cells={"u": ["a.y", "g.u"]},
            modes={"g.u": "asynchronous"},
            command_lists={"start": [activate("a", every="5 ms"), activate("g", every="5 ms")]},
        )
        before = 0
        for life in range(4):
            y = cell.svv(f"y{life}")
            instance = verb.on({"a": there, "g": here}).asynch(y)
            until(lambda y=y: y.value == 3.0, "a value has come through")
            assert not [name for name in names() if name.is_symlink() and not name.exists()]
            before = before or len(names())
            assert len(names()) == before
            (process,) = children("run_processor")
            os.kill(process, signal.SIGKILL)
            with pytest.raises(gpac.Terminated, match="SIGKILL"):
                instance.wait()
            cell.reset()


_PROGRAM = """
import sys, time
sys.path[:0] = {paths!r}
import opengpac as gpac
from test_left_behind import used
cell = gpac.System("left-killed", progress=False)
held = used(cell, "killed")
print("ready", flush=True)
time.sleep(600)
"""


def test_nothing_is_left_of_a_program_that_is_killed(folder: Path) -> None:
    """Its plants are killed with it, so they cannot remove their names: the guard of the program does."""
    here = str(Path(__file__).parent)
    command = [sys.executable, "-c", _PROGRAM.format(paths=[here])]
    killed = subprocess.Popen(command, env=environment(XDG_RUNTIME_DIR=str(folder)), stdout=subprocess.PIPE, text=True)
    assert killed.stdout is not None
    assert killed.stdout.readline().strip() == "ready"
    plants = [name for name in sockets(folder) if name.startswith("plant-")]
    assert len(plants) == 2
    for plant in plants:
        # A recently created one is left alone: its creator may not listen there yet.
        os.utime(folder / "opengpac" / plant, (1, 1))
    for pid in processes_with(folder, "plant"):
        os.kill(pid, signal.SIGKILL)
    killed.kill()
    killed.communicate()
    until(lambda: not processes_with(folder, ""), "every process of it has ended")
    assert not [name for name in shared() if "left-killed" in name]
    assert sockets(folder) == []


def test_the_next_plant_takes_the_names_of_killed_ones_away(folder: Path) -> None:
    left = folder / "opengpac" / "plant-of-somebody"
    left.parent.mkdir(mode=0o700, exist_ok=True)
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(left))
    os.utime(left, (1, 1))
    assert left.exists()
    with gpac.System("left-next", progress=False) as cell:
        near = cell.processor("near")
        driver = gpac.drivers.plant_process(gpac.drivers.loopback("x"))
        near.physical_device("drive", driver, exchange=near.timer("here", period="5 ms", priority=50))
        assert not left.exists()


def processes_with(folder: Path, word: str) -> list[int]:
    """Returns the processes that were started with this folder and have this word in their command line."""
    found = []
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit() or int(entry.name) == os.getpid():
            continue
        try:
            if str(folder).encode() in (entry / "environ").read_bytes() and word.encode() in (entry / "cmdline").read_bytes():
                found.append(int(entry.name))
        except OSError:
            continue
    return found


def test_a_recording_that_was_stopped_leaves_no_stack_of_its_threads(tmp_path: Path) -> None:
    def mappings() -> int:
        return len(Path("/proc/self/maps").read_text().splitlines())

    with gpac.System("cell", clock="virtual") as cell:
        cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        cell.svv("y")

        def record(count: int) -> None:
            for number in range(count):
                recording = cell.record(tmp_path / f"{count}-{number}.mcap")
                cell.advance("2 ms")
                recording.stop()

        record(40)
        before = mappings()
        record(60)
        # Each leaked stack is two mappings, those of sixty recordings 240.
        assert mappings() - before < 60


def test_a_daemon_that_records_often_keeps_no_memory_of_it(tmp_path: Path) -> None:
    (tmp_path / "records").mkdir()
    daemon = Daemon(tmp_path, "virtual", "--records", str(tmp_path / "records"))
    with gpac.connect(daemon.url, name="recorder") as cell:
        cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        cell.svv("y")

        def record(first: int, count: int) -> None:
            for number in range(first, first + count):
                recording = cell.record(f"{number}.mcap")
                cell.advance("2 ms")
                recording.stop()

        record(0, 60)
        before_kb = resident_kb(daemon.process.pid)
        record(60, 120)
        # Each recording once left 40 kB behind: 4,800 kB.
        assert resident_kb(daemon.process.pid) - before_kb < 1500
    daemon.stop()
