# SPDX-License-Identifier: Apache-2.0
"""A process forked from a running system takes no part in it, reports so, and ends; errors travel between processes."""

from __future__ import annotations

import copy
import os
import pickle
import re
import signal
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from afar import until
from opengpac.errors import End, several
from opengpac.refusals.source_location import Place
from orphans import lives
from ports import held_port
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
    assert "Traceback" not in ran.stderr, ran.stderr


TWO = """
import multiprocessing, sys
import opengpac as gpac

def systems(where):
    for name in ("first", "second"):
        cell = gpac.System(name, clock="virtual" if where == "virtual" else "monotonic")
        cell.processor("rtp0", process=where == "process").timer("fast", period="1 ms")
        yield cell, cell.svv("y", initial=1.0)

def work(number):
    said = []
    for cell, y in both:
        for what in (lambda: y.value, lambda: setattr(y, "value", 2.0), lambda: cell.now, lambda: cell.svv("z")):
            try:
                what()
            except gpac.InvalidState as error:
                said.append(str(error).partition(" at ")[0])
    with gpac.System("own", clock="virtual") as own:
        own.advance("1 s")
        return number, own.now, said

both = list(systems(sys.argv[1]))
context = multiprocessing.get_context("fork")
with context.Pool(2) as pool:
    for number, now, said in pool.map(work, range(3)):
        is_told = all("cannot use it" in one for one in said)
        print("worker", number, now, len(said), is_told, *{one.split("'")[1] for one in said})
one = context.Process(target=work, args=(9,))
one.start()
one.join()
print("process", one.exitcode, *(y.value for _, y in both))
for cell, _ in both:
    cell.close()
"""


@pytest.mark.parametrize("where", ["virtual", "threads", "process"])
def test_workers_of_multiprocessing_have_no_part_in_either_of_two_systems(where: str) -> None:
    command = [sys.executable, "-W", "ignore", "-c", TWO, where]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    said = ran.stdout.splitlines()
    assert [line.split()[:5] for line in said[:3]] == [["worker", str(n), "1.0", "8", "True"] for n in range(3)], ran.stdout + ran.stderr
    assert all(set(line.split()[5:]) == {"first", "second"} for line in said[:3]), ran.stdout
    assert said[3:] == ["process 0 1.0 1.0"] and ran.returncode == 0 and "Traceback" not in ran.stderr, ran.stdout + ran.stderr


BESIDE = """
import os, sys, time
import opengpac as gpac
from afar import children
with gpac.System(sys.argv[1], progress=False) as cell:
    rtp = cell.processor("rtp0", process="process" in sys.argv)
    fast = rtp.timer("fast", period="2 ms")
    plant = gpac.drivers.plant_process(gpac.drivers.loopback("x"), name=sys.argv[1], linger="1 s")
    rtp.physical_device("drive", plant, exchange=fast)
    child = os.fork()
    if child == 0:
        time.sleep(600)
        os._exit(0)
    print(child, *children("run_processor"), *children("run_guard"), flush=True)
    time.sleep(600)
"""


@pytest.mark.parametrize("where", ["threads", "process"])
def test_a_forked_child_keeps_nothing_alive_when_its_parent_is_killed(where: str) -> None:
    """The child has copies of every descriptor of its parent, including those of the links to guards and processors."""
    command = [sys.executable, "-W", "ignore", "-c", BESIDE, f"forked-{os.getpid()}-{where}", where]
    paths = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": paths}) as run:
        assert run.stdout
        child, *processes = [int(word) for word in run.stdout.readline().split()]
        try:
            assert len(processes) == (2 if where == "threads" else 3), "two guards, and a processor"
            run.kill()
            until(lambda: not any(lives(process) for process in processes), "what its parent started has ended")
        finally:
            os.kill(child, signal.SIGKILL)


WITH_A_DEVICE = """
import os, sys, time
import opengpac as gpac
cell = gpac.System("held", progress=False)
rtp = cell.processor("rtp0")
if sys.argv[1] == "client":
    driver = gpac.drivers.text(sys.argv[2], reads=["{weight}"], fields={"weight": {"unit": "kg"}})
else:
    driver = gpac.drivers.modbus_server(sys.argv[2], channels={"wanted": {"holding": 100, "type": "double"}})
rtp.physical_device("scale", driver, exchange=rtp.timer("slow", period="10 ms"))
child = os.fork()
if child == 0:
    time.sleep(600)
    os._exit(0)
cell.close()
print(child, flush=True)
sys.stdin.read()
"""


def test_a_forked_child_does_not_hold_a_device() -> None:
    """The other end sees the connection close with the parent's system, although the child lives."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        command = [sys.executable, "-W", "ignore", "-c", WITH_A_DEVICE, "client", f"tcp/127.0.0.1:{server.getsockname()[1]}"]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as run:
            server.settimeout(120)
            connection, _ = server.accept()
            with connection:
                assert run.stdout and run.stdin
                child = int(run.stdout.readline())
                try:
                    assert lives(child)
                    connection.settimeout(30)
                    assert connection.recv(1) == b"", "the connection ends, though the child lives"
                finally:
                    os.kill(child, signal.SIGKILL)
                    run.stdin.close()


def test_a_forked_child_does_not_hold_a_port() -> None:
    """Other programs can listen on the port of the parent's system, although the child lives."""
    with held_port() as port:
        command = [sys.executable, "-W", "ignore", "-c", WITH_A_DEVICE, "server", f"tcp/127.0.0.1:{port}"]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as run:
            assert run.stdout and run.stdin
            child = int(run.stdout.readline())
            try:
                assert lives(child)
                socket.create_server(("127.0.0.1", port)).close()
            finally:
                os.kill(child, signal.SIGKILL)
                run.stdin.close()


EXECUTED = """
import os, subprocess, sys
import opengpac as gpac
with gpac.System("executed", progress=False) as cell:
    rtp = cell.processor("rtp0")
    fast = rtp.timer("fast", period="2 ms")
    cell.processor("rtp1", process=True).timer("fast", period="2 ms")
    rtp.physical_device("drive", gpac.drivers.plant_process(gpac.drivers.loopback("x")), exchange=fast)
    rtp.physical_device("inline", gpac.drivers.loopback("y"), exchange=fast)
    listed = subprocess.run(["ls", "-l", "/proc/self/fd"], close_fds=False, capture_output=True, text=True).stdout
    found = [line.split(" -> ") for line in listed.splitlines() if " -> " in line]
    kept = [what for name, what in found if int(name.split()[-1]) > 2 and not what.startswith("/proc/")]
    print(len(os.listdir("/proc/self/fd")) > 20, kept)
"""


def test_a_program_that_is_executed_has_no_descriptor_of_ours() -> None:
    ran = subprocess.run([sys.executable, "-W", "ignore", "-c", EXECUTED], capture_output=True, text=True, timeout=120, check=False)
    assert ran.stdout == "True []\n", ran.stdout + ran.stderr


OPENS = re.compile(
    r"\b(?:libc::)?(socket|socketpair|open|openat|fopen|dup|dup2|dup3|pipe|pipe2|accept|accept4|memfd_create|shm_open|eventfd|timerfd_create"
    r"|epoll_create|epoll_create1|inotify_init|inotify_init1|posix_openpt|recvmsg|F_DUPFD\w*)\b"
)
"""Names of functions that create a descriptor."""

EXCEPT = {
    # Standard output and standard error of a process of the kit, while its output is counted.
    "crates/driver-kit/src/conformance/measures.rs": ["dup2"],
    # Standard error of a program that is executed next.
    "crates/driver-kit/src/conformance/sanitized.rs": ["dup2"],
    # A CAN socket transfers no descriptors.
    "crates/canopen/src/link/socket.rs": ["recvmsg"],
}


def test_every_descriptor_that_is_made_is_closed_in_programs_that_are_executed() -> None:
    """Rust's own files and sockets are; every other call to the operating system must request it."""
    root = Path(__file__).parent.parent.parent
    sources = [path for ending in ("rs", "c", "h") for path in sorted((root / "crates").glob(f"*/src/**/*.{ending}"))]
    calls: list[str] = []
    wrong: list[str] = []
    for path in sources:
        text, place = path.read_text(), path.relative_to(root).as_posix()
        for found in OPENS.finditer(text):
            is_call = text[found.start() - 6 : found.start()] == "libc::" or found[0].startswith("libc::")
            if not (is_call or (path.suffix != ".rs" and text[found.end()] == "(")) or found[1] in EXCEPT.get(place, []):
                continue
            calls.append(place)
            if "CLOEXEC" not in text[found.start() : text.find(";", found.end())]:
                wrong.append(f"{place}: {text[found.start() : found.end() + 60]!r}")
    assert len(calls) > 8 and not wrong, wrong


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


FORKS_WITH_FILES = """
import os, sys
from opengpac.storage.process_folders import process_folder
folder = process_folder("components")
(folder / "built.so").touch()
if os.fork() == 0:
    print(process_folder("components") == folder, flush=True)
    sys.exit(0)
os.wait()
print((folder / "built.so").exists(), folder, flush=True)
"""


def test_a_forked_child_that_ends_leaves_the_files_of_its_parent() -> None:
    """Blocks built for this process are in its folder, which is removed with the process and not before."""
    ran = subprocess.run([sys.executable, "-W", "ignore", "-c", FORKS_WITH_FILES], capture_output=True, text=True, timeout=120, check=False)
    assert ran.returncode == 0, ran.stderr
    of_child, kept, folder = ran.stdout.split()
    assert (of_child, kept) == ("False", "True") and not Path(folder).exists()


KINDS = [kind for kind in vars(gpac.errors).values() if isinstance(kind, type) and issubclass(kind, gpac.Error)]


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
