# SPDX-License-Identifier: Apache-2.0
"""Blocks that stay Python: on the virtual clock, in a process, and when they are late, raise, die or do not return."""

import contextlib
import importlib
import os
import threading
import time
from pathlib import Path
from typing import Annotated as A
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from afar import children, until
from opengpac import activate, on
from opengpac import library as lib
from opengpac.python import Condition, Input, Invocation, Output, Parameter, State
from python_blocks.faulty import HEAD

PATIENT: dict[str, Any] = {"process": True, "lost_after": "10 s"}


@gpac.block(native=False)
def fit(
    u: A[np.ndarray, Input("samples", type="double[3]")],
    line: A[np.ndarray, Output("offset and slope", type="double[2]")],
    seen: A[int, Output("invocations so far")],
    steep: A[bool, Condition("the slope is above 1")],
    now: Invocation,
    sums: A[np.ndarray, State(type="double[2]")] = (0.0, 0.0),  # type: ignore[assignment]
    weight: A[float, Parameter()] = 1.0,
) -> None:
    """Sum of the straight lines through the samples."""
    found = np.polynomial.polynomial.polyfit([0.0, 1.0, 2.0], u * weight, 1)
    sums = sums + found
    line, seen, steep = sums, now.number + 1, bool(found[1] > 1)


def test_any_python_runs_in_a_trial() -> None:
    tried = fit.run(u=[[0.0, 1.0, 2.0], [0.0, 3.0, 6.0]], weight=0.5)
    np.testing.assert_allclose(tried.line, [[0.0, 0.5], [0.0, 2.0]], atol=1e-12)
    assert tried.seen.tolist() == [1, 2] and tried.conditions == [(1, "steep", None)]


@gpac.block(native=False)
def thorough(y: A[float, Output()]) -> None:
    """Computes for longer than the budget of compiled blocks in a trial, like a block that first loads a network."""
    end = time.monotonic() + 1.3
    while time.monotonic() < end:
        y = y + 1.0


def test_a_trial_gives_python_the_time_that_it_takes() -> None:
    """A call ended by a budget would keep the interpreter's lock, and this process would hang."""
    tried = thorough.run(steps=2)
    assert tried.fault is None and tried.y[0] > 0


@gpac.block(native=False, deadline="1 us")
def slow(y: A[float, Output()], pid: A[int, Output()], now: Invocation) -> None:
    """Counts, outputs its process, and exceeds its budget."""
    y, pid = now.number + 1.0, os.getpid()


@gpac.block(native=False)
def raising(y: A[float, Output()], pid: A[int, Output()], now: Invocation) -> None:
    """Raises in its third invocation."""
    if now.number == 2:
        raise ValueError("no picture")
    y = now.number + 1.0


@gpac.block(native=False)
def dying(y: A[float, Output()], pid: A[int, Output()], now: Invocation) -> None:
    """Ends its process in its third invocation."""
    if now.number == 2:
        os._exit(3)
    y = now.number + 1.0


@gpac.block
def count(n: A[int, Output()]) -> None:
    """Counts its invocations; compiled."""
    n += 1


def looking(block: Any, **more: Any) -> gpac.Verb[..., Any]:
    """Returns a verb with the block on its own processor, and one on another processor that reads its value asynchronously."""
    start = [activate("copy", every="2 ms"), activate("count", every="2 ms"), activate("look", every="10 ms", budget="60 s")]
    more.setdefault("command_lists", {"start": start})
    return gpac.Verb("look",
        blocks={"look": block, "copy": lib.gain(k=1.0), "count": count},
        instantiation_parameters={"pid": "look.pid", "copied": "copy.y", "counted": "count.n"},
        cells={"value": ["look.y", "copy.u"]}, modes={"copy.u": "asynchronous"}, **more)  # fmt: skip


class Eyes:
    """System with a processor of this program and one for Python, and the SVVs of `looking`."""

    def __init__(self, clock: str = "monotonic") -> None:
        self.cell = gpac.System("eyes", clock=clock, progress=False)
        self.fast = self.cell.processor("rtp0").timer("fast", period="2 ms", priority=80)
        self.look = self.cell.processor("eyes", **PATIENT).timer("look", period="10 ms", priority=10)
        self.pid, self.copied = self.cell.svv("pid", int, history=20), self.cell.svv("copied", history=100)
        self.counted = self.cell.svv("counted", int)

    def start(self, verb: gpac.Verb[..., Any]) -> gpac.VerbInstance[Any]:
        return verb.on({"look": self.look, "*": self.fast}).asynch(self.pid, self.copied, self.counted)


def test_it_runs_in_a_process_of_its_own_which_ends_with_the_system() -> None:
    eyes = Eyes()
    with eyes.cell:
        instance = eyes.start(looking(slow))
        until(lambda: eyes.copied.value > 1, "values come")
        assert [eyes.pid.value] == children("run_processor")
        assert 0 < eyes.pid.history[-1]["time"] <= eyes.cell.now, "its values have the time at which it took its inputs"
        instance.halt()
    until(lambda: not children("run_processor"), "its process ends")


def test_one_that_is_late_is_a_condition_with_its_time() -> None:
    eyes = Eyes()
    with eyes.cell:
        report = eyes.start(looking(slow, conditions={"late_look": on("look.late", returns=[])})).wait()
        assert report.condition == "late_look" and report.value > 1e-6


@pytest.mark.parametrize("clock", ["virtual", "monotonic"])
def test_what_it_raises_is_a_fault_with_its_text_and_line(clock: str) -> None:
    eyes = Eyes(clock)
    with eyes.cell, pytest.raises(gpac.Terminated, match=r"at test_interpreted.py:(\d+): ValueError: no picture") as ended:
        eyes.start(looking(raising)).wait()
    assert (ended.value.condition, ended.value.block) == ("fault", "look")
    lines = Path(__file__).read_text().splitlines()
    line = lines.index('        raise ValueError("no picture")') + 1
    assert f"test_interpreted.py:{line}: ValueError" in str(ended.value)


def test_where_its_process_dies_another_list_goes_on() -> None:
    eyes = Eyes()
    lists = {"start": [activate("look", every="10 ms", budget="60 s"), activate("copy", every="2 ms")],
        "alone": [activate("count", every="2 ms")]}  # fmt: skip
    with eyes.cell:
        instance = eyes.start(looking(dying, command_lists=lists, initial="start", transitions={("start", "processor_lost"): "alone"}))
        until(lambda: eyes.counted.value > 0, "the other list runs")
        assert eyes.copied.value == 2.0, "the last value stands"
        instance.halt()


def test_one_that_does_not_return_holds_up_no_firing_and_its_age_is_a_condition(tmp_path: Path) -> None:
    door, shut = tmp_path / "door", tmp_path / "shut"
    os.mkfifo(door)
    text = HEAD.replace("@gpac.block", "@gpac.block(native=False)")
    # Opened for reading and writing: it waits for data even if no other process has opened it.
    text += f"def wait(y: Y, pid: A[int, Output()]):\n    import os\n    y = 1.0\n    if os.path.exists({str(shut)!r}):\n"
    text += f"        with open({str(door)!r}, 'r+b', buffering=0) as door:\n            y = float(door.read(3))\n"
    (tmp_path / "program.py").write_text(text)
    space: dict[str, Any] = {"__name__": "__main__"}
    exec(compile(text, str(tmp_path / "program.py"), "exec"), space)
    eyes = Eyes()
    watch = gpac.Verb("watch", blocks={"old": lib.gain(k=1.0)}, modes={"old.u": "asynchronous"},
        instantiation_parameters={"u": "old.u", "y": "old.y"},
        command_lists={"start": [activate("old", every="2 ms")]}, conditions={"link_lost": on(returns=[])})  # fmt: skip
    with eyes.cell:
        looks = gpac.Verb("look", blocks={"look": space["wait"], "count": count},
            instantiation_parameters={"y": "look.y", "counted": "count.n"},
            command_lists={"start": [activate("count", every="2 ms"), activate("look", every="10 ms", budget="60 s")]})  # fmt: skip
        y, seen, aged = (eyes.cell.svv(name) for name in ("y", "seen", "aged"))
        looks.on({"look": eyes.look, "*": eyes.fast}).asynch(y, eyes.counted)
        # Connected while the invocation returns: a busy source accepts a new reader only after its invocation.
        watch.on(eyes.fast).asynch(y, seen)
        until(lambda: seen.value == 1, "its values come")
        old = watch.on(eyes.fast).asynch(y, aged, age_max="1 s")
        until(lambda: aged.value == 1, "its values come")
        shut.touch()
        assert old.wait().condition == "link_lost"
        before = eyes.counted.value
        until(lambda: eyes.counted.value > before + 20, "others go on")
        assert seen.value == 1

        def came() -> bool:
            """Offers the value once more; returns whether it has arrived. A reader that begins while an invocation waits is served after
            that invocation or the next one."""
            with contextlib.suppress(BlockingIOError):
                os.write(offer, b"7.0")
            return seen.value == 7

        offer = os.open(door, os.O_RDWR | os.O_NONBLOCK)
        try:
            until(came, "its value comes")
        finally:
            os.close(offer)
    until(lambda: not children("run_processor"), "a function that does not return keeps no process")


def test_under_the_virtual_clock_it_takes_no_time_and_gives_the_same_each_time() -> None:
    def run() -> list[float]:
        eyes = Eyes("virtual")
        with eyes.cell:
            eyes.start(looking(slow, conditions={"late_look": on("look.late", returns=[])}))
            eyes.cell.advance("100 ms")
            assert eyes.pid.value == os.getpid(), "the function of the program itself is called"
            return eyes.copied.history[:]["value"].tolist()

    assert run() == run() and len(set(run())) >= 10


def test_on_a_thread_of_this_program_it_is_refused() -> None:
    eyes = Eyes()
    with eyes.cell:
        verb = looking(slow).on(eyes.fast)
        with pytest.raises(
            gpac.PlacementError, match=r"'look' of .* runs in a Python interpreter \(slow\), .*'rtp0.fast' is a thread"
        ) as refused:
            verb(eyes.pid, eyes.copied, eyes.counted)
        assert "process=True" in refused.value.remedy


FAULTY = {
    "a value returned": ("def f(u: U, y: Y):\n    y = u\n    return u\n", "(native=False)", 3, "returns a value", "return y"),
    "a generator": ("def f(u: U, y: Y):\n    y = u\n    yield\n", "(native=False)", 3, "is a generator", "State"),
    "what cannot be sent": (
        "def f(u: U, y: Y):\n    with LOCK:\n        y = u\n",
        "(native=False)",
        1,
        "cannot be sent to a process",
        "inside the function",
    ),
    "a deadline of nothing": (
        "def f(u: U, y: Y):\n    y = u\n",
        "(native=False, deadline='0 s')",
        1,
        "deadline must be more than 0 s, not '0 s'",
        "write '1 ms'",
    ),
    "an item as the deadline's condition": (
        "def f(late: U, y: Y):\n    y = late\n",
        "(native=False, deadline='1 s')",
        1,
        "an item 'late'",
        "rename the item",
    ),
    "a deadline of native code": ("def f(u: U, y: Y):\n    y = u\n", "(deadline='1 ms')", 1, "has a deadline, but is compiled", "budget"),
}


@pytest.mark.parametrize("name", FAULTY)
def test_what_no_process_can_run_is_refused(name: str, tmp_path: Path) -> None:
    text, options, line, message, remedy = FAULTY[name]
    text = HEAD.replace("@gpac.block", f"@gpac.block{options}") + text
    (tmp_path / "program.py").write_text(text)
    with pytest.raises(gpac.DefinitionError, match=message) as refused:
        exec(compile(text, str(tmp_path / "program.py"), "exec"), {"__name__": "program", "LOCK": threading.Lock()})
    assert remedy in refused.value.remedy
    assert refused.value.place == (str(tmp_path / "program.py"), HEAD.count("\n") + line), str(refused.value)


def test_without_cloudpickle_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str, *given: Any) -> Any:
        raise ModuleNotFoundError(f"No module named '{name}'", name=name)

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(gpac.DefinitionError, match=r"cloudpickle, which is not installed.*; run pip install 'opengpac\[python\]'"):
        gpac.block(native=False)(slow.function)
