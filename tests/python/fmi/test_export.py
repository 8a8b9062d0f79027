# SPDX-License-Identifier: Apache-2.0
"""Graphs as FMUs: fmpy finds no problem and gets the bits of the virtual clock; our importer accepts them."""

import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu

import opengpac as gpac
from opengpac import activate, cli
from opengpac import library as lib
from opengpac.fmi.export import export_fmu

ROOT = Path(__file__).parents[3]
SYSTEM = ROOT / "target" / "checked" / "deps" / "libopengpac_ps.so"
"""Library with which the tests of the C package are linked: `make test` builds it first."""

BLOCK = """#include <opengpac.h>
FUNCTION_BLOCK(mix, "y = (u_0 + x, u_1 - x), n counts.", in(double[2], u, "what comes", "V"), in(double, x, "what is mixed in", "V"),
    out(double[2], y, "mixed", "V"), out(bool, high, "whether the first is above 1"), out(int32_t, n, "invocations"),
    param(double, k, 1.5, "factor"))
{
    self->y[0] = self->k * (self->u[0] + self->x);
    self->y[1] = self->k * (self->u[1] - self->x);
    self->high = self->y[0] > 1.0;
    self->n++;
    return OK;
}
"""


def graph(folder: Path, cell: gpac.System) -> gpac.Graph:
    """Returns a graph of noise, a filter of the library, and a block in C."""
    source = folder / "mix.c"
    source.write_text(BLOCK)
    mix = cell.download(source).mix
    return gpac.Graph(
        "mixer",
        doc="Mixes noise into two signals.",
        blocks={"noise": lib.noise(seed=11), "filter": lib.lowpass(alpha=0.2), "mix": mix},
        inputs={"u": "mix.u"},
        outputs={"y": "mix.y", "high": "mix.high", "n": "mix.n"},
        cells={"raw": ["noise.y", "filter.u"], "x": ["filter.y", "mix.x"]},
    )


STEPS = [(0.01, [1.0, 2.0]), (0.005, [0.25, -1.0]), (0.02, [1e-3, 1 / 3]), (0.0015, [np.pi, -0.1]), (0.0135, [0.0, 0.0])]


def by_the_virtual_clock(folder: Path, k: float) -> list[list[Any]]:
    """Makes the same steps in a system of this program."""
    with gpac.System("cell", clock="virtual") as cell:
        verb = gpac.Verb(
            "running",
            blocks={"graph": graph(folder, cell)},
            instantiation_parameters={name: f"graph.{name}" for name in ("u", "y", "high", "n")},
            input_parameters={"k": "graph.mix.k"},
            modes={"graph.u": "asynchronous"},
            command_lists={"start": [activate("graph", every="5 ms")]},
        )
        source = cell.processor("rtp0").timer("main", period="5 ms")
        u, y = cell.svv("u", "double[2]", unit="V"), cell.svv("y", "double[2]", unit="V")
        high, n = cell.svv("high", "bool"), cell.svv("n", "int32_t")
        verb.on(source).asynch(u, y, high, n, k=k)
        rows = []
        for step, value in STEPS:
            u.value = value
            cell.advance(step)
            rows.append([*y.value, high.value, n.value])
        return rows


@pytest.fixture(scope="module", autouse=True)
def built() -> None:
    if not SYSTEM.exists():
        subprocess.run(["cargo", "test", "-p", "c-package", "--profile", "checked", "--quiet", "--no-run"], cwd=ROOT, check=True)


@pytest.fixture
def cell() -> Iterator[gpac.System]:
    with gpac.System("making", clock="virtual") as made:
        yield made


def test_an_exported_graph_is_valid_and_gives_the_bits_of_the_virtual_clock(tmp_path: Path, cell: gpac.System) -> None:
    file = export_fmu(graph(tmp_path, cell), tmp_path / "mixer.fmu", "5 ms", library=SYSTEM)
    assert validate_fmu(str(file)) == []
    description = fmpy.read_model_description(file, validate=True)
    refs = {variable.name: variable.valueReference for variable in description.modelVariables}
    assert list(refs) == ["u[1]", "u[2]", "y[1]", "y[2]", "high", "n", "noise.mean", "noise.deviation", "mix.k"]
    unit = FMU2Slave(guid=description.guid, unzipDirectory=fmpy.extract(file), modelIdentifier="mixer", instanceName="a")
    for k in (1.5, 0.7):
        unit.instantiate()
        unit.setupExperiment(startTime=0.0)
        unit.enterInitializationMode()
        unit.setReal([refs["mix.k"]], [k])
        unit.exitInitializationMode()
        rows, at = [], 0.0
        for step, value in STEPS:
            unit.setReal([refs["u[1]"], refs["u[2]"]], value)
            unit.doStep(currentCommunicationPoint=at, communicationStepSize=step)
            at += step
            y = unit.getReal([refs["y[1]"], refs["y[2]"]])
            rows.append([*y, bool(unit.getBoolean([refs["high"]])[0]), unit.getInteger([refs["n"]])[0]])
        unit.freeInstance()
        assert rows == by_the_virtual_clock(tmp_path, k)


def test_what_fmi_has_not_is_refused(tmp_path: Path, cell: gpac.System) -> None:
    with pytest.raises(gpac.FileFailed, match=r"none\.so, .* does not exist"):
        export_fmu(graph(tmp_path, cell), tmp_path / "x.fmu", "5 ms", library=tmp_path / "none.so")
    silent = gpac.Graph("silent", blocks={"filter": lib.lowpass}, inputs={"u": "filter.u"})
    with pytest.raises(gpac.CallError, match="has no output"):
        export_fmu(silent, tmp_path / "x.fmu", "5 ms", library=SYSTEM)


def test_the_command_names_the_graphs_of_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "law.toml"
    lines = ['format = "opengpac-definitions"', "version = 1", "[graphs.smooth]", 'blocks = { filter = "library.lowpass" }']
    file.write_text("\n".join([*lines, 'inputs = { u = "filter.u" }']))
    assert cli.main(["export", "fmu", f"{file}:smoth", "--every", "1 ms"]) != 0
    assert "has no graph 'smoth'; did you mean 'smooth'?" in capsys.readouterr().err
    assert cli.main(["export", "fmu", str(file), "--every", "1 ms"]) != 0
    assert "graph 'smooth' has no output" in capsys.readouterr().err
