# SPDX-License-Identifier: Apache-2.0
"""The C code of policies under the C compiler's sanitizers: no access beyond an array, no overflow, nothing undefined, no allocation,
and the same numbers as in the system."""

from __future__ import annotations

import subprocess
import sys
from datetime import date
from pathlib import Path

import numpy as np
import onnx
import pytest

import opengpac as gpac
from policies.test_nodes import ALL, Case, by_opset, joined

SANITIZERS = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer"]
COUNTED = "-Wl,--wrap=malloc,--wrap=calloc,--wrap=realloc"
A_DAY = 12
"""Number of nodes of one opset per day, because sanitizers slow the compiler down; `make faults` tries all."""
DRIVEN = Path(__file__).parent / "driven.c"

KEEPING = """#!{python}
import os, shutil, sys
arguments = sys.argv[1:]
for at, argument in enumerate(arguments):
    if argument.endswith(".c"):
        shutil.copy(argument, {kept!r})
    if argument == "-I":
        shutil.copy(os.path.join(arguments[at + 1], "opengpac.h"), os.path.dirname({kept!r}))
os.execvp("cc", ["cc", *arguments])
"""


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Returns the folder that keeps the C text of further compilations, with its header."""
    text, compiler = tmp_path / "text.c", tmp_path / "cc"
    compiler.write_text(KEEPING.format(python=sys.executable, kept=str(text)))
    compiler.chmod(0o700)
    monkeypatch.setenv("CC", str(compiler))
    return text


def driven(text: Path, given: np.ndarray, more: str = "") -> np.ndarray:
    """Returns the outputs of the block of that C text for rows of inputs, under the sanitizers."""
    whole, program = text.with_name("whole.c"), text.with_name("whole")
    whole.write_text(text.read_text() + more + DRIVEN.read_text())
    flags = ["-std=gnu11", "-O1", "-g", "-w", *SANITIZERS, COUNTED]
    subprocess.run(["cc", *flags, "-I", text.parent, whole, "-o", program, "-lm"], check=True)
    done = subprocess.run([program, str(len(given))], input=given.tobytes(), capture_output=True)
    assert done.returncode == 0, done.stderr.decode()[:2000]
    return np.frombuffer(done.stdout).reshape(len(given), -1)


def parts(groups: dict[int, list[Case]], day: int) -> dict[int, list[Case]]:
    """Returns the nodes that are tried on that day, by opset."""
    if ALL:
        return groups
    turn, opset = divmod(day, len(groups))
    group = groups[sorted(groups)[opset]]
    return {sorted(groups)[opset]: group[turn % max(1, len(group) // A_DAY) :: max(1, len(group) // A_DAY)]}


def test_every_node_has_its_day() -> None:
    groups = by_opset()
    tried = {case.name for day in range(300) for group in parts(groups, day).values() for case in group}
    assert tried == {case.name for group in groups.values() for case in group}


def test_the_nodes_of_every_operator(tmp_path: Path, kept: Path) -> None:
    for opset, group in parts(by_opset(), date.today().toordinal()).items():
        model, given = joined(group, opset)
        onnx.save(model, tmp_path / f"sanitized_{opset}.onnx")
        rows = given[None, :].astype(float)
        found = gpac.policy(tmp_path / f"sanitized_{opset}.onnx").run(x=rows)
        np.testing.assert_array_equal(driven(kept, rows), np.asarray(found.y))


def test_an_access_beyond_an_array_is_seen(tmp_path: Path, kept: Path) -> None:
    """The sanitizers work: a block that reads one element too many ends the program."""
    (tmp_path / "beyond.c").write_text(
        '#include <opengpac.h>\n#include <string.h>\nFUNCTION_BLOCK(beyond, "Reads beyond.", in(double[4], u, "u"), out(double, y, "y"))\n'
        "{\n    static const double table[] = {1, 2, 3, 4};\n    self->y = table[(int)self->u[3]];\n    return OK;\n}\n"
    )
    gpac.System("beyond", clock="virtual").download(tmp_path / "beyond.c")
    assert driven(kept, np.full((2, 4), 3.0)).tolist() == [[4.0], [4.0]]
    with pytest.raises(AssertionError, match=r"index 4 out of bounds|global-buffer-overflow"):
        driven(kept, np.full((2, 4), 4.0))
