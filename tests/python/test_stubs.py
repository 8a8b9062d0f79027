# SPDX-License-Identifier: Apache-2.0
"""`opengpac stubs`: a type checker checks the calls of verbs that were made from dictionaries."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import opengpac as gpac
from opengpac import cli

PROGRAM = '''
from typing import Annotated

import opengpac as gpac
from opengpac.python import Input, Output, Parameter
from opengpac import activate, library as lib, on


class Moved(gpac.Report):
    """What a typed verb gives."""

    last: float


smooth = gpac.Verb(
    "smooth",
    blocks={"wave": lib.signal_generator, "low": lib.lowpass},
    cells={"raw": ["wave.y", "low.u"]},
    instantiation_parameters={"out": "low.y"},
    input_parameters={"level": gpac.input("wave.offset", default=1.0), "shape": "wave.shape"},
    output_values={"last": "low.y"},
    command_lists={"start": [activate("wave", every="1 ms"), activate("low")]},
    conditions={"time_limit": on(returns=["last"])},
)


@gpac.verb(
    blocks={"wave": lib.signal_generator},
    instantiation_parameters={"out": "wave.y"},
    input_parameters={"level": "wave.offset"},
    command_lists={"start": [activate("wave", every="1 ms")]},
)
def hum(out: gpac.SVV[float], level: float = 1.0) -> Moved:
    """Typed as it is."""


@gpac.block
def twice(u: Annotated[float, Input("raw")], y: Annotated[float, Output("doubled")], by: Annotated[float, Parameter()] = 2.0) -> None:
    """Twice the input."""
    y = by * u


low = lib.lowpass


def double(n: int = 5) -> int:
    return 2 * n


cell = gpac.System("cell", clock="virtual")
fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
y = cell.svv("y", "double")
'''

USE = """
from program import cell, double, fast, hum, low, smooth, twice, y

print(smooth.on(fast)(y, shape=1, level="0.5", time_limit="5 ms").last + double(3))
smooth.asynch(y, shape=1).wait()
smooth.new_instance(y).start(shape=1)
hum(y, level=0.5).last
one, gain = low(alpha=0.3).labelled("one"), twice(by=3.0).labelled("gain")
blocks, cells = [one, gain], {"x": [one.y, gain.u]}
print(twice.run(u=[1.0, 2.0], by=0.5).y.sum(), twice.inputs["u"].unit)
smooth(y, shape="sine")
smooth(y, shape=1, levl=2.0)
smooth(y)
smooth(5, shape=1)
double("3")
hum(y, levle=0.5)
cell.nothing
one.outputs_of
gain.v
twice(bye=3.0)
twice.run(v=1.0)
twice.run(u=1.0).z
"""


def test_a_type_checker_knows_the_calls(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    assert cli.main(["stubs", str(program)]) == 0
    (tmp_path / "use.py").write_text(USE)
    package = Path(gpac.__file__).parents[1]
    settings = {"include": ["use.py", "program.pyi"], "extraPaths": [str(package)], "pythonVersion": "3.11"}
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings))
    done = subprocess.run(
        [sys.executable, "-m", "pyright", "-p", str(tmp_path), "--pythonpath", sys.executable, "--outputjson"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    found = json.loads(done.stdout)["generalDiagnostics"]
    assert [d for d in found if not d["file"].endswith("use.py")] == []
    lines = USE.splitlines()
    wrong = sorted({lines[d["range"]["start"]["line"]] for d in found})
    assert wrong == sorted(lines[10:]), found


def test_a_program_with_an_error_gets_a_stub_all_the_same(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(PROGRAM.replace('"low.y"}', '"low.z"}', 1).replace("def double", "class Thing:\n    size = 5\n\n\ndef double"))
    assert cli.main(["stubs", str(program), "-o", str(tmp_path / "other.pyi")]) == 1
    text = (tmp_path / "other.pyi").read_text()
    assert "def double(n: int=...) -> int:" in text and "    size: _Any" in text and "hum" in text
    assert not (tmp_path / "program.pyi").exists()
