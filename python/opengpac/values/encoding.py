# SPDX-License-Identifier: Apache-2.0
"""Conversion between Python values and values of the real-time system: scalars are `int`, `float`, `bool`; arrays are NumPy arrays;
structs are records of a structured dtype."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from ..errors import ValueRefused, refuse
from .arrays import is_array, is_record, np
from .numbers import is_masked, number, rows

_FORMATS = {
    "double": "<d", "float": "<f", "bool": "?",
    "int8_t": "<b", "int16_t": "<h", "int32_t": "<i", "int64_t": "<q",
    "uint8_t": "<B", "uint16_t": "<H", "uint32_t": "<I", "uint64_t": "<Q",
}  # fmt: skip
"""Formats with which `struct` reads C scalars."""
_TEXT_OR_WHOLE = frozenset({bool, int, str})
"""Types whose values are plain as they are."""


def dtype_of(tree: Mapping[str, Any]) -> np.dtype[Any]:
    """Returns the dtype of a C type, from the model's tree.
    >>> dtype_of({"scalar": "double"})
    dtype('float64')
    >>> dtype_of({"array": [{"scalar": "float"}, 3]})
    dtype(('<f4', (3,)))
    """
    if "scalar" in tree:
        # NumPy uses C's names with one exception: its `float` is C's double.
        return np.dtype("float32" if tree["scalar"] == "float" else tree["scalar"].removesuffix("_t"))
    if "array" in tree:
        element, count = tree["array"]
        return np.dtype((dtype_of(element), (count,)))
    fields = tree["struct"]
    return np.dtype(
        {
            "names": [f[0] for f in fields],
            "formats": [dtype_of(f[1]) for f in fields],
            "offsets": [f[2] for f in fields],
            "itemsize": tree["size"],
        }
    )


def from_bytes(data: bytes, dtype: np.dtype[Any]) -> Any:
    """Decodes the bytes of a value to the Python value."""
    base, shape = dtype, ()
    while base.subdtype is not None:
        # An array of arrays becomes one array of more dimensions.
        base, shape = base.subdtype[0], (*shape, *base.subdtype[1])
    array = np.frombuffer(data, dtype=base).reshape(shape).copy()
    if shape:
        return array
    return array[()] if base.names else array.item()


def decoder_of(tree: Mapping[str, Any]) -> Callable[[bytes], Any]:
    """Returns a function that decodes the bytes of a value to a Python value, for the C type that the model's tree describes.

    A single number needs no array, so neither NumPy nor its dtype is used for it.
    >>> decoder_of({"scalar": "float"})(bytes([0, 0, 0, 63]))
    0.5
    """
    if "scalar" in tree:
        unpack = struct.Struct(_FORMATS[tree["scalar"]]).unpack
        return lambda data: unpack(data)[0]
    dtype = dtype_of(tree)
    return lambda data: from_bytes(data, dtype)


def plain(value: Any, what: str = "the value") -> Any:
    """Converts a value to a form that JSON can represent: numbers, text, lists and dictionaries. `what` names the value in refusals.
    >>> plain(np.array([1.0, 2.0])), plain((1, True)), plain("20 ms")
    ([1.0, 2.0], [1, True], '20 ms')
    """
    kind = type(value)
    if kind in _TEXT_OR_WHOLE or (kind is float and math.isfinite(value)):
        return value
    if kind is list or kind is tuple:
        return [plain(v, what) for v in value]
    if is_masked(value):
        first = int(np.flatnonzero(np.ma.getmaskarray(value))[0])
        masked = "a masked value" if np.ndim(value) == 0 else f"an array whose element {first} (from 0) is masked"
        refuse(ValueRefused, f"{what} is {masked}, which has no value", "give every element a value: .filled(…)")
    value = number(value)
    if isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        if not math.isfinite(value):
            refuse(ValueRefused, f"{what} must be finite, not {value}")
        return value
    if is_record(value):
        return {name: plain(value[name], f"{what}: '{name}'") for name in value.dtype.names or ()}
    if is_array(value) and value.dtype == float and value.ndim and np.isfinite(value).all():
        # Converting thousands of numbers one by one takes half a second.
        return value.tolist()
    if is_array(value) and value.dtype.names is not None:
        return plain(value[()], what) if value.ndim == 0 else [plain(v, what) for v in value]
    listed = rows(value)
    if listed is not value:
        return plain(listed, what)
    if isinstance(value, Mapping):
        return {str(name): plain(v, f"{what}: '{name}'") for name, v in value.items()}
    if isinstance(value, Iterable):
        return [plain(v, what) for v in value]
    remedy = "pass numbers, strings with a unit, sequences, dictionaries or NumPy arrays"
    refuse(ValueRefused, f"{what} cannot be {value!r}", remedy)


def to_json(value: Any, what: str = "the value") -> str:
    """Returns the JSON text of a value. `what` names the value in refusals."""
    return json.dumps(plain(value, what))


def lively(value: Any) -> Any:
    """Converts a JSON value to its Python form: a list of numbers becomes an array.
    >>> lively([1.0, 2.0])
    array([1., 2.])
    """
    if isinstance(value, list):
        if value and all(isinstance(v, int | float) for v in value):
            return np.array(value)
        if value and all(isinstance(v, list) for v in value):
            return np.array(value)
        return [lively(v) for v in value]
    if isinstance(value, dict):
        return {name: lively(v) for name, v in value.items()}
    return value
