# SPDX-License-Identifier: Apache-2.0
"""The functions of `math` in compiled blocks: the documented ones give Python's values, all others are refused by name."""

import importlib.util
import math
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac.python.checking import MATH

PAGE = Path(__file__).parents[3] / "docs" / "python-blocks.md"
HEAD = "import math\nfrom typing import Annotated\nimport opengpac as gpac\nfrom opengpac.python import Input, Output\n"
POINTS = [0.0, 0.3, -0.7, 0.999, 2.5, -3.25]
ARGUMENTS = {"atan2": "x, 0.5", "copysign": "2.0, x", "hypot": "x, 0.5", "pow": "abs(x), 1.5", "gcd": "int(12.0 * x), 18"}


def entered(folder: Path, text: str) -> ModuleType:
    file = folder / "entered.py"
    file.write_text(HEAD + text)
    spec = importlib.util.spec_from_file_location("entered", file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def block(name: str, body: str) -> str:
    signature = 'x: Annotated[float, Input("x")], y: Annotated[float, Output("y", nonfinite=True)]'
    return f'@gpac.block\ndef {name}({signature}) -> None:\n    """Tried."""\n    y = {body}\n'


def expression(name: str) -> str:
    if not callable(getattr(math, name)):
        return f"math.{name} + 0.0 * x"
    if name.startswith("is"):
        return f"1.0 if math.{name}(x) else 0.0"
    return f"float(math.{name}({ARGUMENTS.get(name, 'x')}))"


def test_the_page_lists_what_is_compiled() -> None:
    assert set(re.findall(r"`(\w+)`", PAGE.read_text().split("<!-- math -->")[1])) == MATH


def test_they_have_the_values_of_python(tmp_path: Path) -> None:
    module = entered(tmp_path, "\n".join(block(f"b_{name}", expression(name)) for name in sorted(MATH)))
    for name in sorted(MATH):
        points, values = [], []
        for x in POINTS:
            try:
                expected: Any = eval(expression(name), {"math": math, "x": x})
            except (ValueError, OverflowError):
                continue  # The compiled function is infinite or NaN there.
            if math.isfinite(expected):
                points.append(x)
                values.append(expected)
        if not points:
            assert name in ("inf", "nan"), name
            continue
        ran = getattr(module, f"b_{name}").run(x=points)
        assert ran.fault is None, (name, ran.fault)
        np.testing.assert_allclose(ran.y, values, rtol=1e-12, atol=1e-15, err_msg=f"{name} at {points}")


OTHERS = sorted(name for name in vars(math) if not name.startswith("_") and name not in MATH)


@pytest.mark.parametrize("name", OTHERS)
def test_all_others_are_refused_by_name(tmp_path: Path, name: str) -> None:
    with pytest.raises(gpac.errors.DefinitionError, match=rf"it uses math\.{name}, which is not compiled; use one of acos, "):
        entered(tmp_path, block("other", f"float(math.{name}(x))"))
    with pytest.raises(gpac.errors.DefinitionError, match=rf"it uses math\.{name}, which is not compiled"):
        entered(tmp_path, f"from math import {name}\n" + block("other", f"float({name}(x))"))


def test_rounding_to_digits_is_refused(tmp_path: Path) -> None:
    with pytest.raises(gpac.errors.DefinitionError, match=r"it rounds to a number of digits, .*; write round\(x \* 100\) / 100"):
        entered(tmp_path, block("rounded", "round(x, 2)"))
    ran = entered(tmp_path, block("rounded", "float(round(x))")).rounded.run(x=[0.5, 1.5, -2.5])
    assert ran.y.tolist() == [round(0.5), round(1.5), round(-2.5)]
