# SPDX-License-Identifier: Apache-2.0
"""Attacks on floating-point state: rounding, flushing to zero, traps, precision. Neither another block's value nor Python's arithmetic
changes; the culprit is named."""

from __future__ import annotations

import ctypes
import platform
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from mappings.mapping import MAPPINGS
from opengpac import activate, execute
from rig import Rig

ATTACKS = [
    "upward",
    "downward",
    "toward_zero",
    "flush_to_zero",
    "denormals_are_zero",
    "trap_division",
    "trap_all",
    "x87_precision",
    "x87_rounding",
    "x87_pending_trap",
    "environment",
    "mmx",
    "x87_stack",
]
HEALED = ["mmx", "x87_stack"]
"""Attacks that leave no control word changed: the state is restored, and no block is at fault."""
RETURNS, FAULTS, CRASHES, STAYS = range(4)
X86 = platform.machine() == "x86_64"
CHANGED = "changed the floating-point state of its thread"
CONSTRUCTOR = """#include <fenv.h>
#include <opengpac.h>
FUNCTION_BLOCK(quiet, "y = 1.", out(double, y, "out")) { self->y = 1.0; return OK; }
__attribute__((%s)) static void sets(void) { fesetround(FE_UPWARD); }
"""
FLUSHES = 'unsigned w = 0x9fc0; __asm__ volatile("ldmxcsr %%0" : : "m"(w))'
CPP = """#include <cfenv>
#include <opengpac.h>
struct Sets { ~Sets() { std::fesetround(FE_UPWARD); } };
FUNCTION_BLOCK(attack, "y = invocation number; rounds upward when the body is through.",
    out(double, y, "number"), param(double, at, 3, "when"))
{
    self->y = (double)invocation->number;
    if (self->y == self->at) { static thread_local int here; Sets sets; here += 1; }
    return OK;
}
"""


def words() -> bytes:
    """Returns the control words of this thread."""
    environment = ctypes.create_string_buffer(64)
    assert ctypes.CDLL(None).fegetenv(environment) == 0
    raw = environment.raw
    # On x86-64 this is the x87 control word, then MXCSR without its flags. On other machines it is the first word.
    return raw[:2] + bytes([raw[28] & 0xC0]) + raw[29:32] if X86 else raw[:4]


def arithmetic() -> tuple[Any, ...]:
    """Returns results that differ if any floating-point state is wrong."""
    one, ten, least = float("1"), float("10"), sys.float_info.min
    long_one = np.longdouble("1")
    return one / ten, -one / ten, least / 3.0, 5e-324 * 2.0**60, long_one / np.longdouble("3")


@pytest.fixture(autouse=True)
def python_is_as_it_was() -> Iterator[None]:
    """Checks Python's own arithmetic before and after each test."""
    before = arithmetic(), words()
    yield
    assert (arithmetic(), words()) == before


def attacking(rig: Rig, **constants: Any) -> gpac.Verb[..., Any]:
    """Returns a verb whose block attacks at invocation 3."""
    return gpac.Verb(
        "attacking",
        blocks={"bad": rig.block("floats.attack")(**constants)},
        instantiation_parameters={"y": "bad.y"},
        command_lists={"start": [activate("bad", every="1 ms")]},
    )


class Witness:
    """Verb that checks in each invocation whether arithmetic is normal."""

    def __init__(self, rig: Rig, name: str, source: gpac.Source) -> None:
        self.n, self.odd = rig.svvs(f"{name}_n", f"{name}_odd")
        verb = gpac.Verb(
            f"witness_{name}",
            blocks={"w": rig.block("witness.witness")},
            instantiation_parameters={"n": "w.n", "odd": "w.odd"},
            command_lists={"start": [activate("w", every="10 ms" if source is rig.slow else "1 ms")]},
        )
        self.instance = verb.on(source).asynch(self.n, self.odd)

    def counts(self) -> tuple[float, float]:
        """Returns the number of invocations, and of those in which something was odd."""
        return self.n.value, self.odd.value


@pytest.mark.parametrize("kind", range(len(ATTACKS)), ids=ATTACKS)
def test_no_other_value_changes(rig: Rig, kind: int) -> None:
    before = Witness(rig, "before", rig.fast)
    (y,) = rig.svvs("y")
    attacker = attacking(rig, kind=kind).on(rig.fast).asynch(y)
    after, beside = Witness(rig, "after", rig.fast), Witness(rig, "beside", rig.slow)
    if ATTACKS[kind] in HEALED:
        rig.cell.advance("10 ms")
        attacker.halt()
    else:
        with pytest.raises(gpac.Terminated, match=rf"'bad' \(floats\.attack\) {CHANGED}") as caught:
            attacker.wait(timeout="1 s")
        assert (caught.value.condition, caught.value.block) == ("fault", "bad")
        assert y.value == 2, "a fault leaves everything as it was"
    ran = before.n.value
    rig.cell.advance("20 ms")
    assert before.n.value == ran + 20, "the others run on"
    assert [witness.odd.value for witness in (before, after, beside)] == [0, 0, 0]


@pytest.mark.parametrize("then", [FAULTS, CRASHES, STAYS], ids=["faults", "crashes", "never_ends"])
def test_who_attacks_and_fails_besides_changes_nothing(memory_rig: Rig, then: int) -> None:
    rig = memory_rig
    doomed = rig.rtp.timer("doomed", period="1 ms", priority=50)
    beside, before = Witness(rig, "beside", rig.fast), Witness(rig, "before", doomed)
    (y,) = rig.svvs("y")
    with pytest.raises(gpac.Terminated) as caught:
        attacking(rig, then=then).on(doomed)(y, time_limit="10 s")
    assert (caught.value.condition, caught.value.block, y.value) == ("fault", "bad", 2)
    rig.cell.advance("10 ms")
    assert beside.odd.value == before.odd.value == 0
    rig.cell.reset()
    rig.cell.download(rig.built["floats"], "floats")
    assert Witness(rig, "again", doomed).odd.value == 0


@pytest.mark.parametrize("mapping", ["threads", "processes"])
def test_it_is_so_in_real_time(built: dict[str, str], mapping: str) -> None:
    with MAPPINGS[mapping].open("cell") as cell:
        rig = Rig(cell, built)
        (y,) = rig.svvs("y")
        before = Witness(rig, "before", rig.fast)
        with pytest.raises(gpac.Terminated, match=CHANGED):
            attacking(rig, kind=1).on(rig.fast)(y, time_limit="60 s")
        after = Witness(rig, "after", rig.fast)
        rig.until(lambda: after.n.value > 20, "the source fires on")
        assert (before.odd.value, after.odd.value) == (0, 0)


def test_an_executed_block_changes_nothing(rig: Rig) -> None:
    witness = Witness(rig, "beside", rig.fast)
    verb = gpac.Verb(
        "executing",
        blocks={"bad": rig.block("floats.attack")(at=0.0), "good": rig.block("witness.witness")},
        instantiation_parameters={"y": "bad.y", "n": "good.n", "odd": "good.odd"},
        command_lists={"start": [execute("bad"), activate("good", every="1 ms")]},
    )
    (y,) = rig.svvs("y")
    n, odd = rig.svvs("n", "odd")
    with pytest.raises(gpac.Terminated, match=CHANGED):
        verb.on(rig.fast)(y, n, odd, time_limit="1 s")
    rig.cell.advance("10 ms")
    assert (witness.odd.value, odd.value) == (0, 0)


def test_a_block_in_cpp_changes_nothing(memory_rig: Rig, tmp_path: Path) -> None:
    rig = memory_rig
    (tmp_path / "sets.cpp").write_text(CPP)
    code = rig.cell.download(tmp_path / "sets.cpp")
    (y,) = rig.svvs("y")
    verb = gpac.Verb(
        "attacking",
        blocks={"bad": code.attack},
        instantiation_parameters={"y": "bad.y"},
        command_lists={"start": [activate("bad", every="1 ms")]},
    )
    instance, witness = verb.on(rig.fast).asynch(y), Witness(rig, "after", rig.fast)
    with pytest.raises(gpac.Terminated, match=CHANGED):
        instance.wait(timeout="1 s")
    rig.cell.advance("10 ms")
    assert witness.odd.value == 0


def test_what_nobody_could_see_stops_the_source_before_it_publishes(memory_rig: Rig) -> None:
    rig = memory_rig
    doomed = rig.rtp.timer("doomed", period="1 ms", priority=50)
    (y,) = rig.svvs("y")

    def unseen() -> gpac.VerbInstance[Any]:
        verb = gpac.Verb(
            "unseen",
            blocks={"bad": rig.block("unseen.attack")},
            instantiation_parameters={"y": "bad.y"},
            command_lists={"start": [activate("bad", every="1 ms")]},
        )
        return verb.on(doomed).asynch(y)

    attacker, witness = unseen(), Witness(rig, "after", doomed)
    published, odd = rig.svvs("published", "odd")
    rig.sampling("reads").on(rig.fast).asynch(y, published)
    rig.sampling("reads_odd").on(rig.fast).asynch(witness.odd, odd)
    with pytest.raises(gpac.Terminated, match=r"one of the blocks 'bad' \(unseen\.attack\) of 'unseen#1', 'w' .* changed the"):
        attacker.wait(timeout="1 s")
    rig.cell.advance("5 ms")
    assert (published.value, odd.value) == (2, 0), "nothing of that firing was published"
    assert rig.cell.statistics["sources"][doomed.name]["stopped"]
    rig.cell.reset()
    attacker, witness = unseen(), Witness(rig, "again", doomed)
    with pytest.raises(gpac.Terminated, match=rf"block 'bad' \(unseen\.attack\) {CHANGED}") as caught:
        attacker.wait(timeout="1 s")
    rig.cell.advance("5 ms")
    assert caught.value.block == "bad", "from now on each block is looked at"
    assert witness.odd.value == 0 and not rig.cell.statistics["sources"][doomed.name]["stopped"]


@pytest.mark.parametrize("how", ["constructor", "fast_math", "destructor"])
def test_a_module_that_sets_something_when_it_is_loaded(memory_rig: Rig, tmp_path: Path, how: str) -> None:
    rig = memory_rig
    before = Witness(rig, "before", rig.fast)
    # -ffast-math links a constructor that sets flushing to zero.
    text = CONSTRUCTOR.replace("fesetround(FE_UPWARD)", FLUSHES) if how == "fast_math" else CONSTRUCTOR
    text = text % ("destructor" if how == "destructor" else "constructor")
    (tmp_path / "fast.c").write_text(text)
    if how == "destructor":
        code = rig.cell.download(tmp_path / "fast.c")
    else:
        with pytest.warns(RuntimeWarning, match="code module 'fast' changed the floating-point state of the thread that loaded it"):
            code = rig.cell.download(tmp_path / "fast.c")
        assert any(entry["kind"] == "module" and entry["about"] == "fast" for entry in rig.cell.log())
    (y,) = rig.svvs("y")
    gpac.Verb(
        "quiet", blocks={"q": code.quiet}, instantiation_parameters={"y": "q.y"}, command_lists={"start": [activate("q", every="1 ms")]}
    ).on(rig.fast).asynch(y)
    later = Witness(rig, "later", rig.rtp.timer("later", period="1 ms", priority=40))
    rig.cell.advance("10 ms")
    assert (y.value, before.odd.value, later.odd.value) == (1.0, 0, 0)
    rig.cell.close()


@pytest.mark.parametrize("kind", [kind for kind, name in enumerate(ATTACKS) if name not in HEALED])
def test_a_trial_changes_nothing_and_says_so(memory_rig: Rig, kind: int) -> None:
    tried = memory_rig.block("floats.attack").run(10, kind=kind)
    assert tried.fault is not None and CHANGED in tried.fault["text"]
    assert list(memory_rig.block("witness.witness").run(5).odd) == [0] * 5


def test_blocks_compute_alike_whatever_python_has_set(memory_rig: Rig) -> None:
    rig, libm = memory_rig, ctypes.CDLL("libm.so.6")
    witness = Witness(rig, "inside", rig.fast)
    upward = 0x800 if X86 else 0x400000
    assert libm.fesetround(upward) == 0
    try:
        rig.cell.advance("10 ms")
        assert libm.fegetround() == upward, "what the program has set stays"
    finally:
        libm.fesetround(0)
    assert witness.counts() == (10, 0)
