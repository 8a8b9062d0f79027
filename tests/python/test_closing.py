# SPDX-License-Identifier: Apache-2.0
"""The summary of `make test` names the failures and their reasons."""

from __future__ import annotations

import importlib.util
import os
import signal
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from afar import until

CARGO = """
running 2 tests
gate::opens --- FAILED
.
failures:

---- gate::opens stdout ----

thread 'gate::opens' panicked at tests/gate.rs:7:9:
it stays shut


failures:
    gate::opens

test result: FAILED. 1 passed; 1 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.01s

running 3 tests
...
test result: ok. 3 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.01s
"""

PYTEST = """
=================================== FAILURES ===================================
_______________________________ test_it_opens[2] _______________________________
[gw1] linux -- Python 3.11.7

    def test_it_opens(n):
>       assert n == 1
E       assert 2 == 1
_________________________________ test_it_shuts ________________________________
E       OSError: broken
=========================== short test summary info ============================
FAILED tests/test_gate.py::test_it_opens[2] - assert 2 == 1
FAILED tests/test_gate.py::test_it_shuts - OSError: broken
========================= 2 failed, 40 passed in 3.21s =========================
"""


def loaded(name: str) -> ModuleType:
    """Returns a program of `tests` as a module."""
    spec = importlib.util.spec_from_file_location(name, Path(__file__).parent.parent / f"{name}.py")
    assert spec is not None and spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


@pytest.fixture(scope="module")
def program() -> ModuleType:
    """Returns `tests/closing.py` as a module."""
    return loaded("closing")


def test_what_cargo_ran_is_counted_and_what_failed_is_told(program: ModuleType) -> None:
    said = [*program.closing(CARGO)]
    assert said[0] == "---- gate::opens" and "it stays shut" in said
    assert said[-1] == "4 passed; 1 failed"


def test_what_pytest_ran_is_counted_and_what_failed_is_told(program: ModuleType) -> None:
    said = [*program.closing(f"\x1b[31m{PYTEST}\x1b[0m")]
    assert said[0] == "---- test_it_opens[2]" and "E       assert 2 == 1" in said
    assert "---- test_it_shuts" in said and "E       OSError: broken" in said
    assert said[-3:] == [
        "FAILED tests/test_gate.py::test_it_opens[2] - assert 2 == 1",
        "FAILED tests/test_gate.py::test_it_shuts - OSError: broken",
        "2 failed, 40 passed in 3.21s",
    ]


def test_of_a_long_output_its_end_is_shown(program: ModuleType) -> None:
    text = "---- long stdout ----\n" + "\n".join(map(str, range(1000))) + "\n\nfailures:\n"
    assert [*program.closing(text)] == ["---- long", *map(str, range(1000 - program.LINES_MAX, 1000))]


def test_a_logged_command_is_over_with_its_end_whatever_it_leaves_behind(tmp_path: Path) -> None:
    left, log = tmp_path / "left", tmp_path / "log"
    command = ["sh", "-c", f"sleep 1000 & echo $! >{left}; echo said; exit 3"]
    logged = Path(__file__).parent.parent / "logged.py"
    try:
        done = subprocess.run([sys.executable, str(logged), str(log), *command], stdout=subprocess.PIPE, text=True, check=False)
        assert (done.returncode, done.stdout, log.read_text()) == (3, "said\n", "said\n")
    finally:
        os.kill(int(left.read_text()), signal.SIGKILL)


SLOW = [
    {"test": "tests/test_gate.py::test_it_shuts", "lasted_s": 0.5, "processor_s": 0.46, "alone": False},
    {"test": "tests/test_gate.py::test_it_opens[a b]", "lasted_s": 12.34, "processor_s": 0.02, "alone": False},
]


def test_the_longest_tests_are_named(program: ModuleType) -> None:
    long, short = "   12.3 s  tests/test_gate.py::test_it_opens[a b]", "    0.5 s  tests/test_gate.py::test_it_shuts"
    assert [*program.longest(SLOW, "lasted_s")] == [long, short]
    assert next(program.longest(SLOW, "processor_s")) == short
    assert len([*program.longest(SLOW * 20, "lasted_s")]) == program.LONGEST


def test_a_strand_is_noted_counted_and_drawn(program: ModuleType, tmp_path: Path) -> None:
    notes = tmp_path / "new" / "strands.jsonl"
    strand = loaded("strand")
    before = signal.getsignal(signal.SIGTERM)
    try:
        assert strand.run(notes, "quick", ["true"]) == 0
        assert strand.run(notes, "broken", ["sh", "-c", "exit 3"]) == 3
        assert strand.run(notes, "killed", ["sh", "-c", "kill -9 $$"]) == 128 + 9
    finally:
        signal.signal(signal.SIGTERM, before)
    lines = [*program.strands(program.noted(notes))]
    assert [line.split("time  ")[1] for line in lines] == ["quick", "broken  failed", "killed  failed", "in all"]
    program.draw(program.noted(notes), tmp_path / "strands.svg")
    assert "broken" in (tmp_path / "strands.svg").read_text()
    assert program.noted(tmp_path / "nothing") == [] and [*program.strands([])] == []


def test_ending_a_strand_ends_its_command(tmp_path: Path) -> None:
    begun = tmp_path / "begun"
    program = Path(__file__).parent.parent / "strand.py"
    command = [sys.executable, program, tmp_path / "notes", "long", "sh", "-c", f"echo $$ >{begun}; exec sleep 1000"]
    with subprocess.Popen(command) as process:
        until(lambda: begun.exists() and begun.read_text().strip(), "the command has begun")
        process.terminate()
        assert process.wait() == 128 + signal.SIGTERM
    with pytest.raises(ProcessLookupError):
        os.kill(int(begun.read_text()), 0)
