# SPDX-License-Identifier: Apache-2.0
"""A trial of a block, `block.run(…)`, under the same protection as firings; and C++ exceptions, which are faults of their block
everywhere."""

from __future__ import annotations

import os
import signal
import threading
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from opengpac import activate
from rig import Rig

SAID = {"divides": "division by zero", "null_pointer": "segmentation fault", "endless": "time budget", "traps": "illegal instruction"}

MORE = """
#include <opengpac.h>
FUNCTION_BLOCK(traps, "Ends with an illegal instruction.", out(double, y, "number"), param(double, at, 3, "when"))
{ if ((double)invocation->number >= self->at) __builtin_trap(); self->y = (double)invocation->number; return OK; }
"""

THROWER = """
#include <opengpac.h>
#include <stdexcept>
#include <string>
#include <vector>
FUNCTION_BLOCK(throws, "Throws at invocation 3.", out(double, y, "number"), param(double, how, 0, "which"))
{
    std::vector<double> values(3, (double)invocation->number);
    if (self->how == 1 && invocation->number == 3) throw 42;
    if (self->how == 2 && invocation->number == 3) throw std::runtime_error(std::string(1000, 'x'));
    self->y = values.at(invocation->number);
    return OK;
}
"""


@pytest.fixture(scope="module")
def thrower(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Returns a C++ module whose block throws."""
    source = tmp_path_factory.mktemp("thrower") / "thrower.cpp"
    source.write_text(THROWER)
    return gpac._native.build([str(source)], str(source.with_suffix(".so")))


@pytest.fixture
def more(tmp_path: Path) -> str:
    """Returns a module with one more fault, in C."""
    source = tmp_path / "more.c"
    source.write_text(MORE)
    return str(source)


@pytest.mark.parametrize("name", SAID)
def test_what_a_block_on_trial_does_wrong_is_its_fault(memory_rig: Rig, more: str, name: str) -> None:
    (y,) = memory_rig.svvs("y")
    running = memory_rig.counting().on(memory_rig.fast).asynch(y)
    memory_rig.cell.advance("5 ms")
    block = memory_rig.cell.download(more)[name] if name == "traps" else memory_rig.block(f"faults.{name}")
    tried = block.run(10)
    assert tried.fault["invocation"] == 3 and SAID[name] in tried.fault["text"]
    assert len(tried.y) == 3, "what came before the fault is there"
    before = y.value
    memory_rig.cell.advance("5 ms")
    assert running.state == "running" and y.value == before + 5, "what runs runs on"
    assert block.run(2).fault is None, "it can be tried again"


def test_ctrl_c_ends_a_trial_between_its_invocations(memory_rig: Rig) -> None:
    block = memory_rig.block("count.count")
    tried = threading.Event()

    def press() -> None:
        tried.wait()
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=press).start()
    with pytest.raises(KeyboardInterrupt):
        # The other thread continues when the trial releases the interpreter.
        tried.set()
        block.run(9_000_000)


def throwing(block: gpac.Block, **constants: Any) -> gpac.Verb[..., Any]:
    return gpac.Verb(
        "throwing",
        blocks={"bad": block(**constants)},
        instantiation_parameters={"y": "bad.y"},
        command_lists={"start": [activate("bad", every="1 ms")]},
    )


def test_a_cpp_exception_is_a_fault_with_what_it_says(rig: Rig, thrower: str) -> None:
    good, bad = rig.svvs("good", "bad")
    rig.counting().on(rig.fast).asynch(good)
    block = rig.cell.download(thrower).throws
    with pytest.raises(gpac.Terminated) as caught:
        throwing(block).on(rig.fast)(bad, time_limit="1 s")
    assert (caught.value.condition, caught.value.block) == ("fault", "bad")
    assert "threw an exception: vector::_M_range_check" in str(caught.value)
    before = good.value
    rig.cell.advance("10 ms")
    assert good.value == before + 10, "the other verb runs on in the same source"
    assert not rig.cell.statistics["sources"][rig.fast.name]["stopped"]
    assert bad.value == 2, "nothing of the invocation that threw is stored"


def test_what_a_cpp_exception_says_is_bounded_and_may_be_nothing(memory_rig: Rig, thrower: str) -> None:
    block = memory_rig.cell.download(thrower).throws
    assert "it is not a std::exception" in block.run(10, how=1).fault["text"]
    assert block.run(10, how=2).fault["text"].endswith("x" * 200)
    assert "range_check" in block.run(10).fault["text"] and "xx" not in block.run(10).fault["text"]


def test_a_cpp_exception_in_a_process_of_its_own_says_the_same(thrower: str) -> None:
    with gpac.System("apart") as cell:
        away = cell.processor("away", process=True).timer("away", period="1 ms")
        block = cell.download(thrower).throws
        with pytest.raises(gpac.Terminated, match=r"threw an exception: vector::_M_range_check"):
            throwing(block).on(away)(cell.svv("y"), time_limit="60 s")
