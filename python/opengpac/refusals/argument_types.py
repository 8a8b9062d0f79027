# SPDX-License-Identifier: Apache-2.0
"""Checks the arguments of public calls. A value whose type differs from the signature is refused, with an explanation, before the call
has any effect.

The signature is the single source of these rules. Each call itself checks other constraints, such as ranges.
"""

from __future__ import annotations

import functools
import inspect
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, ParamSpec, TypeVar

from .. import _native
from ..errors import CallError, DefinitionError, Error, OutOfRange, did_you_mean, refusals, refuse
from ..values.arrays import is_array
from ..values.numbers import is_number, number

P = ParamSpec("P")
R = TypeVar("R")
C = TypeVar("C")


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_list(value: Any) -> bool:
    return (isinstance(value, Sequence) or is_array(value)) and not isinstance(value, str | bytes)


_KINDS: dict[str, tuple[Callable[[Any], bool], str]] = {
    "str": (lambda value: isinstance(value, str), "a string"),
    "int": (_is_whole, "an integer"),
    "float": (is_number, "a number"),
    "bool": (lambda value: isinstance(value, bool), "True or False"),
    "None": (lambda value: value is None, "None"),
    "Quantity": (lambda value: is_number(value) or isinstance(value, str), "a quantity ('20 ms', or a number in SI units)"),
    "os.PathLike[str]": (lambda value: isinstance(value, os.PathLike), "a path"),
    "Mapping": (lambda value: isinstance(value, Mapping), "a dictionary"),
    "Sequence": (_is_list, "a list"),
    "Iterable": (lambda value: isinstance(value, Iterable) and not isinstance(value, str | bytes), "a list"),
    "tuple": (lambda value: _is_list(value) and len(value) == 2, "a pair, (0, 1)"),
    "Callable": (callable, "a function"),
}
"""Supported components of annotations, each with its test and its name. Arguments whose annotation has any other component are not
checked here."""


_DEFINING = ("commands", "composition", "conditions", "graphs", "parameters", "suspension")
"""Modules whose calls create parts of definitions; errors in their arguments are errors in the definition."""


def _parts(annotation: str) -> list[str]:
    """Splits a type's text into its components: `str | Mapping[str, int | None]` → `str`, `Mapping`."""
    parts, depth, part = [], 0, ""
    for sign in annotation:
        depth += (sign == "[") - (sign == "]")
        if sign == "|" and depth == 0:
            parts.append(part)
            part = ""
        else:
            part += sign
    whole = [p.strip() for p in (*parts, part)]
    return [p if p in _KINDS else p.partition("[")[0] for p in whole]


def name_of(name: Any, what: str) -> str:
    """Returns the name if it is valid: a text that fits on one line of a log."""
    if not isinstance(name, str):
        refuse(CallError, f"{what} must be a string, not {_short(name)}", "write a name such as 'cell'")
    with refusals:
        _native.check_name(what, name)
    return name


def whole(value: Any, what: str, least: int, most: int) -> int:
    """Returns the value if it is an integer from `least` to `most`. Raises `OutOfRange` for other integers, and `CallError` for other
    values."""
    value = number(value)
    if not _is_whole(value) or not least <= value <= most:
        kind = OutOfRange if _is_whole(value) else CallError
        bounds = f"{least} to {most:_}".replace("_", ",")
        refuse(kind, f"{what} must be an integer from {bounds}, not {_short(value)}")
    return int(value)


def _short(value: Any) -> str:
    text = repr(value).replace("\n", " ")
    return text if len(text) <= 80 else f"{text[:77]}..."


def _rule(name: str, parameter: inspect.Parameter) -> Callable[[Any, str, type[Error]], Any] | None:
    """Returns the check of a parameter, a function that returns the value to pass on; None if its annotation does not define a check."""
    annotation = parameter.annotation if isinstance(parameter.annotation, str) else "Any"
    kinds = _parts(annotation)
    if any(kind not in _KINDS for kind in kinds):
        return None
    tests = [_KINDS[kind][0] for kind in kinds]
    takes_numbers = not {"int", "float", "bool", "Quantity"}.isdisjoint(kinds)
    wanted = " or ".join(dict.fromkeys(_KINDS[kind][1] for kind in kinds))

    def check(value: Any, call: str, kind: type[Error]) -> Any:
        value = number(value) if takes_numbers else value
        if not any(test(value) for test in tests):
            refuse(kind, f"argument '{name}' of {call}() must be {wanted}, not {_short(value)}")
        if isinstance(value, str) and any(sign == "\0" or "\ud800" <= sign <= "\udfff" for sign in value):
            refuse(CallError, f"argument '{name}' of {call}() contains a NUL or an unpaired surrogate", "pass a string of valid characters")
        if name == "name" and value is not None:
            name_of(value, f"the name passed to {call}()")
        return value

    return check


def _unbound(call: str, signature: inspect.Signature, args: Sequence[Any], kwargs: Mapping[str, Any]) -> None:
    """Refuses arguments that cannot be bound to the signature: too many, too few, or unknown ones."""
    parameters = signature.parameters
    several = any(p.kind is p.VAR_KEYWORD for p in parameters.values())
    unknown = next((name for name in kwargs if name not in parameters), None)
    if unknown is not None and not several:
        named = [name for name, p in parameters.items() if p.kind in (p.KEYWORD_ONLY, p.POSITIONAL_OR_KEYWORD) and name != "self"]
        refuse(CallError, f"{call}() has no argument '{unknown}'", did_you_mean(unknown, named))
    try:
        signature.bind(*args, **kwargs)
    except TypeError as error:
        names = ", ".join(name for name in parameters if name != "self")
        refuse(CallError, f"{call}(): {error}", f"call it as {call}({names})")


class _Rules:
    """Rules for a call's arguments, prepared once, at its first call, because binding a signature in each call would cost ten times as
    much."""

    def __init__(self, call: Callable[..., Any]) -> None:
        self.signature = inspect.signature(call)
        parameters = self.signature.parameters
        rules = {name: rule for name, parameter in parameters.items() if (rule := _rule(name, parameter)) is not None}
        self.ordered = [name for name, p in parameters.items() if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
        self.known = {name for name, p in parameters.items() if p.kind in (p.KEYWORD_ONLY, p.POSITIONAL_OR_KEYWORD)}
        self.required = {name for name in (*self.ordered, *self.known) if parameters[name].default is inspect.Parameter.empty}
        self.by_place = [rules.get(name) for name in self.ordered]
        self.by_name = {name: rule for name, rule in rules.items() if name in self.known}
        module = call.__module__.rpartition(".")[2]
        self.kind = DefinitionError if module in _DEFINING or call.__qualname__ == "Verb.__init__" else CallError
        self.title = call.__qualname__.removesuffix(".__init__").rpartition(".")[2]


def taking(call: Callable[P, R]) -> Callable[P, R]:
    """Wraps the call in a check of its arguments."""
    rules: _Rules | None = None

    @functools.wraps(call)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        nonlocal rules
        of = rules = rules or _Rules(call)
        placed = of.ordered[: len(args)]
        fits = kwargs.keys() <= of.known and kwargs.keys().isdisjoint(placed) and len(args) <= len(of.ordered)
        if not (fits and of.required <= {*placed, *kwargs}):
            _unbound(of.title, of.signature, args, kwargs)
        for place, rule in enumerate(of.by_place[: len(args)]):
            if rule is not None and (value := rule(args[place], of.title, of.kind)) is not args[place]:
                args = (*args[:place], value, *args[place + 1 :])  # pyright: ignore[reportAssignmentType]
        for name in kwargs:
            if name in of.by_name:
                kwargs[name] = of.by_name[name](kwargs[name], of.title, of.kind)
        return call(*args, **kwargs)

    return checked


def all_taking(of: type[C]) -> type[C]:
    """Wraps the public calls of a class in checks of their arguments."""
    for name, member in list(vars(of).items()):
        if inspect.isfunction(member) and (name == "__init__" or not name.startswith("_")):
            setattr(of, name, taking(member))
        elif isinstance(member, property) and member.fset is not None:
            setattr(of, name, member.setter(taking(member.fset)))
    return of
