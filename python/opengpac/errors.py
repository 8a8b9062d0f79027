# SPDX-License-Identifier: Apache-2.0
"""One exception class for each kind of refusal, and `Terminated` for a verb with an abnormal end.

Every class derives from `Error`. A message is in lower case, names both ends, gives the next step if there is one, and ends with the
location in the user's program: `at FILE:LINE`.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, NoReturn

from . import _native
from .refusals.source_location import Place, here, packaged
from .refusals.tracebacks import ShortTraceback


class End(NamedTuple):
    """One of the objects involved in a refusal."""

    what: str
    place: Place | None


class Error(ShortTraceback):
    """Refusal by OpenGPAC. `message`, `remedy`, `ends` and `place` (file and line in the user's program) describe the error, its remedy,
    the objects involved and its location.

    `where` contains the parts of a definition concerned, for editors: `{"block": "filter", "port": "u"}`.
    """

    def __init__(self, message: str = "", *, remedy: str = "", ends: Sequence[End] = (), place: Place | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.remedy = remedy
        self.ends = tuple(ends)
        self.place = place
        self.where: list[dict[str, Any]] = []

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (type(self), self.args, self.__dict__)

    @property
    def file(self) -> str | None:
        """File of the user's program that the error concerns."""
        return self.place.file if self.place else None

    @property
    def line(self) -> int | None:
        """Line in that file."""
        return self.place.line if self.place else None

    def __str__(self) -> str:
        text = f"{self.message}; {self.remedy}" if self.remedy else self.message
        return f"{text} at {self.place.file}:{self.place.line}" if self.place else text


class DefinitionError(Error):
    """A word, number or structure cannot be parsed, or a definition has the wrong structure."""


class CompositionConflict(DefinitionError):
    """Parts of a composed verb conflict; the message names both parts and the remedy."""


class UnknownName(Error, LookupError, AttributeError):
    """No block, port, list, condition, parameter, source or device with that name exists."""


class TypeMismatch(Error):
    """Two ends of a binding have different C types."""


class UnitMismatch(Error):
    """Two ends of a binding have different units, or a quantity has the wrong dimension."""


class CoverError(Error):
    """A data node is not covered by any parameter, or is covered by two."""


class SecondWriter(Error):
    """An SVV or channel would have a second writer; the message names the holder."""


class SchedulingError(Error):
    """Modes, rates, intervals or triggers are infeasible."""


class SynchronousCycle(SchedulingError):
    """Synchronous ports form a cycle, so that none of the blocks in it can run first."""


class PlacementError(Error):
    """A placement is impossible or ambiguous: no interrupt source, two equal candidates, or a device on another processor."""


class ValueRefused(Error, ValueError):
    """A value violates its type, unit or range."""


class OutOfRange(ValueRefused):
    """A value is outside its declared range; the message names the device, the value and the range."""


class NotHomed(Error):
    """A move to a position needs a joint that has not been homed: run `gpac.motion.home` first."""


class CallError(Error, TypeError):
    """The arguments of a call are wrong."""


class NotEnabled(Error):
    """A verb was applied to a logical device that is not enabled."""


class InvalidState(Error):
    """A call is not allowed in the current state of an instance, device or system; it has changed nothing."""


class ModuleError(Error):
    """A code module cannot be built or loaded."""


class DeviceFailed(Error):
    """A physical device cannot be opened, or has stopped answering."""


class EmergencyStopped(Error):
    """An emergency stop is latched: call `reset()` first."""


class InUse(Error):
    """The name is taken, or the object is in use."""


class InstallationErrors(Error):
    """Several errors at once: `.errors` contains all of them, each with its own class."""

    def __init__(self, errors: Sequence[Error]) -> None:
        self.errors = list(errors)
        lines = "".join(f"\n  {number}. {type(e).__name__}: {e}" for number, e in enumerate(self.errors, 1))
        super().__init__(f"{len(self.errors)} errors were found:{lines}")

    def __reduce__(self) -> tuple[Any, ...]:
        return (InstallationErrors if type(self) is InstallationErrors else several), (self.errors,)


class FileFailed(Error):
    """A points file or restart file cannot be read, written or used. The file is unchanged."""


class Unreachable(Error):
    """An arm cannot reach a pose or follow a path because it is out of reach, outside a joint's range, or leads through a singularity."""


class ConnectionLost(Error, ConnectionError):
    """A remote real-time system does not answer. Its running verbs follow their policies; `gpac.connect` with the same name reconnects."""


class NotCommanding(Error):
    """The system is under the command of another session, which the message names. Any session may watch."""


class SessionLost(ConnectionLost):
    """The session has ended, or another client has taken it over. Its running verbs follow their policies."""


class VersionMismatch(Error):
    """The versions of this package and the remote system are incompatible."""


class LimitExceeded(Error):
    """A request is too large, or too many requests are pending."""


class AuditFailed(Error):
    """The remote system cannot write its audit log, and refuses changes until it can."""


class NotAllowed(Error, PermissionError):
    """The remote system denies permission: the token is missing or wrong, or its role lacks the permission."""


class Terminated(Error):
    """A verb instance ended with a condition that is not normal. Derive from this class to give a condition its own exception.

    `verb`, `instance`, `condition`, `command_list`, `block`, `time` (s), `value`, `outputs`, `others` and `report` describe the end;
    `objects` are the logical devices to which the verb was applied, by name.
    """

    verb: str = ""
    instance: str = ""
    condition: str = ""
    command_list: str = ""
    block: str | None = None
    time: float = 0.0
    value: Any = None
    outputs: Mapping[str, Any] = {}
    others: Sequence[Any] = ()
    report: Any = None
    objects: Mapping[str, Any] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        # The devices are left behind: they are handles of a system in this process.
        return _again, (type(self), self.args, {**self.__dict__, "objects": {}})

    def explanation(self) -> str:
        """Returns the explanation of the condition, which ends the message; derived classes may override it."""
        return ""


class TimeLost(Terminated):
    """Time was lost: releases were skipped for longer than the joints' `max_gap`. The joints have braked to rest from their positions.

    `value` is the lost time, s.
    """


def _again(kind: type[Error], args: tuple[Any, ...], state: Mapping[str, Any]) -> Error:
    """Restores an error when it is unpickled or copied."""
    error = kind.__new__(kind, *args)
    error.__dict__.update(state)
    return error


def gone(error: Error) -> str:
    """Returns the reason why an object cannot show its current state, for use in its `repr`, which never raises."""
    return "deleted" if isinstance(error, UnknownName) else error.message


_CLASSES: dict[str, type[Error]] = {
    c.__name__: c
    for c in (
        CompositionConflict, DefinitionError, UnknownName, TypeMismatch, UnitMismatch, CoverError, SecondWriter, SchedulingError,
        SynchronousCycle, PlacementError, ValueRefused, OutOfRange, NotHomed, CallError, NotEnabled, InvalidState, ModuleError,
        DeviceFailed, EmergencyStopped, InUse, SessionLost, NotCommanding, NotAllowed, LimitExceeded, AuditFailed,
    )
}  # fmt: skip


REFUSALS = tuple(_CLASSES.values())
"""Exception classes of refusals by the real-time system."""


def _place(given: Mapping[str, Any] | None) -> Place | None:
    return Place(given["file"], given["line"]) if given else None


def from_refusals(text: str) -> Error:
    """Returns the exception for the refusals of one call: for a single refusal an exception of its own class, for several
    `InstallationErrors`."""
    errors = [_from_refusal(refusal) for refusal in json.loads(text)]
    for error in errors:
        _locate(error)
    return errors[0] if len(errors) == 1 else several(errors)


def _locate(error: Error) -> None:
    """Locates an error at the line of the user's program. If a definition of this package is refused, that is the line that uses it, and
    the definition is added to the ends."""
    if error.place is None:
        error.place = here()
    elif packaged(error.place) and not packaged(line := here()):
        error.ends = (*error.ends, End("the definition", error.place))
        error.place = line


def _from_refusal(r: Mapping[str, Any]) -> Error:
    ends = [End(e["what"], _place(e.get("place"))) for e in r.get("ends", [])]
    error = _CLASSES.get(r["class"], Error)(r["message"], remedy=r.get("remedy", ""), ends=ends, place=_place(r.get("place")))
    error.where = r.get("where", [])
    return error


_BOTH: dict[type[Error], type[InstallationErrors]] = {}


def several(errors: Sequence[Error]) -> InstallationErrors:
    """Combines several errors into one that also derives from their common class, so that `except NotEnabled` works for an arm of six
    joints."""
    kinds = {type(error) for error in errors}
    if len(kinds) != 1 or Error in kinds:
        return InstallationErrors(errors)
    kind = kinds.pop()
    if kind not in _BOTH:
        _BOTH[kind] = type("InstallationErrors", (InstallationErrors, kind), {"__module__": __name__})
    return _BOTH[kind](errors)


class _Refusals:
    """Context manager `with refusals:` that converts refusals by the real-time system into exceptions of their classes."""

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: object) -> None:
        if error is None or isinstance(error, Error):
            return
        if isinstance(error, _native.Refused):
            raise from_refusals(error.args[0]) from None
        if isinstance(error, TypeError | OverflowError | UnicodeError):
            # The binding rejects the argument before the call: it takes texts, integers of a certain size, and so on.
            refuse(CallError, _unfit(error), "read the description of the call: help(...)")
        if type(error).__name__ == "PanicException":
            # A panic is not an `Exception`: error handlers would miss it.
            refuse(Error, f"a call failed because of a bug in OpenGPAC: {error}", "please report it; the system may be unusable now")


refusals = _Refusals()

_WORDS = {
    "str": "a string",
    "int": "an integer",
    "float": "a number",
    "bool": "True or False",
    "PyString": "a string",
    "PyInt": "an integer",
}


def _unfit(error: Exception) -> str:
    """Returns the reason why an argument does not match a call of the real-time system."""
    text = str(error)
    if isinstance(error, OverflowError):
        return "a number is outside the range that the call accepts"
    if isinstance(error, UnicodeError):
        return "a string is not valid Unicode: it contains an unpaired surrogate"
    found = re.search(r"Object of type (\w+) is not JSON serializable", text)
    if found:
        return f"a value of type {found[1]} cannot be passed to a real-time system"
    found = re.search(r"'(\w+)' object (?:is not an instance of|cannot be \w+ (?:as|to)(?: an?)?) '?(\w+)", text)
    if found:
        return f"a value must be {_WORDS.get(found[2], found[2])}, not of type {found[1]}"
    return f"a value has a type that the call does not accept ({text})"


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Returns `did you mean 'near'?` with the name in `known` closest to `word`; otherwise the known names (at most eight), or an empty
    text."""
    # Half of a surrogate pair resembles nothing, and the core does not accept it.
    return _native.did_you_mean(str(word).encode(errors="replace").decode(), [str(name) for name in known])


def refuse(kind: type[Error], message: str, remedy: str = "") -> NoReturn:
    """Raises `kind` with the location of the call in the user's program."""
    raise kind(message, remedy=remedy, place=here()) from None
