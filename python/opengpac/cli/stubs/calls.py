# SPDX-License-Identifier: Apache-2.0
"""Types of a verb's calls: its parameters and its report."""

from __future__ import annotations

import inspect
import keyword
import re
from collections.abc import Mapping
from typing import Any

from ...definition.blocks import Item
from ...definition.verbs import Verb

_ARRAY = re.compile(r"\[\d*\w*\]")
_NUMBER, _WHOLE = {"float", "double"}, re.compile(r"u?int(8|16|32|64)_t")


def verb_class(name: str, verb: Verb[..., Any]) -> list[str]:
    """Returns the class of a verb in a stub, and the class of its reports; the three invocation modes share the parameters."""
    report = f"{name}_Report"
    lines = [f"class {report}(_gpac.Report):"]
    outputs = {verb.reported(key): _got(_item(verb, target[0])) for key, target in verb.output_values.items()}
    lines += [f"    {output}: {got}" for output, got in outputs.items() if _named(output)] or ["    ..."]
    given, started = _parameters(verb, verb.arguments_signature), _parameters(verb, verb.inputs_signature)
    limit = "time_limit: _gpac.Quantity | None = ..."
    parameters = _required_first([*given, *started])
    whole = ", ".join(["self", *parameters, *([] if "*" in parameters else ["*"]), limit])
    instance = f"_gpac.VerbInstance[{report}]"
    return [
        *lines,
        "",
        f"class {name}_Verb(_gpac.Verb[..., {report}]):",
        f"    def __call__({whole}) -> {report}: ...  # type: ignore[override]",
        f"    def asynch({whole}) -> {instance}: ...  # type: ignore[override]",
        f"    def new_instance({', '.join(['self', *_required_first(given)])}) -> {instance}: ...  # type: ignore[override]",
        f"    def on(self, where: _Any = None, *, every: _Mapping[str, _gpac.Quantity] | None = None) -> {name}_Verb: ...",
        f"    def named(self, name: str) -> {name}_Verb: ...",
        "",
    ]


def _named(name: str) -> bool:
    return name.isidentifier() and not keyword.iskeyword(name)


def _parameters(verb: Verb[..., Any], signature: inspect.Signature) -> list[str]:
    texts: list[str] = []
    for parameter in signature.parameters.values():
        if not _named(parameter.name):
            continue
        known = verb.input_parameters.get(parameter.name)
        if known is None:
            texts.append(f"{parameter.name}: {_argument(verb, parameter.name)}")
            continue
        optional = " = ..." if known.has_default or known.member else ""
        texts.append(f"{parameter.name}: {_taken(verb, parameter.name)}{optional}")
    return texts


def _required_first(texts: list[str]) -> list[str]:
    """Inserts a `*` before the first optional parameter if a required one follows, because Python does not allow that order."""
    first = next((n for n, text in enumerate(texts) if text.endswith(" = ...")), len(texts))
    late = any(not text.endswith(" = ...") for text in texts[first:])
    return [*texts[:first], "*", *texts[first:]] if late else texts


def _argument(verb: Verb[..., Any], name: str) -> str:
    """Returns the type of the argument of an object or an instantiation parameter."""
    if name in verb.objects:
        return "_gpac.Group[_Any] | _Sequence[_gpac.LogicalDevice]" if verb.objects[name].each else "_gpac.LogicalDevice"
    if name in verb.instantiation_parameters:
        return "_gpac.SVV[_Any] | _Sequence[_gpac.SVV[_Any]] | _gpac.Channel"
    return "_gpac.Part"


def _taken(verb: Verb[..., Any], name: str) -> str:
    """Returns the type of an input parameter."""
    parameter = verb.input_parameters[name]
    item = _item(verb, parameter.targets[0]) if parameter.targets and parameter.form is None else None
    if item is None:
        return "_Any"
    one = _scalar(item.type, "_gpac.Quantity")
    if one == "_Any" or not _is_array(item):
        return one
    every = f" | {one}" if parameter.within is not None else ""
    return f"_Sequence[_Any] | _np.ndarray{every}"


def _got(item: Item | None) -> str:
    """Returns the Python type of an output value."""
    if item is None:
        return "_Any"
    return "_np.ndarray" if _is_array(item) else _scalar(item.type, "float")


def _is_array(item: Item) -> bool:
    return item.sized or bool(_ARRAY.search(item.type))


def _scalar(text: str, number: str) -> str:
    base = _ARRAY.sub("", text).strip()
    if base in _NUMBER:
        return number
    return "int" if _WHOLE.fullmatch(base) else "bool" if base in ("bool", "_Bool") else "_Any"


def _item(verb: Verb[..., Any], name: str) -> Item | None:
    """Returns the block item to which `label.item` refers, including items within graphs."""
    for label in sorted(verb.blocks, key=len, reverse=True):
        if name.startswith(f"{label}."):
            return _inner(verb.blocks[label].block, name[len(label) + 1 :])
    return None


def _inner(block: Any, name: str) -> Item | None:
    items: Mapping[str, Any] = block.items
    found = items.get(name)
    if isinstance(found, Item):
        return found
    target = found[0] if found else name
    label, dot, rest = target.partition(".")
    inner = getattr(block, "blocks", {})
    return _inner(inner[label].block, rest) if dot and label in inner else None
