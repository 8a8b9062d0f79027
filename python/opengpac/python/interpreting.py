# SPDX-License-Identifier: Apache-2.0
"""Calls the function of a block that stays in Python, in the process of its processor. `interpreted.c` calls this module through a
pointer."""

from __future__ import annotations

import base64
import ctypes
import pickle
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .items import WIDTHS
from .words import Invocation

KNOWN: dict[str, Callable[..., Any]] = {}
"""Functions of blocks defined in this process; under a virtual clock they are called directly."""

WHAT_MAX = 200
_CALL = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.POINTER(ctypes.c_void_p), ctypes.c_uint64, ctypes.c_int64, ctypes.c_int64)
_kept: list[Any] = []
"""Objects to which the code of blocks points. They are kept for the lifetime of the process, because that code is never unloaded either."""


class Slot(ctypes.Structure):
    """Memory shared with `interpreted.c`."""

    _fields_ = (("call", ctypes.c_void_p), ("payload", ctypes.c_char_p), ("what", ctypes.c_char * (WHAT_MAX + 1)))


def load(at: int) -> None:
    """Restores the function of the block whose slot is at this address."""
    slot = Slot.from_address(at)
    key, forms, pickled = pickle.loads(base64.b64decode(slot.payload))
    function = KNOWN.get(key) or pickle.loads(pickled)
    called = _CALL(_Caller(slot, function, [_Form(*form) for form in forms]))
    _kept.append(called)
    slot.call = ctypes.cast(called, ctypes.c_void_p)


class _Form:
    """Memory layout of an item's value."""

    def __init__(self, name: str, element: str, shape: Sequence[int], written: bool, is_condition: bool) -> None:
        self.name, self.shape, self.written = name, tuple(shape), written
        self.dtype = np.dtype(WIDTHS[element])
        self.size = self.dtype.itemsize * int(np.prod(self.shape))
        self.is_condition = is_condition

    def read(self, at: int) -> Any:
        """Returns the value as a copy, which the function may keep."""
        values = np.frombuffer(ctypes.string_at(at, self.size), self.dtype)
        return values.reshape(self.shape).copy() if self.shape else values[0].item()

    def write(self, at: int, value: Any) -> None:
        """Stores a value. Raises `TypeError` if it does not match the type."""
        values = np.asarray(value)
        if values.shape != self.shape and not (values.size == 1 and not self.shape):
            raise TypeError(f"'{self.name}' has shape {self.shape}, but is assigned shape {values.shape}")
        if not np.can_cast(values.dtype, self.dtype, "same_kind") and not (values.dtype.kind in "iub" and self.dtype.kind in "iuf"):
            raise TypeError(f"'{self.name}' ({self.dtype}) cannot be assigned {values.dtype}")
        packed = np.array(values.reshape(self.shape), self.dtype, order="C")
        if self.dtype.kind in "iu" and not np.array_equal(packed, values.reshape(self.shape)):
            raise TypeError(f"'{self.name}' ({self.dtype}) cannot hold {value!r}")
        ctypes.memmove(at, packed.ctypes.data, self.size)


class _Caller:
    """Calls the block's body."""

    def __init__(self, slot: Slot, function: Callable[..., Any], forms: list[_Form]) -> None:
        self._slot, self._function, self._forms = slot, function, forms
        code = function.__code__
        self._file = code.co_filename
        items = {form.name for form in forms}
        names = code.co_varnames[: code.co_argcount]
        self._invocation = next((name for name in names if name not in items), None)

    def __call__(self, items: Any, number: int, time_ns: int, now_ns: int) -> int:
        try:
            given = {form.name: form.read(items[n]) for n, form in enumerate(self._forms)}
            if self._invocation is not None:
                given[self._invocation] = Invocation(number, time_ns * 1e-9, time_ns, now_ns)
            written = [(n, form) for n, form in enumerate(self._forms) if form.written]
            for (n, form), value in zip(written, self._function(**given), strict=True):
                form.write(items[n], value)
            return 0
        except BaseException as why:
            self._slot.what = self._told(why).encode()[:WHAT_MAX]
            return 1

    def _told(self, why: BaseException) -> str:
        """Returns the exception's text, including the line of the user's code."""
        line, trace = 0, why.__traceback__
        while trace is not None:
            if trace.tb_frame.f_code.co_filename == self._file:
                line = trace.tb_lineno
            trace = trace.tb_next
        where = f"at {self._file.rpartition('/')[2]}:{line}: " if line else ""
        return f"{where}{type(why).__name__}: {why}"
