# SPDX-License-Identifier: Apache-2.0
"""Implements `gpac.policy`: creates the block of a network. The real-time system's backend for ONNX files translates the network; this
module writes the declaration into a copy of the file, so that downloads, daemons, recordings and replay keep the two together."""

from __future__ import annotations

import functools
import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from .. import _native
from ..definition.blocks import Block
from ..definition.entering import without_system
from ..errors import CallError, DefinitionError, ModuleError, OutOfRange, refusals, refuse
from ..storage.process_folders import process_folder
from ..values.quantities import Quantity, optional_ns
from .terms import Terms, terms_json

_KEY = "opengpac.policy"


class Policy(Block):
    """Block of a network. Created by `gpac.policy`. `file` is the ONNX file with its declaration, `period_ns` its interval, or None, and
    `names` the element names of each port that has them."""

    def __init__(self, interface: Mapping[str, Any], file: Path, declaration: Mapping[str, Any]) -> None:
        super().__init__(interface, str(file))
        self.file = file
        self.period_ns = declaration["period_ns"]
        terms = [term for side in ("inputs", "outputs") for of in declaration[side].values() for term in of]
        self.names = {term["port"]: term["names"] for term in terms if term["names"]}

    @property
    def _own_interval(self) -> str:
        """Returns the wording that precedes `period_ns` in messages."""
        return f"policy '{self.name.rpartition('.')[2]}' was trained for"


def policy(
    path: str | os.PathLike[str],
    inputs: Mapping[str, Terms] | None = None,
    outputs: Mapping[str, Terms] | None = None,
    *,
    name: str | None = None,
    every: Quantity | None = None,
    age_max: Quantity | None = None,
    states: Mapping[str, str] | None = None,
    shapes: Mapping[str, Sequence[int]] | None = None,
    doc: str = "",
) -> Policy:
    """A network as a function block: the ONNX file at `path` is compiled to C that is built into the system, without a runtime library.

    `inputs` and `outputs` declare the contents of the network's inputs and outputs: name → `gpac.Term`s in their order, or the unit
    of a port of that name; by default each is a port of dimensionless numbers. `every` is the interval at which the network was
    trained; other intervals are refused. `age_max` adds an input `observed`, the time of its observations, and a condition `stale`.
    `states` feeds outputs back, `{"h_in": "h_out"}`. `shapes` are the shapes of inputs whose dimensions the file does not fix. `name`
    is the block's name, by default the file's; `doc` is its description.

    Raises `ModuleError` with the node's name for an unsupported operator, shape or opset, and with both ends if the declaration and
    the file differ. `cell.download("policy.onnx")` accepts a file without a declaration, or `Policy.file`.
    """
    source = Path(path).expanduser().absolute()
    if not source.is_file():
        refuse(CallError, f"file '{source}' does not exist")
    declaration: dict[str, Any] = {
        "name": name or _name_of(source), "doc": doc,
        "period_ns": _positive(every, "the interval of the policy"), "age_max_ns": _positive(age_max, "age_max of the policy"),
        "inputs": terms_json(inputs, "input"), "outputs": terms_json(outputs, "output"),
        "states": dict(states or {}), "shapes": {key: [int(d) for d in shape] for key, shape in (shapes or {}).items()},
    }  # fmt: skip
    ports = [term["port"] for side in ("inputs", "outputs") for of in declaration[side].values() for term in of if term["port"]]
    for port in ports:
        if ports.count(port) > 1:
            refuse(DefinitionError, f"policy '{declaration['name']}' has two ports '{port}'", "give each its own name")
    content = whole_content(source) + _entry(_KEY, json.dumps(declaration))
    file = process_folder("policies") / f"{declaration['name']}-{hashlib.sha256(content).hexdigest()[:12]}.onnx"
    if not file.exists():
        file.write_bytes(content)
    try:
        return Policy(_described(file)[0], file, declaration)
    except ModuleError as why:
        # The message names the copy with the declaration, which the caller does not know.
        raise ModuleError(why.message.replace(str(file), str(path)), remedy=why.remedy) from None


def whole_content(source: Path) -> bytes:
    """Returns the contents of an ONNX file, with the weights of external data files embedded."""
    try:
        content = source.read_bytes()
    except OSError as error:
        refuse(ModuleError, f"cannot read '{source}': {(error.strerror or str(error)).lower()}")
    with refusals:
        return _native.whole_network(content, str(source)) or content


def _name_of(source: Path) -> str:
    made = "".join(c if c.isalnum() and c.isascii() else "_" for c in source.stem).strip("_")
    made = made if made and made[0].isalpha() else f"policy_{made or 'network'}"
    return f"{made}_policy" if _native.is_word_of_c(made) else made


def _positive(duration: Quantity | None, what: str) -> int | None:
    """Converts a duration, which must be positive, to ns; None is returned unchanged."""
    ns = optional_ns(duration, what)
    if ns is not None and ns <= 0:
        refuse(OutOfRange, f"{what} must be more than 0 s, not {duration!r}", "write '20 ms', for example")
    return ns


@functools.cache
def _described(file: Path) -> list[dict[str, Any]]:
    module = file.stem.replace("-", "_")
    return without_system().enter_module(module, str(file))


def _entry(key: str, value: str) -> bytes:
    """Encodes an entry of ONNX's `metadata_props` (field 14). Appending it to the file extends the protobuf message."""
    pair = b"".join(bytes([tag]) + _length(text.encode()) for tag, text in ((0x0A, key), (0x12, value)))
    return b"\x72" + _length(pair)


def _length(content: bytes) -> bytes:
    """Returns the contents preceded by their length as a varint, seven bits per byte."""
    size, head = len(content), bytearray()
    while size > 0x7F:
        head.append(size & 0x7F | 0x80)
        size >>= 7
    return bytes(head) + bytes([size]) + content
