# SPDX-License-Identifier: Apache-2.0
"""Tracebacks of refusals end at the user's own line, wherever they are shown; `OPENGPAC_TRACEBACK=full` shows every frame."""

from __future__ import annotations

import functools
import os
import re
import subprocess
import sys
import threading
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

import opengpac as gpac
from opengpac.refusals import tracebacks

PACKAGE = str(Path(gpac.__file__).parent)

PROGRAM = """import opengpac as gpac

def configure(cell):
    cell.svv("level", "float")
    cell.svv("level", "double")

with gpac.System("cell", clock="virtual") as cell:
    configure(cell)
"""

CAUSE = """import opengpac as gpac

with gpac.System("cell", clock="virtual") as cell:
    try:
        cell.svv("level", "no_type")
    except gpac.Error as why:
        raise RuntimeError("the program's own") from why
"""

IN_A_THREAD = """import threading
import opengpac as gpac

with gpac.System("cell", clock="virtual") as cell:
    thread = threading.Thread(target=lambda: cell.svv("level", "no_type"))
    thread.start()
    thread.join()
"""

CALLBACK = """import opengpac as gpac

def asked():
    return 1 / 0

def refused():
    return cell.svv("level", "no_type")

with gpac.System("cell", clock="virtual") as cell:
    cell.processor("rtp0").timer("fast", period="1 ms")
    cell.advance(until=CALLED, within="1 s")
"""


@pytest.fixture(autouse=True)
def _as_a_user(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OPENGPAC_TRACEBACK", raising=False)


def told(folder: Path, text: str, *words: str, **environment: str) -> str:
    """Returns the output of a program that ends by an exception."""
    program = folder / "program.py"
    program.write_text(text)
    run = subprocess.run(
        [sys.executable, *words, str(program)],
        capture_output=True, text=True, env={**os.environ, **environment}, input="q\n", cwd=folder,
    )  # fmt: skip
    return run.stderr + run.stdout


def lines_of(told: str, file: str) -> list[int]:
    """Returns the lines of a file that a traceback names, outermost first."""
    return [int(line) for found, line in re.findall(r'File "([^"]+)", line (\d+)', told) if found.endswith(file)]


def test_traceback_of_a_refusal_ends_at_the_line_of_the_program(tmp_path: Path) -> None:
    text = told(tmp_path, PROGRAM)
    assert lines_of(text, "program.py") == [8, 5]
    assert PACKAGE not in text
    assert text.splitlines()[-1].startswith("opengpac.errors.InUse: an SVV 'level' already exists")


def test_every_frame_is_shown_where_the_user_asks(tmp_path: Path) -> None:
    text = told(tmp_path, PROGRAM, OPENGPAC_TRACEBACK="full")
    assert lines_of(text, "program.py") == [8, 5]
    assert len(re.findall(re.escape(PACKAGE), text)) >= 2


def test_command_run_shows_the_traceback_where_the_user_asks(tmp_path: Path) -> None:
    assert "Traceback" not in told(tmp_path, PROGRAM, "-m", "opengpac", "run")
    assert PACKAGE in told(tmp_path, PROGRAM, "-m", "opengpac", "run", OPENGPAC_TRACEBACK="full")


def test_refusal_that_is_a_cause_stays_and_is_short(tmp_path: Path) -> None:
    text = told(tmp_path, CAUSE)
    assert lines_of(text, "program.py") == [5, 7]
    assert "the direct cause of the following exception" in text
    assert PACKAGE not in text


def test_refusal_in_a_thread_ends_at_the_line_of_the_program(tmp_path: Path) -> None:
    text = told(tmp_path, IN_A_THREAD)
    assert lines_of(text, "program.py") == [5]
    assert lines_of(text, "threading.py"), "the frames that start the thread stay: they call the program"
    assert PACKAGE not in text


def test_refusal_in_a_function_that_the_package_calls_keeps_the_frames_on_both_sides(tmp_path: Path) -> None:
    text = told(tmp_path, CALLBACK.replace("CALLED", "refused"))
    assert lines_of(text, "program.py") == [11, 7]
    assert PACKAGE not in text


def test_exception_of_python_keeps_every_frame(tmp_path: Path) -> None:
    text = told(tmp_path, CALLBACK.replace("CALLED", "asked"))
    assert lines_of(text, "program.py") == [11, 4]
    assert "ZeroDivisionError" in text
    assert PACKAGE in text


def test_debugger_stops_where_the_error_was_raised(tmp_path: Path) -> None:
    text = told(tmp_path, PROGRAM, "-m", "pdb", "-c", "continue", "-c", "where", "-c", "q")
    assert f"{PACKAGE}/errors.py" in text


def test_hooks_of_others_are_called(tmp_path: Path) -> None:
    before = "import sys\nsys.excepthook = lambda kind, error, trace: print('shown by', kind.__name__)\n"
    assert "shown by InUse" in told(tmp_path, before + PROGRAM)


CELL = """import opengpac as gpac
cell = gpac.System("cell", clock="virtual")
def configure():
    cell.svv("level", "no_type")
"""


def in_a_notebook(*, full: bool) -> str:
    """Returns the output of a cell that ends by a refusal."""
    cells = [nbformat.v4.new_code_cell(text) for text in ("%env OPENGPAC_TRACEBACK=" + ("full" if full else ""), CELL, "configure()")]
    notebook = nbformat.v4.new_notebook(cells=cells)
    with pytest.raises(CellExecutionError):
        NotebookClient(notebook, kernel_name="python3", timeout=None).execute()
    (output,) = [output for output in notebook.cells[2].outputs if output.output_type == "error"]
    assert output.ename == "DefinitionError"
    return re.sub(r"\x1b\[[\d;]*m", "", "\n".join(output.traceback))


def test_cell_of_a_notebook_shows_only_its_own_lines() -> None:
    short = in_a_notebook(full=False)
    assert "cell.svv(" in short and "configure()" in short
    assert "DefinitionError: " in short.splitlines()[-1]
    assert "errors.py" not in short
    assert "errors.py" in in_a_notebook(full=True)


TEST_FILE = """
import opengpac as gpac

def test_of_a_user(cell):
    level = "no_type"
    cell.svv("level", level)
"""


def test_pytest_ends_at_the_line_of_the_test(tmp_path: Path) -> None:
    words = ("-m", "pytest", "-p", "opengpac.pytest_plugin", "-p", "no:cacheprovider", "--color=no")
    text = told(tmp_path, TEST_FILE, *words)
    assert re.search(r"^>\s+cell\.svv\(\"level\", level\)$", text, re.MULTILINE), "the rewritten test's own source"
    assert "errors.py" not in text and "system.py" not in text
    assert "errors.py" in told(tmp_path, TEST_FILE, *words, "--full-trace")


def test_traceback_without_a_frame_of_the_user_stays_whole() -> None:
    try:
        gpac.library.get(3.5)  # type: ignore[arg-type]
    except Exception as error:
        trace = error.__traceback__
    assert trace is not None and trace.tb_next is not None
    assert tracebacks.users(trace.tb_next) is trace.tb_next


def test_python_s_own_frames_stay_where_they_call_the_user_and_go_where_they_call_the_package(cell: gpac.System) -> None:
    def refused() -> None:
        functools.reduce(lambda name, kind: cell.svv(name, kind), ["level", "no_type"])

    caught: list[gpac.Error] = []

    def run() -> None:
        try:
            threading.Timer(0, refused).function()
        except gpac.Error as error:
            caught.append(error)

    run()
    tracebacks.shorten(caught[0])
    trace, names = caught[0].__traceback__, []
    while trace is not None:
        names.append(trace.tb_frame.f_code.co_name)
        trace = trace.tb_next
    assert names == ["run", "refused", "<lambda>"]


def test_installing_twice_changes_nothing(tmp_path: Path) -> None:
    program = (
        "import sys\nfrom opengpac.refusals import tracebacks\nhook = sys.excepthook\ntracebacks.install()\nprint(hook is sys.excepthook)\n"
    )
    assert told(tmp_path, program) == "True\n"
