# SPDX-License-Identifier: Apache-2.0
"""Implements `gpac.casadi`: creates a function block from a `casadi.Function`. It is compiled once per content, and cached for later
processes."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..definition.blocks import Block
from ..definition.generated_code import block_name, interface, kept
from ..errors import DefinitionError, ModuleError, refuse
from . import code
from .arguments import Constant, Given, Side, arguments_of

KIND = "casadi-blocks"


class CasadiBlock(Block):
    """Block of a symbolic function. Created by `gpac.casadi`. `function` is the `casadi.Function`, for comparison; `work_bytes` is the
    stack size of its work vectors."""

    def __init__(self, interface: Mapping[str, Any], module: str, function: Any, work_bytes: int) -> None:
        super().__init__(interface, module)
        self.function = function
        self.work_bytes = work_bytes


def casadi(
    function: Any,
    inputs: Mapping[str, Given] | None = None,
    outputs: Mapping[str, Given] | None = None,
    *,
    parameters: Mapping[str, Constant] | None = None,
    states: Mapping[str, str] | None = None,
    initial: Mapping[str, Any] | None = None,
    publish_unsolved: bool = False,
    name: str | None = None,
    doc: str = "",
) -> CasadiBlock:
    """A `casadi.Function` as a function block, translated by CasADi to C, which does not require CasADi at run time.

    Each input and output of the `function` is a port of its name: a scalar is `double`, a vector `double[n]`, a matrix
    `double[n][m]`. `inputs` and `outputs` add details for some of them: name → unit, or `Input`, `Output` of `opengpac.python`. A
    scalar output may be a `Condition`, which is reported if it is not 0. `parameters` are inputs that become parameters of the block,
    with their defaults: 2.0, "2 N/m", `[1, 2]`. `states` feeds outputs back, `{"x": "x_next"}`: such an input starts at its value in
    `initial`, or 0, and its output is a port if `outputs` names it. `name` is the block's name, by default the function's; `doc` is
    its description.

    An invocation in which the function fails, such as one in which a solver does not converge within its iteration limit, is fault 1
    and publishes nothing. `publish_unsolved=True` publishes the last iterate of a solver that stops early, for real-time iteration;
    solvers with `error_on_fail` and infeasible quadratic programs are faults even then. Raises `DefinitionError` for an unsuitable
    name, shape or word, for sparse inputs, and for a `function` that needs a library or its own memory at run time.
    >>> import casadi as ca
    >>> q = ca.SX.sym("q", 2)
    >>> tip = ca.Function("tip", [q], [ca.cos(q[0]) + ca.cos(ca.sum1(q))], ["q"], ["x"])
    >>> import opengpac as gpac
    >>> gpac.casadi(tip, {"q": "rad"}, {"x": "m"}).run(q=[[0.0, 0.0]]).x
    array([2.])
    """
    library = _library(function)
    given = block_name(name or str(function.name()))
    sides = Side(inputs or {}, "input"), Side(outputs or {}, "output")
    arguments = arguments_of(given, function, *sides, parameters or {}, states or {}, initial or {})
    exported = code.named_for_c(function)
    generated = code.generated(library, exported, given, publish_unsolved)
    text = code.source(given, doc or f"{function.name()}, a symbolic function.", arguments, generated, exported)
    found = kept(KIND, given, text, lambda: text)
    return CasadiBlock(_interface(given, found), str(found), function, code.work_bytes(exported))


def _library(function: Any) -> Any:
    """Returns the module `casadi` if the function belongs to it."""
    try:
        library = importlib.import_module("casadi")
    except ImportError as why:
        text = f"a symbolic function requires CasADi, which is not installed ({why})"
        raise DefinitionError(text, remedy="run pip install 'opengpac[casadi]'") from None
    if not isinstance(function, library.Function):
        remedy = "pass a casadi.Function: casadi.Function('law', [x], [u], ['x'], ['u'])"
        refuse(
            DefinitionError,
            f"the argument of gpac.casadi() must be a casadi.Function, not {type(function).__name__} {str(function)[:40]!r}",
            remedy,
        )
    return library


def _interface(name: str, found: Path) -> Mapping[str, Any]:
    try:
        return interface(f"casadi:{name}", found)
    except ModuleError as why:
        raise ModuleError(f"block '{name}': {why.message}", remedy=why.remedy) from None
