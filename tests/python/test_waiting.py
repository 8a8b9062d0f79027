# SPDX-License-Identifier: Apache-2.0
"""Waiting: in event loops, with Ctrl-C, in real time, and at the end of a program."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
import threading

import pytest

import opengpac as gpac
from rig import Rig


def test_await_advances_the_virtual_clock(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    counting = rig.counting().on(rig.fast)

    async def both() -> list[gpac.Report]:
        return list(await asyncio.gather(counting.asynch(a, limit=30), counting.asynch(b, limit=10)))

    first, second = asyncio.run(both())
    assert (first.last, second.last) == (30, 10)
    assert rig.cell.now == pytest.approx(0.031)


def test_time_stands_still_while_a_task_is_ready(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    seen: list[float] = []

    async def busy() -> None:
        for _ in range(100):
            seen.append(rig.cell.now)
            await asyncio.sleep(0)

    async def both() -> None:
        await asyncio.gather(busy(), rig.counting().on(rig.fast).asynch(a, limit=5))

    asyncio.run(both())
    assert seen == [0.0] * 100


def test_cancelling_halts(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    vi = rig.counting().on(rig.fast).new_instance(a).start()

    async def cancelled() -> None:
        task = asyncio.ensure_future(_report(vi))
        await asyncio.sleep(0)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task

    asyncio.run(cancelled())
    assert vi.state == "ended" and vi.report is not None and vi.report.condition == "halted"


async def _report(vi: gpac.VerbInstance[gpac.Report]) -> gpac.Report:
    return await vi


def test_an_exception_comes_through_await(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    vi = rig.counting().on(rig.fast).asynch(a, time_limit="10 ms")
    with pytest.raises(gpac.Terminated, match="time_limit"):
        asyncio.run(_report(vi))
    assert vi.state == "deleted"


def test_await_in_real_time(real_cell: gpac.System, built: dict[str, str]) -> None:
    rig = Rig(real_cell, built)
    a, b = rig.svvs("a", "b")
    counting = rig.counting().on(rig.fast)

    async def both() -> list[gpac.Report]:
        return list(await asyncio.gather(counting.asynch(a, limit=30), counting.asynch(b, limit=10)))

    first, second = asyncio.run(both())
    assert (first.last, second.last) == (30, 10)


def test_a_call_in_real_time(real_cell: gpac.System, built: dict[str, str]) -> None:
    rig = Rig(real_cell, built)
    (a,) = rig.svvs("a")
    assert rig.counting().on(rig.fast)(a, limit=20).last == 20


def test_ctrl_c_in_a_call_halts_the_instance(real_cell: gpac.System, built: dict[str, str]) -> None:
    rig = Rig(real_cell, built)
    (a,) = rig.svvs("a")
    counting = rig.counting().on(rig.fast)

    def interrupt() -> None:
        rig_started.wait()
        while a.number < 10:
            pass
        os.kill(os.getpid(), signal.SIGINT)

    rig_started = threading.Event()
    thread = threading.Thread(target=interrupt)
    thread.start()
    rig_started.set()
    with pytest.raises(KeyboardInterrupt):
        counting(a, time_limit="20 s")
    thread.join()
    assert real_cell.names["instances"] == []


def test_ctrl_c_in_wait_ends_the_wait_only(real_cell: gpac.System, built: dict[str, str]) -> None:
    rig = Rig(real_cell, built)
    (a,) = rig.svvs("a")
    vi = rig.counting().on(rig.fast).asynch(a)
    timer = threading.Timer(0.1, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        vi.wait("20 s")
    timer.join()
    assert vi.state == "running"
    vi.halt()
    assert vi.wait().condition == "halted"


def test_a_timeout_leaves_it_running(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    vi = rig.counting().on(rig.fast).asynch(a)
    with pytest.raises(TimeoutError, match="did not end within"):
        vi.wait(timeout="50 ms")
    assert vi.state == "running"


def test_progress_is_shown_when_asked(built: dict[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    with gpac.System("shown", progress=True) as cell:
        rig = Rig(cell, built)
        (a,) = rig.svvs("a")
        rig.counting().on(rig.fast)(a, limit=300)
    assert "counting#" in capsys.readouterr().err


def test_the_interpreter_closes_what_is_open() -> None:
    program = """
import opengpac as gpac
arm = gpac.robots.load("two_joint").enable()
gpac.robots.move.asynch(arm, [0.1] * len(arm), speed=0.01)
print("made")
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=300, check=False)
    assert (done.returncode, done.stdout.strip()) == (0, "made"), done.stderr
