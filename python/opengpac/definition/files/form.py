# SPDX-License-Identifier: Apache-2.0
"""Checks that a tree conforms to the format of definition files: the committed schema, which is generated from the model's types.

Implements only the features of JSON Schema that this schema uses.
"""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from ...errors import DefinitionError, Error, UnknownName, ValueRefused, did_you_mean
from ...values.quantities import duration_ns
from .positions import Path

FORMAT, VERSION = "opengpac-definitions", 1

Schema = Mapping[str, Any]


@functools.cache
def schema() -> dict[str, Any]:
    """Returns the JSON Schema of definition files."""
    return json.loads(files("opengpac").joinpath("schemas/definitions-v1.json").read_text(encoding="utf-8"))


@dataclass(frozen=True)
class Finding:
    """Violation at a path of the tree."""

    kind: type[Error]
    path: Path
    message: str
    remedy: str = ""


def findings(tree: Any) -> list[Finding]:
    """Finds every violation of the format in a tree; if the format or version is wrong, reports only that."""
    if isinstance(tree, dict):
        given = tree.get("format")
        if given != FORMAT:
            what = f"its format is {given!r}" if given is not None else "it has no format"
            return [
                Finding(
                    DefinitionError,
                    ("format",),
                    f"the file is not a file of definitions: {what}",
                    f'write at its beginning: format = "{FORMAT}"',
                )
            ]
        if tree.get("version") != VERSION:
            return [_version(tree.get("version"))]
    return [*_check(tree, schema(), ())]


def _version(given: Any) -> Finding:
    newer = isinstance(given, int) and not isinstance(given, bool) and given > VERSION
    what = f"the file has version {given}" if given is not None else "the file has no version"
    remedy = "update OpenGPAC: a newer one wrote the file" if newer else f"write version = {VERSION}"
    return Finding(DefinitionError, ("version",), f"this OpenGPAC reads version {VERSION} of the format, but {what}", remedy)


def _check(value: Any, of: Schema | bool, path: Path) -> Iterator[Finding]:
    if isinstance(of, bool):
        return
    if "$ref" in of:
        yield from _check(value, schema()["$defs"][of["$ref"].rsplit("/", 1)[1]], path)
        return
    for word in ("anyOf", "oneOf"):
        if word in of:
            yield from _check_one_of(value, of[word], path)
            return
    kinds = of.get("type")
    kinds = [kinds] if isinstance(kinds, str) else kinds
    if kinds and not any(_is(value, kind) for kind in kinds):
        yield _wrong_kind(value, kinds, path)
        return
    if "const" in of and value != of["const"]:
        yield Finding(ValueRefused, path, f"{_at(path)} must be {of['const']!r}, not {value!r}", f"write {of['const']!r}")
    if "enum" in of and value not in of["enum"]:
        yield Finding(UnknownName, path, f"{_at(path)} cannot be {value!r}", did_you_mean(str(value), [str(v) for v in of["enum"]]))
    if of.get("format") == "time-with-unit" and isinstance(value, str):
        yield from _check_time(value, path)
    if isinstance(value, dict):
        yield from _check_object(value, of, path)
    elif isinstance(value, list):
        yield from _check_list(value, of, path)
    elif isinstance(value, int | float):
        yield from _check_number(value, of, path)


def _check_object(value: dict[str, Any], of: Schema, path: Path) -> Iterator[Finding]:
    known: Schema = of.get("properties", {})
    for name in of.get("required", []):
        if name not in value:
            yield Finding(DefinitionError, path, f"{_at(path)} lacks '{name}'", f"add its {name}")
    more = of.get("additionalProperties", True)
    for name, inner in value.items():
        if name in known:
            yield from _check(inner, known[name], (*path, name))
        elif more is False:
            yield Finding(UnknownName, (*path, name), f"{_at(path)} cannot have '{name}'", did_you_mean(name, [*known]))
        else:
            yield from _check(inner, more, (*path, name))


def _check_list(value: list[Any], of: Schema, path: Path) -> Iterator[Finding]:
    fixed = of.get("prefixItems", [])
    if fixed and len(value) != len(fixed):
        yield Finding(
            DefinitionError, path, f"{_at(path)} must have {len(fixed)} elements, not {len(value)}", f"write {len(fixed)} of them"
        )
        return
    for number, inner in enumerate(value):
        yield from _check(inner, fixed[number] if number < len(fixed) else of.get("items", True), (*path, number))


def _check_number(value: float, of: Schema, path: Path) -> Iterator[Finding]:
    if isinstance(value, float) and not math.isfinite(value):
        yield Finding(ValueRefused, path, f"{_at(path)} must be finite, not {value}", "write a finite number")
    least, most = of.get("minimum", -math.inf), of.get("maximum", math.inf)
    if isinstance(value, int) and not isinstance(value, bool) and not max(least, -(2**63)) <= value <= min(most, 2**63 - 1):
        yield Finding(
            ValueRefused,
            path,
            f"{_at(path)} is out of range: {value}",
            f"write {least} or more" if value < least else "write a smaller number",
        )


def _check_time(value: str, path: Path) -> Iterator[Finding]:
    try:
        if duration_ns(value, _at(path)) < 0:
            yield Finding(ValueRefused, path, f"{_at(path)} must be at least 0 s, not {value!r}", "write a time of 0 or more")
    except Error as error:
        yield Finding(type(error), path, error.message, error.remedy)


def _check_one_of(value: Any, variants: list[Schema], path: Path) -> Iterator[Finding]:
    """Checks a value against several variants. If none matches, yields the findings for the most likely one."""
    flat = [*_flat(variants)]
    fitting = [of for of in flat if _fits_kind(value, of)]
    if not fitting:
        yield _wrong_kind(value, list(dict.fromkeys(kind for of in flat for kind in _kinds(of))), path)
        return
    if isinstance(value, dict):
        fitting.sort(key=lambda of: not {*of.get("required", [])} <= {*value})
    if any(next(_check(value, of, path), None) is None for of in fitting):
        return
    tried = [[*_check(value, of, path)] for of in fitting]
    if all("const" in of or "enum" in of for of in fitting):
        words = [str(word) for of in fitting for word in of.get("enum", [of.get("const")])]
        yield Finding(UnknownName, path, f"{_at(path)} cannot be {value!r}", did_you_mean(str(value), words))
        return
    if isinstance(value, dict):
        keyed = [(len({*of.get("required", [])} & {*value}), _tagged(value, of)) for of in fitting]
        best = max(range(len(fitting)), key=lambda n: (keyed[n][1], keyed[n][0], -len(tried[n])))
        if not keyed[best][0] and len(fitting) > 1:
            names = list(dict.fromkeys(of["required"][0] for of in fitting if of.get("required")))
            wrong = next((name for name in value), "")
            yield Finding(UnknownName, path, f"{_at(path)} must have one of {', '.join(names)}", did_you_mean(wrong, names))
            return
        yield from tried[best]
        return
    yield from min(tried, key=len)


def _flat(variants: list[Schema]) -> Iterator[Schema]:
    """Yields the variants, with references and nested variants expanded."""
    for of in variants:
        while "$ref" in of:
            of = schema()["$defs"][of["$ref"].rsplit("/", 1)[1]]
        inner = of.get("anyOf") or of.get("oneOf")
        if inner:
            yield from _flat(inner)
        else:
            yield of


def _tagged(value: dict[str, Any], of: Schema) -> bool:
    """Returns whether the value has a property for which the schema allows only a single value."""
    return any(
        "const" in inner and value.get(name) == inner["const"]
        for name, inner in of.get("properties", {}).items()
        if isinstance(inner, dict)
    )


_WORDS = {
    "object": "a table", "array": "a list", "string": "a string", "number": "a number", "integer": "an integer", "boolean": "true or false",
    "null": "nothing",
}  # fmt: skip


def _is(value: Any, kind: str) -> bool:
    match kind:
        case "object":
            return isinstance(value, dict)
        case "array":
            return isinstance(value, list)
        case "string":
            return isinstance(value, str)
        case "boolean":
            return isinstance(value, bool)
        case "null":
            return value is None
        case "integer":
            return isinstance(value, int) and not isinstance(value, bool)
        case _:
            return isinstance(value, int | float) and not isinstance(value, bool)


def _kinds(of: Schema) -> list[str]:
    given = of.get("type")
    if given is None:
        known = of.get("enum") or ([of["const"]] if "const" in of else [])
        return ["string"] if all(isinstance(value, str) for value in known) else []
    return [given] if isinstance(given, str) else list(given)


def _fits_kind(value: Any, of: Schema) -> bool:
    return any(_is(value, kind) for kind in _kinds(of))


def _wrong_kind(value: Any, kinds: list[str], path: Path) -> Finding:
    found = next((_WORDS[kind] for kind in ("object", "array", "boolean", "null") if _is(value, kind)), repr(value))
    wanted = " or ".join(_WORDS[kind] for kind in kinds if kind != "null")
    return Finding(DefinitionError, path, f"{_at(path)} must be {wanted}, not {found}", f"write {wanted}")


def _at(path: Path) -> str:
    """Returns the name of a part of the file, for use in messages: `verbs.move.command_lists.start[2]`."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return f"'{text.lstrip('.')}'" if text else "the file"
