# SPDX-License-Identifier: Apache-2.0
"""Code modules are distributed automatically to the processes that run their blocks: before and after the start, new and redefined."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from afar import Afar, until
from opengpac import _native, activate

pytestmark = pytest.mark.alone

SOURCE = """\
// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

FUNCTION_BLOCK(constant, "Gives one value.", out(double, y, "the value"))
{
    self->y = VALUE;
    return OK;
}
"""


def compiled(folder: Path, value: float) -> str:
    """Returns a module whose block `constant` outputs that value."""
    source = folder / f"constant_{value}.c"
    source.write_text(SOURCE.replace("VALUE", str(value)))
    return _native.build([str(source)], str(source.with_suffix(".so")))


def giving(block: gpac.Block, name: str = "giving") -> gpac.Verb[..., Any]:
    """Returns a verb whose block writes its constant into `y`."""
    return gpac.Verb(
        name, blocks={"it": block}, instantiation_parameters={"y": "it.y"}, command_lists={"start": [activate("it", every="2 ms")]}
    )


def test_modules_from_before_and_after_the_processor(built: dict[str, str], tmp_path: Path) -> None:
    with gpac.System("modules", progress=False) as cell:
        before = cell.download(compiled(tmp_path, 1.5), "before")
        afar = Afar(cell, built)
        after = cell.download(compiled(tmp_path, 2.5), "after")
        for name, module, value in (("earlier", before, 1.5), ("later", after, 2.5)):
            y = cell.svv(name)
            instance = giving(module.constant, f"giving_{name}").on(afar.there).asynch(y)
            until(lambda y=y, value=value: y.value == value, "the block there writes what it is to")
            instance.halt()


def test_a_module_is_redefined(afar: Afar, tmp_path: Path) -> None:
    old_y, new_y = afar.cell.svv("old_y"), afar.cell.svv("new_y")
    old = giving(afar.cell.download(compiled(tmp_path, 1.5), "code").constant, "old").on(afar.there).asynch(old_y)
    until(lambda: old_y.value == 1.5, "the first one runs")
    with pytest.raises(gpac.InUse, match="halt 'old#1' first"):
        afar.cell.download(compiled(tmp_path, 2.5), "code")
    old.halt()
    new = giving(afar.cell.download(compiled(tmp_path, 2.5), "code").constant, "new").on(afar.there).asynch(new_y)
    until(lambda: new_y.value == 2.5, "the second one runs")
    assert old_y.value == 1.5
    new.halt()


def test_the_module_that_was_redefined_is_there_after_a_reset(afar: Afar, tmp_path: Path) -> None:
    afar.cell.download(compiled(tmp_path, 1.5), "code")
    code = afar.cell.download(compiled(tmp_path, 2.5), "code")
    y = afar.cell.svv("y")
    first = giving(code.constant).on(afar.there).asynch(y)
    until(lambda: y.value == 2.5, "it runs")
    afar.end()
    with pytest.raises(gpac.Terminated, match="SIGKILL"):
        first.wait()
    afar.cell.reset()
    again = afar.cell.svv("again")
    giving(code.constant).on(afar.there).asynch(again)
    until(lambda: again.value == 2.5, "it runs in the new process")
