# SPDX-License-Identifier: Apache-2.0
"""Blocks that end in library code, or that end their process or thread: a fault if it can be contained, otherwise `processor_lost` or a
message."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import opengpac as gpac
from afar import Afar
from opengpac import activate
from rig import Rig

pytestmark = pytest.mark.alone

FAILS = """
#include <opengpac.h>
#include <cassert>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <pthread.h>
#include <stdexcept>
#include <unistd.h>
static int nothing_leaves(double y) noexcept { if (y >= 3) throw std::runtime_error("it left"); return 0; }
#define FAILING(NAME, ...) FUNCTION_BLOCK(NAME, "Fails at invocation 3.", out(double, y, "number of the invocation")) \\
    { self->y = (double)invocation->number; if (invocation->number >= 3) { __VA_ARGS__ } return OK; }
FAILING(aborts, abort();)
FAILING(asserts, assert(self->y < 3);)
FAILING(terminates, nothing_leaves(self->y);)
FAILING(measures_nothing, const char *volatile text = nullptr; self->y = (double)strlen(text);)
FAILING(allocates, for (;;) { char *volatile memory = new char[100]; delete[] memory; })
FAILING(waits, int ends[2]; char byte; if (pipe(ends) == 0 && read(ends[0], &byte, 1) == 1) return OK;)
FAILING(masks, sigset_t all; sigfillset(&all); sigprocmask(SIG_SETMASK, &all, nullptr); for (volatile int on = 1; on;) {})
FAILING(exits, exit(0);)
FAILING(leaves, pthread_exit(nullptr);)
"""
SAID = {
    "aborts": "abort()",
    "asserts": "SIGABRT",
    "terminates": "std::terminate()",
    "measures_nothing": "segmentation fault",
    "allocates": "used up its time budget",
}


@pytest.fixture(scope="module")
def fails(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Returns a C++ module whose blocks fail."""
    source = tmp_path_factory.mktemp("fails") / "fails.cpp"
    source.write_text(FAILS)
    return gpac._native.build([str(source)], str(source.with_suffix(".so")))


def failing(block: gpac.Block) -> gpac.Verb[..., object]:
    return gpac.Verb(
        "failing",
        blocks={"bad": block},
        instantiation_parameters={"y": "bad.y"},
        command_lists={"start": [activate("bad", every="2 ms", budget="500 ms")]},
    )


@pytest.mark.parametrize("name", SAID)
def test_what_ends_itself_or_is_ended_in_a_library_is_a_fault_of_its_block(memory_rig: Rig, fails: str, name: str) -> None:
    block, (good, bad) = memory_rig.cell.download(fails)[name], memory_rig.svvs("good", "bad")
    memory_rig.counting().on(memory_rig.fast).asynch(good)
    doomed = memory_rig.rtp.timer("doomed", period="1 ms", priority=50)
    with pytest.raises(gpac.Terminated) as caught:
        failing(block).on(doomed)(bad, time_limit="10 s")
    assert (caught.value.condition, caught.value.block) == ("fault", "bad")
    assert SAID[name] in str(caught.value)
    before = good.value
    memory_rig.cell.advance("10 ms")
    assert good.value == before + 10, "the other sources run on"
    assert bad.value == 2, "nothing of the invocation that failed is stored"


@pytest.mark.parametrize("name", ["aborts", "terminates", "measures_nothing"])
def test_a_trial_has_the_same_guard(memory_rig: Rig, fails: str, name: str) -> None:
    tried = memory_rig.cell.download(fails)[name].run(10)
    assert tried.fault["invocation"] == 3 and SAID[name] in tried.fault["text"]


@pytest.mark.parametrize("name", ["aborts", "allocates"])
def test_a_process_of_its_own_contains_the_same(afar: Afar, fails: str, name: str) -> None:
    process = afar.process()
    with pytest.raises(gpac.Terminated) as caught:
        failing(afar.cell.download(fails)[name]).on(afar.there)(afar.cell.svv("y"), time_limit="60 s")
    assert (caught.value.condition, caught.value.block) == ("fault", "bad")
    assert afar.process() == process, "the process is the same"


@pytest.mark.parametrize("name", ["waits", "masks"])
def test_a_process_whose_block_cannot_be_ended_ends_itself(afar: Afar, fails: str, name: str) -> None:
    near, process = afar.cell.svv("near"), afar.process()
    afar.counting().on(afar.here).asynch(near)
    with pytest.raises(gpac.Terminated, match=r"has ended itself.*it was running block 'bad' of 'failing#1'") as caught:
        failing(afar.cell.download(fails)[name]).on(afar.there)(afar.cell.svv("y"), time_limit="60 s")
    assert caught.value.condition == "processor_lost"
    afar.goes_on(near)
    afar.cell.reset()
    assert afar.process() != process
    assert afar.counting("again").on(afar.there)(afar.cell.svv("again"), limit=5, time_limit="60 s").last == 5


PROGRAM = """
import sys
import opengpac as gpac
from opengpac import activate

cell = gpac.System("cell", progress=False)
doomed, other = cell.processor("rtp0").timer("doomed", period="2 ms"), cell.processor("rtp1").timer("other", period="2 ms")
module = cell.download(sys.argv[1])
def verb(name):
    lists = {"start": [activate("bad", every="2 ms", budget="20 ms")]}
    return gpac.Verb(name, blocks={"bad": module[name]}, instantiation_parameters={"y": "bad.y"}, command_lists=lists)
bad, y = verb(sys.argv[2]).on(doomed).new_instance(cell.svv("y")), None
bad.start()
"""
IS_LOST = """
try:
    bad.wait(timeout="60 s")
except gpac.Terminated as end:
    print(end.condition, end.block, "that cannot be" if "start this program again" not in str(end) else "start again")
bad.delete()
cell.reset()
module = cell.download(sys.argv[1])
again = verb("allocates").on(doomed).new_instance(cell.svv("z"))
try:
    again.start()
except gpac.InvalidState as refused:
    print("refused:", "start this program again" in str(refused))
elsewhere = verb("allocates").on(other).new_instance(cell.svv("w"))
elsewhere.start()
try:
    elsewhere.wait(timeout="60 s")
except gpac.Terminated as end:
    print(end.condition, end.block)
cell.close()
print("closed")
"""
IS_DEAF = """
try:
    bad.wait(timeout="60 s")
except gpac.Terminated as end:
    print(end.condition, end.message)
cell.close()
print("closed")
"""


def program(rest: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", PROGRAM + rest, *arguments], capture_output=True, text=True, timeout=120, check=False)


def test_on_threads_a_source_that_cannot_be_trusted_ends_for_good_and_the_program_ends(fails: str) -> None:
    ended = program(IS_LOST, fails, "waits")
    assert ended.stdout.split("\n") == ["fault bad start again", "refused: True", "fault bad", "closed", ""], ended.stderr
    assert ended.returncode == 0


def test_on_threads_verbs_of_a_block_that_masks_every_signal_end_and_the_program_ends(fails: str) -> None:
    ended = program(IS_DEAF, fails, "masks")
    assert ended.stdout.startswith("processor_lost "), ended.stdout + ended.stderr
    assert "a block on source 'rtp0.doomed' does not return and has masked every signal" in ended.stdout, ended.stderr
    assert ended.stdout.endswith("closed\n") and ended.returncode == 0


def test_on_threads_a_block_that_ends_its_thread_is_a_fault_and_the_program_ends(fails: str) -> None:
    ended = program(IS_DEAF, fails, "leaves")
    # The C library calls abort() if C++ has caught the exception that unwinds the thread.
    assert ended.stdout.startswith("fault ") and "start this program again" in ended.stdout, ended.stdout + ended.stderr
    assert ended.stdout.endswith("closed\n") and ended.returncode == 0


def test_no_block_ends_the_program_without_a_word(fails: str) -> None:
    ended = program("bad.wait()\n", fails, "exits")
    assert "was ended by exit() while a block ran on interrupt source" in ended.stderr, Path(fails)
