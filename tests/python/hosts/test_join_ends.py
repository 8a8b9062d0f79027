# SPDX-License-Identifier: Apache-2.0
"""The end of a lent host: recalled by people or a service manager, or because its system has exited."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator

import pytest

import opengpac as gpac
from afar import shared_memory
from daemons import environment
from joining import LISTENER, Joining
from opengpac import activate, library

LIMIT = "30 s"

NAME = f"line{os.getpid()}"
"""System name that no other test uses."""

PROGRAM = """
import sys
import opengpac as gpac
cell = gpac.System(sys.argv[2], progress=False)
cell.listen(sys.argv[1], "cell-a")
cell.processor("rtp0")
cell.processor("rtp1", host="cell-b").timer("fast", period="5 ms", priority=80)
print("ready", flush=True)
sys.stdin.read()
"""
"""Program with a processor on another host, which waits indefinitely."""


def endless() -> gpac.Verb[..., object]:
    """Returns a verb that runs until something ends it."""
    return gpac.Verb(
        "endless",
        blocks={"wave": library.signal_generator(amplitude=1.0)},
        instantiation_parameters={"y": "wave.y"},
        command_lists={"start": [activate("wave", every="5 ms")]},
    )


def in_order(host: Joining) -> str:
    """Returns the output of a host that has ended by itself and in order."""
    status, said = host.ended()
    assert status == 0 and "Traceback" not in said, said
    assert not shared_memory(NAME)
    return said


@pytest.fixture
def mine(endpoint: str) -> Iterator[gpac.System]:
    """Yields a system in real time that listens under the unique name."""
    with gpac.System(NAME, progress=False) as cell:
        cell.listen(endpoint, LISTENER)
        yield cell


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_host_is_called_back(mine: gpac.System, joins: Callable[..., Joining], number: signal.Signals) -> None:
    host = joins(system=NAME)
    mine.processor("rtp0")
    there = mine.processor("rtp1", host="cell-b").timer("fast", period="5 ms", priority=80)
    goes = endless().on(there).asynch(mine.svv("goes"))
    host.process.send_signal(number)
    assert "host 'cell-b' has left; the devices are in their safe state" in in_order(host)
    with pytest.raises(gpac.Terminated, match="processor_lost"):
        goes.wait(timeout=LIMIT)


def test_a_host_is_called_back_before_it_is_let_in(joins: Callable[..., Joining]) -> None:
    host = joins()
    assert "end it with Ctrl-C" in host.first_line()
    host.interrupt()
    assert "host 'cell-b' has left" in in_order(host)


def test_a_host_ends_with_its_system(endpoint: str, joins: Callable[..., Joining]) -> None:
    with gpac.System(NAME, progress=False) as cell:
        cell.listen(endpoint, LISTENER)
        host = joins(system=NAME)
        cell.processor("rtp0")
        cell.processor("rtp1", host="cell-b").timer("fast", period="5 ms", priority=80)
    assert f"system '{NAME}' has ended; the devices are in their safe state" in in_order(host)


def test_a_host_ends_when_its_system_is_killed(endpoint: str, joins: Callable[..., Joining]) -> None:
    words = [sys.executable, "-c", PROGRAM, endpoint, NAME]
    with subprocess.Popen(words, env=environment(), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as program:
        host = joins(system=NAME)
        assert program.stdout is not None and program.stdout.readline() == "ready\n"
        program.kill()
    assert f"system '{NAME}' has ended; the devices are in their safe state" in in_order(host)
