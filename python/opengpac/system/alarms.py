# SPDX-License-Identifier: Apache-2.0
"""Alarms: conditions that are reported to a person until their cause has ended and they have been acknowledged."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from ..errors import CallError, UnknownName, did_you_mean, refusals, refuse
from ..refusals.argument_types import all_taking
from ..refusals.declared_names import DeclaredNames
from ..values.numbers import number
from ..values.quantities import Quantity, duration_ns
from ..values.tables import Table, TableDisplay

if TYPE_CHECKING:
    from .system import System

SEVERITIES = ("low", "medium", "high", "critical")


@dataclass(frozen=True)
class Shelving:
    """One shelving of an alarm, which removes it from the list: `who` shelved it and the `reason`, from `time` to at most `until`.

    Times are in s of the system's clock; `wall` is the date of `time`. `ended` is the time of its end, None while it lasts;
    `ended_by` is the person who ended it, empty if the shelving expired.
    """

    who: str
    reason: str
    time: float
    wall: datetime
    until: float
    ended: float | None
    ended_by: str


@dataclass(frozen=True)
class Alarm:
    """One alarm in its current state: `code`, `source` (verb, device or channel), `block`, `text`, `remedy`, `severity`, times and
    `count`.

    `active` is True while its cause is present. `time`, `returned` and `acknowledged_at` are in s of the system's clock; `wall` is
    the date of `time`. `shelvable` indicates whether `shelve` accepts it. `shelvings` are its shelvings, with person and reason,
    oldest first.
    """

    number: int
    code: str
    source: str
    block: str | None
    text: str
    remedy: str
    severity: str
    active: bool
    acknowledged: bool
    count: int
    time_ns: int
    wall: datetime
    returned: float | None
    acknowledged_at: float | None
    shelvings: tuple[Shelving, ...] = ()
    shelvable: bool = False

    @property
    def time(self) -> float:
        """Time of the latest occurrence, in s of the system's clock."""
        return self.time_ns * 1e-9

    @property
    def state(self) -> str:
        """State: `active`, `acknowledged` (and still active), `returned` (not acknowledged yet), `shelved`, or `over`."""
        if self.shelvings and self.shelvings[-1].ended is None:
            return "shelved"
        if self.active:
            return "acknowledged" if self.acknowledged else "active"
        return "over" if self.acknowledged else "returned"

    def __str__(self) -> str:
        times = f" ({self.count} times)" if self.count > 1 else ""
        remedy = f"; {self.remedy}" if self.remedy else ""
        when = f"{self.number:>4}  {self.time:>10.3f} s  {self.severity:<8}  {self.state:<12}"
        return f"{when}  {self.code}  {self.source}: {self.text}{times}{remedy}"


def _alarm(given: Mapping[str, Any]) -> Alarm:
    seconds: dict[str, Any] = {to: None if given[at] is None else given[at] * 1e-9 for at, to in _TIMES.items()}
    kept: dict[str, Any] = {name: given[name] for name in Alarm.__dataclass_fields__ if name in given}
    kept["shelvings"] = tuple(_shelving(one) for one in given.get("shelvings", []))
    return Alarm(**kept, **seconds, wall=_date(given["wall_ns"]))


def _shelving(given: Mapping[str, Any]) -> Shelving:
    ended = None if given["ended_ns"] is None else given["ended_ns"] * 1e-9
    time, until = given["time_ns"] * 1e-9, given["until_ns"] * 1e-9
    return Shelving(given["who"], given["reason"], time, _date(given["wall_ns"]), until, ended, given["ended_by"])


def _date(wall_ns: int) -> datetime:
    return datetime.fromtimestamp(wall_ns // 1_000 / 1e6, UTC)


_TIMES = {"returned_ns": "returned", "acknowledged_ns": "acknowledged_at"}


@all_taking
class Alarms(TableDisplay, DeclaredNames):
    """Alarms of a system, `cell.alarms`: those that are active or not acknowledged, in the order of their first occurrence.

    Every end of a verb that raises an exception, every device failure and the emergency stop raise an alarm automatically; `define`
    adds user-defined ones. Each access takes a copy of the alarms.
    >>> import opengpac as gpac
    >>> cell = gpac.System("cell", clock="virtual")
    >>> cell.alarms.define("E101", "the magazine is empty", remedy="fill it", severity="low")
    >>> cell.alarms.trip("E101")
    >>> cell.alarms["E101"].state
    'active'
    >>> cell.alarms.acknowledge(), cell.alarms["E101"].state, cell.alarms.clear("E101"), len(cell.alarms)
    (1, 'acknowledged', True, 0)
    """

    def __init__(self, system: System) -> None:
        self._system = system

    def _called(self) -> str:
        return f"the alarms of system '{self._system.name}'"

    def _described(self) -> dict[str, Any]:
        with refusals:
            return self._system._alive().alarms()

    @property
    def history(self) -> list[Alarm]:
        """Past alarms, at most 1,000, oldest first, including those from before a restart of a restored system.

        When the limit is exceeded, the oldest alarms of the most frequent code are removed, so that a chattering alarm does not
        displace others.
        """
        return [_alarm(given) for given in self._described()["history"]]

    @property
    def dropped(self) -> int:
        """Number of alarms that were removed before they were over, because at most 1,000 are kept. The log names them, and the history
        contains them."""
        return self._described().get("dropped", 0)

    @property
    def active(self) -> list[Alarm]:
        """Alarms whose cause is still present."""
        return [alarm for alarm in self if alarm.active]

    @property
    def unacknowledged(self) -> list[Alarm]:
        """Alarms that have not been acknowledged yet."""
        return [alarm for alarm in self if not alarm.acknowledged]

    @property
    def shelved(self) -> list[Alarm]:
        """Alarms that `shelve` has temporarily removed from the list; `len`, iteration and `active` exclude them."""
        return [_alarm(given) for given in self._described().get("shelved", [])]

    @property
    def texts(self) -> Mapping[str, Mapping[str, str]]:
        """Texts defined by `define`: code → text, remedy, severity."""
        return self._described()["texts"]

    def define(self, code: str, text: str, remedy: str = "", *, severity: str = "high") -> None:
        """Defines an alarm with its `code`, `text` and `remedy`; redefining it affects later alarms.

        The alarm is raised by `trip`, or by a verb's condition: `on("force.above", alarm="E101")`. `severity`: low, medium, high or
        critical. A code used by the system itself (`following_error`) can be defined too: its text then precedes the system's.
        """
        for what, given in (("code", code), ("text", text), ("remedy", remedy)):
            if not isinstance(given, str):
                refuse(CallError, f"the {what} of an alarm must be a string, not {given!r}")
        if severity not in SEVERITIES:
            refuse(CallError, f"the severity of alarm '{code}' cannot be {severity!r}", did_you_mean(str(severity), SEVERITIES))
        with refusals:
            self._system._alive().define_alarm({"text": text, "remedy": remedy, "severity": severity}, code)

    def trip(self, code: str, text: str = "", *, source: str = "program") -> None:
        """Raises the alarm `code`, which must be defined; it is active until `clear`. Further calls increment its count."""
        with refusals:
            self._system._alive().raise_alarm(_text(code, "code"), _text(source, "source"), _text(text, "text"))

    def clear(self, code: str, *, source: str | None = None) -> bool:
        """Reports that the cause of an alarm raised by `trip` has ended; returns whether the alarm was active. It remains until it is
        acknowledged."""
        with refusals:
            return self._system._alive().clear_alarm(_text(code, "code"), source)

    def acknowledge(self, alarm: Alarm | int | None = None) -> int:
        """Acknowledges one `alarm`, or all that are not shelved; returns the number of alarms acknowledged. An active alarm remains
        until its cause has ended."""
        which = None if alarm is None else _numbered(alarm, "acknowledge", ", or nothing for all")
        with refusals:
            return self._system._alive().acknowledge_alarms(which)

    def shelve(self, alarm: Alarm | int, reason: str, duration: Quantity) -> None:
        """Removes an `alarm` from the list for a `duration` of the system's clock, at most 24 h, or until `unshelve`.

        It stays shelved even if it recurs. Its `shelvings` record person, time and `reason`. Emergency stops, lost devices and
        processors, and alarms of severity `critical` cannot be shelved (`NotAllowed`).
        """
        for_ns = duration_ns(duration, "the time of a shelving")
        with refusals:
            self._system._alive().shelve_alarm(_numbered(alarm, "shelve"), _text(reason, "reason"), for_ns)

    def unshelve(self, alarm: Alarm | int) -> bool:
        """Returns a shelved `alarm` to the list; returns whether it was shelved."""
        with refusals:
            return self._system._alive().unshelve_alarm(_numbered(alarm, "unshelve"))

    def __iter__(self) -> Iterator[Alarm]:
        return iter([_alarm(given) for given in self._described()["current"]])

    def __len__(self) -> int:
        return len(self._described()["current"])

    def __contains__(self, code: object) -> bool:
        return any(alarm.code == code or alarm == code for alarm in self)

    def __getitem__(self, code: str | int) -> Alarm:
        """Returns the latest alarm with that code, or the alarm with that number."""
        alarms = list(self)
        found = [alarm for alarm in alarms if code in (alarm.code, alarm.number)]
        if not found:
            refuse(UnknownName, f"there is no alarm '{code}'", did_you_mean(str(code), {alarm.code for alarm in alarms}))
        return max(found, key=lambda alarm: alarm.time_ns)

    def __repr__(self) -> str:
        if self._system.closed:
            return f"alarms of the closed system '{self._system.name}'"
        described = self._described()
        lines = [str(_alarm(given)) for given in described["current"]]
        if dropped := described.get("dropped", 0):
            lines.append(f"{dropped} more were dropped before they ended, because the list was full; see .history and the log")
        return "\n".join(lines) if lines else "no alarms"

    def _table(self) -> Table | None:
        if self._system.closed:
            return None
        return _alarm_table(shown) if (shown := [*self]) else None

    def _ipython_key_completions_(self) -> list[str]:
        return [] if self._system.closed else [alarm.code for alarm in self]


def _alarm_table(alarms: Iterable[Alarm]) -> Table:
    """Formats alarms as a table; active ones are red."""
    shown = [*alarms]
    rows = [(a.number, f"{a.time:.3f} s", a.severity, a.state, a.code, a.source, a.text, a.remedy, a.count) for a in shown]
    looks = ["bad" if a.active and not a.acknowledged else "warn" if a.active else "soft" for a in shown]
    return Table("alarms", ["number", "time", "severity", "state", "code", "source", "text", "remedy", "count"], rows, looks)


def _numbered(alarm: Any, what: str, more: str = "") -> int:
    which = number(alarm.number if isinstance(alarm, Alarm) else alarm)
    if isinstance(which, bool) or not isinstance(which, int) or which < 0:
        refuse(
            CallError,
            f"the alarm to {what} must be an alarm or its number, not {alarm!r}",
            f"pass an alarm of this list or its number{more}",
        )
    return which


def _text(given: Any, what: str) -> str:
    if not isinstance(given, str):
        refuse(CallError, f"the {what} of an alarm must be a string, not {given!r}")
    return given
