# SPDX-License-Identifier: Apache-2.0
"""A notebook whose cell with a block in Python is changed and run again: the block is redefined, and refused while it runs."""

import os
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

import opengpac

FIRST = """
from typing import Annotated as A
import opengpac as gpac
from opengpac import activate
from opengpac.python import Input, Output
"""
BLOCK = """
@gpac.block{options}
def gain(u: A[float, Input("raw")], y: A[float, Output("larger")]):
    y = {by} * u
    return y
"""
RUN = """
cell = gpac.System("cell", clock="virtual", progress=False)
rtp = cell.processor("rtp0", process=True).timer("fast", period="1 ms")
verb = gpac.Verb("v", blocks={"gain": gain}, modes={"gain.u": "asynchronous"}, instantiation_parameters={"u": "gain.u", "y": "gain.y"},
    command_lists={"start": [activate("gain", every="1 ms")]})
y = cell.svv("y")
running = verb.asynch(cell.svv("u", initial=1.0), y)
cell.advance("5 ms")
print(y.value, gain.run(u=1.0).y)
"""
AGAIN = """
print(gain.run(u=1.0).y)
verb = gpac.Verb("v", blocks={"gain": gain}, modes={"gain.u": "asynchronous"}, instantiation_parameters={"u": "gain.u", "y": "gain.y"},
    command_lists={"start": [activate("gain", every="1 ms")]})
try:
    verb.new_instance(cell.svv("w"), cell.svv("z"))
except gpac.InUse as why:
    print(why.remedy)
running.halt()
x = cell.svv("x")
with verb.asynch(cell.svv("v", initial=1.0), x):
    cell.advance("5 ms")
    print(x.value)
cell.close()
"""


def test_a_cell_that_is_run_again_redefines_the_block(tmp_path: Path) -> None:
    kinds = ("", "(native=False)")
    again = [(BLOCK.format(options=kind, by=2.0), RUN, BLOCK.format(options=kind, by=3.0), AGAIN) for kind in kinds]
    cells = [FIRST, *(part for parts in again for part in parts)]
    faulty = BLOCK.format(options="", by="[u]")
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(text.strip()) for text in cells])
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", os.pathsep.join([str(Path(opengpac.__file__).parent.parent), os.environ.get("PYTHONPATH", "")]))
        patch.setenv("IPYTHONDIR", str(tmp_path))
        patch.setenv("JUPYTER_RUNTIME_DIR", str(tmp_path))
        where = {"metadata": {"path": str(tmp_path)}}
        client = NotebookClient(notebook, kernel_name="python3", timeout=300, startup_timeout=300, resources=where)
        with client.setup_kernel():
            ran: list[Any] = [client.execute_cell(cell, index) for index, cell in enumerate(notebook.cells)]
            with pytest.raises(CellExecutionError, match="it makes a list, which is an allocation"):
                client.execute_cell(nbformat.v4.new_code_cell(faulty), len(cells))
    printed = ["".join(output.get("text", "") for output in cell.outputs) for cell in ran]
    for first in (1, 5):
        assert printed[first + 1].splitlines() == ["2.0 [2.]"], printed
        told = printed[first + 3].splitlines()
        assert told[0] == "[3.]" and "halt 'v#1' first" in told[1] and told[2] == "3.0", printed
