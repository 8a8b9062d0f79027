# SPDX-License-Identifier: Apache-2.0
"""Steps an FMU in the process of a driver in Python, through ctypes, as required for an FMU with an embedded interpreter."""

from __future__ import annotations

import ctypes
from collections.abc import Iterable, Mapping
from ctypes import CFUNCTYPE, Structure, byref, c_bool, c_char_p, c_double, c_int, c_size_t, c_uint32, c_void_p
from typing import Any, NamedTuple

_CALLOC = CFUNCTYPE(c_void_p, c_size_t, c_size_t)
_FREE = CFUNCTYPE(None, c_void_p)
_LOG_2 = CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p)
_LOG_3 = CFUNCTYPE(None, c_void_p, c_int, c_char_p, c_char_p)
_DONE = CFUNCTYPE(None, c_void_p, c_int)


class _Callbacks(Structure):
    _fields_ = [("logger", _LOG_2), ("allocate", _CALLOC), ("release", _FREE), ("finished", _DONE), ("environment", c_void_p)]


class Whole(NamedTuple):
    """Identity of a variable for the FMU: its reference, function group, and number of elements (0: a scalar)."""

    reference: int
    group: str
    size: int


class FmuInstance:
    """One instance of an FMU, whose values can be set and read, and which can be stepped. Raises `RuntimeError` with the FMU's last log
    message if a call to the FMU fails."""

    def __init__(self, version: int, library: str, name: str, token: str, resources: str) -> None:
        self._version, self._said = version, ""
        self._library = ctypes.CDLL(library)
        libc = ctypes.CDLL(None)
        self._log_2 = _LOG_2(lambda _e, _i, status, _c, text: self._hear(status, text))
        self._log_3 = _LOG_3(lambda _e, status, _c, text: self._hear(status, text))
        allocate, release = ctypes.cast(libc.calloc, _CALLOC), ctypes.cast(libc.free, _FREE)
        self._callbacks = _Callbacks(self._log_2, allocate, release, _DONE(), None)
        text = lambda value: None if not value else value.encode()  # noqa: E731
        if version == 2:
            made = self._function("Instantiate", c_void_p)
            self._unit = made(text(name), c_int(1), text(token), text(resources), byref(self._callbacks), c_int(0), c_int(0))
        else:
            made = self._function("InstantiateCoSimulation", c_void_p)
            off = c_bool(False)
            self._unit = made(text(name), text(token), resources.encode(), off, off, off, off, None, c_size_t(0), None, self._log_3, None)
        if not self._unit:
            raise RuntimeError(f"the FMU rejects instantiation{self._words()}")

    def initialised(self, values: Iterable[tuple[Whole, Any]]) -> None:
        """Initialises the FMU at time 0 with these values."""
        for whole, value in values:
            self.set(whole, value)
        if self._version == 2:
            self._done("SetupExperiment", c_int(0), c_double(0.0), c_double(0.0), c_int(0), c_double(0.0))
            self._done("EnterInitializationMode")
        else:
            self._done("EnterInitializationMode", c_bool(False), c_double(0.0), c_double(0.0), c_bool(False), c_double(0.0))
        self._done("ExitInitializationMode")

    def set(self, whole: Whole, value: Any) -> None:
        """Sets a variable."""
        kind = _kind(self._version, whole.group)
        count = max(1, whole.size)
        values = (kind * count)(*(kind(v).value for v in ([value] if not whole.size else value)))
        more = (c_size_t(count),) if self._version == 3 else ()
        self._done(f"Set{whole.group}", byref(c_uint32(whole.reference)), c_size_t(1), values, *more)

    def get(self, whole: Whole) -> Any:
        """Returns the value of a variable."""
        kind = _kind(self._version, whole.group)
        values = (kind * max(1, whole.size))()
        more = (c_size_t(len(values)),) if self._version == 3 else ()
        self._done(f"Get{whole.group}", byref(c_uint32(whole.reference)), c_size_t(1), values, *more)
        found = [bool(v) if whole.group == "Boolean" else v for v in values]
        return found if whole.size else found[0]

    def step(self, at: float, step: float) -> None:
        """Steps the FMU by `step` from time `at`, s."""
        if self._version == 2:
            self._done("DoStep", c_double(at), c_double(step), c_int(1))
            return
        event, ends, early, last = c_bool(), c_bool(), c_bool(), c_double()
        self._done("DoStep", c_double(at), c_double(step), c_bool(True), byref(event), byref(ends), byref(early), byref(last))
        if ends or early:
            raise RuntimeError(f"the FMU ended its step at {last.value:g} s{self._words()}")

    def close(self) -> None:
        """Frees the instance."""
        if self._unit:
            unit, self._unit = self._unit, None
            self._function("FreeInstance", None)(c_void_p(unit))

    def _function(self, name: str, result: Any = c_int) -> Any:
        try:
            found = getattr(self._library, f"fmi{self._version}{name}")
        except AttributeError:
            raise RuntimeError(f"the FMU's binary has no function fmi{self._version}{name}") from None
        found.restype = result
        return found

    def _done(self, name: str, *arguments: Any) -> None:
        status = self._function(name)(c_void_p(self._unit), *arguments)
        if status > 1:
            raise RuntimeError(f"fmi{self._version}{name} of the FMU returned status {status}{self._words()}")

    def _hear(self, status: int, text: bytes | None) -> None:
        self._said = text.decode(errors="replace") if status > 0 and text else self._said

    def _words(self) -> str:
        return f": {self._said}" if self._said else ""


def _kind(version: int, group: str) -> Any:
    if version == 2:
        return {"Real": c_double, "Integer": c_int, "Boolean": c_int}[group]
    kinds: Mapping[str, Any] = {"Float64": c_double, "Float32": ctypes.c_float, "Boolean": c_bool}
    return kinds[group] if group in kinds else getattr(ctypes, f"c_{group.lower()}")


__all__ = ["FmuInstance", "Whole"]
