# SPDX-License-Identifier: Apache-2.0
"""Blocks in Python: their values, refusals, one compilation each, and the message if numba is missing."""

import importlib
import math
import re
from pathlib import Path
from typing import Annotated as A
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac import activate, on
from opengpac import library as lib
from opengpac.python import Condition, Input, Invocation, Output, Parameter, State, compiling
from python_blocks.faulty import FAULTY, HEAD

C = """#include <opengpac.h>
#include <math.h>
FUNCTION_BLOCK(wander, "A filter.", in(double, u, "raw", "rad"), out(double, y, "smooth", "rad"), out(int64_t, n, "number"),
    state(double[2], x, (0.5, 0), "memory"), param(double, k, 0.1, "factor"))
{
    self->x[0] += self->k * (self->u - self->x[0]) + self->k * self->x[1];
    self->x[1] = sin(self->x[0]) * self->u + self->x[1] * 0.3;
    self->y = self->x[0] / (2.0 + self->x[1] * self->x[1]);
    self->n += 3;
    return OK;
}
"""


@gpac.block
def wander(
    u: A[float, Input("raw", "rad")],
    y: A[float, Output("smooth", "rad")],
    n: A[int, Output("number")],
    x: A[np.ndarray, State("memory", type="double[2]")] = (0.5, 0),  # type: ignore[assignment]
    k: A[float, Parameter("factor")] = 0.1,
) -> None:
    """A filter."""
    x[0] += k * (u - x[0]) + k * x[1]
    x[1] = math.sin(x[0]) * u + x[1] * 0.3
    y = x[0] / (2.0 + x[1] * x[1])
    n += 3


@gpac.block
def items(
    u: A[float, Input(type="float")],
    flag: A[bool, Input(mode="asynchronous")],
    y: A[float, Output(type="float")],
    time: A[float, Output(unit="s")],
    high: A[bool, Condition("u is above 2")],
    now: Invocation,
    m: A[np.ndarray, Parameter(type="int32_t[2][2]")] = ((1, 2), (3, 4)),  # type: ignore[assignment]
) -> None:
    """Uses each kind of item."""
    time = now.time
    if flag:
        return
    y = u * m[1, 0]
    high = u > 2


@gpac.block
def pick(i: A[int, Input()], q: A[np.ndarray, Input(type="double[3]")], y: A[float, Output()]) -> None:
    """Divides element i by i."""
    y = q[i] / i


def test_a_block_in_python_gives_the_bits_of_the_same_block_in_c(tmp_path: Path) -> None:
    (tmp_path / "same.c").write_text(C)
    in_c = gpac.System("cell", clock="virtual").download(tmp_path / "same.c").wander
    values = np.random.default_rng(1).normal(size=1000)
    ours, theirs = wander.run(u=values), in_c.run(u=values)
    assert ours.y.tobytes() == theirs.y.tobytes() and ours.n.tolist() == theirs.n.tolist()
    assert [repr(i) for i in wander.items.values()] == [repr(i) for i in map(in_c.items.get, wander.items)]


def test_items_of_each_kind() -> None:
    tried = items.run(u=[1.0, 3.0], flag=[False, True], every="10 ms")
    assert tried.y.tolist() == [3.0, 3.0] and tried.time.tolist() == [0.0, 0.01] and tried.conditions == []
    assert items.run(u=[1.0, 3.0], flag=False).conditions == [(1, "high", None)]
    assert items.inputs["flag"].mode == "asynchronous" and items.inputs["u"].type == "float"


@pytest.mark.parametrize("i", [0, 3, 10**9])
def test_what_raises_in_python_is_a_fault(i: int) -> None:
    assert pick.run(i=[1, i], q=[1.0, 2.0, 3.0]).fault["invocation"] == 1


def _defined(path: Path, text: str) -> dict[str, Any]:
    path.write_text(text)
    space: dict[str, Any] = {"__name__": path.stem}
    exec(compile(text, str(path), "exec"), space)
    return space


@pytest.mark.parametrize("name", FAULTY)
def test_what_cannot_be_compiled_is_refused(name: str, tmp_path: Path) -> None:
    text, line, message, remedy = FAULTY[name]
    with pytest.raises(gpac.Error) as refused:
        _defined(tmp_path / "program.py", HEAD + text + "\n")
    assert re.search(message if "|" in message else re.escape(message), str(refused.value)), str(refused.value)
    assert remedy in refused.value.remedy and refused.value.remedy, str(refused.value)
    assert refused.value.place == (str(tmp_path / "program.py"), HEAD.count("\n") + line), str(refused.value)


def test_a_function_is_compiled_once_and_again_when_it_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENGPAC_COMPILED", str(tmp_path))
    compiled: list[str] = []
    really = compiling.compiled
    monkeypatch.setattr(compiling, "compiled", lambda *given: compiled.append(given[2]) or really(*given))
    text = HEAD + "def f(u: U, y: Y):\n    y = COUNT * u\n"
    for _ in range(2):
        assert _defined(tmp_path / "p.py", text)["f"].run(u=2.0).y == [6.0]
    assert len(compiled) == 1
    assert _defined(tmp_path / "p.py", text.replace("COUNT = 3", "COUNT = 4"))["f"].run(u=2.0).y == [8.0]
    assert len(compiled) == 2


def test_without_numba_one_line_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENGPAC_COMPILED", str(tmp_path))

    really = importlib.import_module

    def missing(name: str, *given: Any) -> Any:
        # Names of the package are loaded when they are first used, possibly below.
        if name.startswith("."):
            return really(name, *given)
        raise ModuleNotFoundError(f"No module named '{name}'", name=name)

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(gpac.DefinitionError, match=r"numba, which is not installed.*; run pip install 'opengpac\[numba\]'") as refused:
        _defined(tmp_path / "p.py", HEAD + "def f(u: U, y: Y):\n    y = u\n")
    assert "\n" not in str(refused.value)


def _gain(path: Path, by: str) -> gpac.PythonBlock[...]:
    return _defined(path, HEAD + f"def gain(u: U, y: Y):\n    y = {by} * u\n")["gain"]


def test_a_function_defined_again_redefines_the_block_once_no_instance_runs(tmp_path: Path) -> None:
    cell = gpac.System("cell", clock="virtual")
    cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
    u, y = cell.svv("u", initial=1.0), cell.svv("y")

    def verb(gain: gpac.PythonBlock[...]) -> gpac.Verb[..., Any]:
        return gpac.Verb("v", blocks={"gain": gain}, modes={"gain.u": "asynchronous"},
            instantiation_parameters={"u": "gain.u", "y": "gain.y"}, command_lists={"start": [activate("gain", every="1 ms")]})  # fmt: skip

    with verb(_gain(tmp_path / "p.py", "2.0")).asynch(u, y):
        again = _gain(tmp_path / "p.py", "3.0")
        cell.advance("5 ms")
        assert y.value == 2.0 and again.run(u=1.0).y == [3.0]
        with pytest.raises(gpac.InUse, match="halt 'v#1' first"):
            verb(again).new_instance(u, cell.svv("z"))
    with verb(again).asynch(u, y):
        cell.advance("5 ms")
        assert y.value == 3.0


def test_a_record_keeps_the_compiled_block(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENGPAC_COMPILED", str(tmp_path / "kept"))
    gain = _gain(tmp_path / "p.py", "0.3")
    cell = gpac.System("cell", clock="virtual")
    recording = cell.record(tmp_path / "run.mcap", replay=True)
    cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
    verb = gpac.Verb("v", blocks={"noise": lib.noise(seed=3), "gain": gain, "clock": lib.time_limit(limit=0.02)},
        cells={"u": ["noise.y", "gain.u"]}, instantiation_parameters={"y": "gain.y"},
        command_lists={"start": [activate("gain"), activate("noise", every="1 ms"), activate("clock", every="1 ms")]},
        conditions={"over": on("clock.expired", returns=[])})  # fmt: skip
    with cell:
        verb(cell.svv("y"))
        recording.stop()
    Path(gain.module).unlink()
    again = gpac.replay(tmp_path / "run.mcap", show=["y"], trust=True)
    assert again.difference is None and again.svvs["y"], again
