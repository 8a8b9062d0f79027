# SPDX-License-Identifier: Apache-2.0
"""One exception class for each kind of refusal, and `Terminated` for a verb that ended otherwise than it should.

Every class derives from `Error`. A message is lower case, names both ends, says the next step where it is known, and ends with
the place in your program: `at FILE:LINE`.
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
    """One of the ends that a refusal is about."""

    what: str
    place: Place | None


class Error(ShortTraceback):
    """Refusal by OpenGPAC. `message`, `remedy`, `ends`, `place` (file and line in your program) say what, why and where.

    `where` has the parts of a definition that it is about, as an editor draws them: `{"block": "filter", "port": "u"}`.
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
        """The file of your program that it is about."""
        return self.place.file if self.place else None

    @property
    def line(self) -> int | None:
        """The line in that file."""
        return self.place.line if self.place else None

    def __str__(self) -> str:
        text = f"{self.message}; {self.remedy}" if self.remedy else self.message
        return f"{text} at {self.place.file}:{self.place.line}" if self.place else text


class DefinitionError(Error):
    """A word, number or structure that cannot be read, or a definition that is not of the right form."""


class CompositionConflict(DefinitionError):
    """Parts of a composed verb that do not go together; the message names both and says what to do."""


class UnknownName(Error, LookupError, AttributeError):
    """No block, port, list, condition, parameter, source or device has that name."""


class TypeMismatch(Error):
    """Two ends of a binding have different C types."""


class UnitMismatch(Error):
    """Two ends of a binding have different units, or a quantity has another dimension."""


class CoverError(Error):
    """A data node that no parameter covers, or that two cover."""


class SecondWriter(Error):
    """A second writer of an SVV or channel; the message names the one that holds it."""


class SchedulingError(Error):
    """Modes, rates, intervals or triggers that cannot hold."""


class SynchronousCycle(SchedulingError):
    """A cycle of synchronous ports: none of its blocks could ever be the first."""


class PlacementError(Error):
    """No interrupt source, two equal candidates, or a device on another processor."""


class ValueRefused(Error, ValueError):
    """A value that does not fit its type, unit or range."""


class OutOfRange(ValueRefused):
    """A value outside the range that is declared for it: the message names the device, the value and the range."""


class NotHomed(Error):
    """A motion to a position of a joint that does not know where it is: `gpac.motion.home` comes first."""


class CallError(Error, TypeError):
    """Wrong arguments of a call."""


class NotEnabled(Error):
    """A verb was applied to a logical device that is not enabled."""


class InvalidState(Error):
    """A call that the state of an instance, device or system does not allow. Nothing has changed."""


class ModuleError(Error):
    """A code module that cannot be built or loaded."""


class DeviceFailed(Error):
    """A physical device that cannot be opened or has stopped answering."""


class EmergencyStopped(Error):
    """An emergency stop is latched: `reset()` comes first."""


class InUse(Error):
    """Something of that name exists and is in use."""


class InstallationErrors(Error):
    """Several things are wrong at once: `.errors` holds them all, each of its own class."""

    def __init__(self, errors: Sequence[Error]) -> None:
        self.errors = list(errors)
        lines = "".join(f"\n  {number}. {type(e).__name__}: {e}" for number, e in enumerate(self.errors, 1))
        super().__init__(f"{len(self.errors)} things are wrong:{lines}")

    def __reduce__(self) -> tuple[Any, ...]:
        return (InstallationErrors if type(self) is InstallationErrors else several), (self.errors,)


class FileFailed(Error):
    """A file of taught points or of a restart that cannot be read, written or used. The file is as it was."""


class Unreachable(Error):
    """A pose that an arm cannot have, or a way that it cannot go: out of reach, out of a joint's range, or through a singularity."""


class ConnectionLost(Error, ConnectionError):
    """A remote real-time system does not answer. What runs there follows its policy; `gpac.connect` with the same name takes it up."""


class NotCommanding(Error):
    """Another session commands the system; the message names it. Any session may watch."""


class SessionLost(ConnectionLost):
    """The session has ended, or another one has taken it up. What runs there follows its policy."""


class VersionMismatch(Error):
    """The package here and the system there are of versions that do not understand each other."""


class LimitExceeded(Error):
    """A request that is too large, or one of too many."""


class AuditFailed(Error):
    """The remote system cannot write its audit log, and accepts no change until it can."""


class NotAllowed(Error, PermissionError):
    """The remote system does not let you do this: no token, a wrong one, or one of a lesser role."""


class Terminated(Error):
    """A verb instance ended by a condition that is not normal. Derive from it to give a condition an exception of its own.

    `verb`, `instance`, `condition`, `command_list`, `block`, `time` (s), `value`, `outputs`, `others` and `report` say how;
    `objects` are the logical devices that the verb was applied to, by name.
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
        # Its devices stay where they are: they are handles of a system in this process.
        return _again, (type(self), self.args, {**self.__dict__, "objects": {}})

    def explanation(self) -> str:
        """Returns the meaning of the condition here, for the end of the message; a class of its own may say it."""
        return ""


class TimeLost(Terminated):
    """More time was lost at once than the joints' `max_gap`: releases were skipped. The joints have come to rest
    from where they were by then.

    `value` is the time that was lost, s.
    """


def _again(kind: type[Error], args: tuple[Any, ...], state: Mapping[str, Any]) -> Error:
    """An error that was pickled or copied."""
    error = kind.__new__(kind, *args)
    error.__dict__.update(state)
    return error


def gone(error: Error) -> str:
    """Returns why something cannot show what it is now: for its `repr`, which never raises."""
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
"""The classes of what the real-time system refuses."""


def _place(given: Mapping[str, Any] | None) -> Place | None:
    return Place(given["file"], given["line"]) if given else None


def from_refusals(text: str) -> Error:
    """The exception for the refusals of one call: its own class for one, `InstallationErrors` for several."""
    errors = [_from_refusal(refusal) for refusal in json.loads(text)]
    for error in errors:
        _locate(error)
    return errors[0] if len(errors) == 1 else several(errors)


def _locate(error: Error) -> None:
    """Gives an error the line of the user's program. Where a definition of this package is refused that is the line which uses it, and
    where the definition stands is one of the ends.
    """
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
    """Several errors as one: of the class that they share too, so that `except NotEnabled` catches an arm of six joints."""
    kinds = {type(error) for error in errors}
    if len(kinds) != 1 or Error in kinds:
        return InstallationErrors(errors)
    kind = kinds.pop()
    if kind not in _BOTH:
        _BOTH[kind] = type("InstallationErrors", (InstallationErrors, kind), {"__module__": __name__})
    return _BOTH[kind](errors)


class _Refusals:
    """`with refusals:` raises what the real-time system refuses as the exception of its class."""

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: object) -> None:
        if error is None or isinstance(error, Error):
            return
        if isinstance(error, _native.Refused):
            raise from_refusals(error.args[0]) from None
        if isinstance(error, TypeError | OverflowError | UnicodeError):
            # What does not even get there: the real-time system takes texts, whole numbers of so many bits, and so on.
            refuse(CallError, _unfit(error), "look at the call's description: help(...)")
        if type(error).__name__ == "PanicException":
            # A panic is no `Exception`: a handler of errors would lose it, and a `finally` with it.
            refuse(Error, f"a call failed through a fault of OpenGPAC itself: {error}", "please report it; the system may be unusable now")


refusals = _Refusals()

_WORDS = {
    "str": "a text",
    "int": "a whole number",
    "float": "a number",
    "bool": "True or False",
    "PyString": "a text",
    "PyInt": "a whole number",
}


def _unfit(error: Exception) -> str:
    """Returns, in words, why an argument does not fit into a call of the real-time system."""
    text = str(error)
    if isinstance(error, OverflowError):
        return "a number that is given is out of the range that the call takes"
    if isinstance(error, UnicodeError):
        return "a text that is given is no valid Unicode: half of a surrogate pair cannot be written down"
    found = re.search(r"Object of type (\w+) is not JSON serializable", text)
    if found:
        return f"a value of type {found[1]} is given, which no real-time system could take"
    found = re.search(r"'(\w+)' object (?:is not an instance of|cannot be \w+ (?:as|to)(?: an?)?) '?(\w+)", text)
    if found:
        return f"a value of type {found[1]} is given where {_WORDS.get(found[2], found[2])} belongs"
    return f"a value that is given is of a type that the call does not take ({text})"


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Returns `did you mean 'near'?` with the known name near `word`, else the names that there are (at most eight), else nothing."""
    # Half of a surrogate pair is near to nothing, and the core takes none.
    return _native.did_you_mean(str(word).encode(errors="replace").decode(), [str(name) for name in known])


def refuse(kind: type[Error], message: str, remedy: str = "") -> NoReturn:
    """Raises `kind` with the place in the user's program that made the call."""
    raise kind(message, remedy=remedy, place=here()) from None
