# SPDX-License-Identifier: Apache-2.0
"""The decorator `@gpac.verb(...)`: creates a verb whose name, signature, defaults, description and report class come from a typed
function."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ParamSpec, TypeVar

from ..values.quantities import Quantity
from .blocks import Blocks
from .suspension import Holding
from .verbs import Verb

P = ParamSpec("P")
R = TypeVar("R")


def verb(
    *,
    blocks: Blocks,
    command_lists: Mapping[str, Sequence[Any]],
    objects: Mapping[str, Any] | None = None,
    instantiation_parameters: Mapping[str, Any] | None = None,
    cells: Mapping[str, Any] | None = None,
    input_parameters: Mapping[str, Any] | None = None,
    output_values: Mapping[str, Any] | None = None,
    conditions: Mapping[str, Any] | None = None,
    transitions: Mapping[tuple[str, str], str] | None = None,
    modes: Mapping[str, Any] | None = None,
    requires: Mapping[str, Any] | None = None,
    initial: str | None = None,
    ending: str | None = None,
    ending_limit: Quantity | None = None,
    suspend: str | Holding = "idle",
    if_cut_off: str | None = None,
    name: str | None = None,
    manual: bool = False,
) -> Callable[[Callable[P, R]], Verb[P, R]]:
    """Creates a verb from a function whose body is its docstring. The mappings define the verb's behaviour, and the function's signature
    defines its call.

    The mappings (`blocks`, `command_lists`, `objects`, `instantiation_parameters`, `cells`, `input_parameters`, `output_values`,
    `conditions`, `transitions`, `modes`, `requires`) and `initial`, `ending`, `ending_limit`, `suspend`, `if_cut_off` and `manual`
    are as in `gpac.Verb`. `name` defaults to the function's name. If the return annotation derives from `gpac.Report`, it is the
    class of the verb's reports.
    """
    namespace = dict(sys._getframe(1).f_locals)

    def decorate(function: Callable[P, R]) -> Verb[P, R]:
        function.__gpac_locals__ = namespace  # type: ignore[attr-defined]
        made: Any = Verb(
            name or getattr(function, "__name__", "verb"),
            blocks=blocks,
            command_lists=command_lists,
            objects=objects,
            instantiation_parameters=instantiation_parameters,
            cells=cells,
            input_parameters=input_parameters,
            output_values=output_values,
            conditions=conditions,
            transitions=transitions,
            modes=modes,
            requires=requires,
            initial=initial,
            ending=ending,
            ending_limit=ending_limit,
            suspend=suspend,
            if_cut_off=if_cut_off,
            doc=inspect.getdoc(function) or "",
            manual=manual,
            function=function,
        )
        return made

    return decorate
