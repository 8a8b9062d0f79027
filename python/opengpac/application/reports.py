# SPDX-License-Identifier: Apache-2.0
"""End reports: the outcome of a start of a verb instance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from ..errors import Terminated, TimeLost, did_you_mean
from ..refusals.source_location import here, packaged
from ..values.encoding import lively
from ..values.tables import Table, TableDisplay

if TYPE_CHECKING:
    from ..definition.verbs import Verb


class OtherCondition(NamedTuple):
    """Condition that occurred in the same firing but caused no transition."""

    condition: str
    block: str | None
    time: float


class PassedList(NamedTuple):
    """Command list that the instance left because of a condition, `time` s after the start."""

    command_list: str
    condition: str
    block: str | None
    time: float


class Report(TableDisplay):
    """Report of a verb: `condition`, `time` (s since its start), `value`, `others`, and an attribute for each returned output.

    A call returns it when the instance ends; afterwards it is available as `vi.report`.

    - `condition`: the termination condition, of the verb or of the system (`completed`, `halted`, `fault`, …); `normal` is True for a
      normal end; `message` is the text of a fault, otherwise empty.
    - `time`: the duration, in s; `started` and `ended` are times of the system's clock, in s.
    - `value`: the value that the condition reported, of its type (a number, an array, a record), or None. `others` are the conditions
      that occurred in the same firing without effect.
    - `way`: the transitions that led to the end, in order (the last 64): each has `command_list`, `condition`, `block`, `time`.
    - `outputs`: the outputs returned by the condition and by earlier transitions, by name; the latest for each name. A scalar is a
      number, an array a NumPy array of the port's shape, a struct a record, each in the port's unit. Each output is also an attribute.
    - `verb`, `instance`, `command_list`, `block`: where it ended; `block` is the label of the block that reported the condition, or None.
    - `start`: number of the start of the instance, from 1.

    To give a verb's outputs types, derive a class: `class Moved(gpac.Report): position: np.ndarray`, and `def move(...) -> Moved`.
    """

    condition: str
    time: float
    value: Any
    others: tuple[OtherCondition, ...]
    way: tuple[PassedList, ...]
    verb: str
    instance: str
    command_list: str
    block: str | None
    started: float
    ended: float
    normal: bool
    message: str
    start: int
    outputs: Mapping[str, Any]

    def __init__(self, given: Mapping[str, Any]) -> None:
        self.condition = given["condition"]
        self.ended = given["time_s"]
        self.started = given.get("started_s", 0.0)
        self.time = self.ended - self.started
        self.value = lively(given.get("value"))
        others, way = given.get("others") or (), given.get("way") or ()
        self.others = tuple(OtherCondition(o["condition"], o.get("block"), o["time_s"] - self.started) for o in others)
        self.way = tuple(PassedList(p["command_list"], p["condition"], p.get("block"), p["time_s"] - self.started) for p in way)
        self.verb = given["verb"]
        self.instance = given["instance"]
        self.command_list = given.get("command_list") or ""
        self.block = given.get("block")
        self.normal = given["normal"]
        self.message = given.get("message") or ""
        self.start = given.get("start", 0)
        self.outputs = {name: lively(value) for name, value in given.get("outputs", {}).items()}

    def __getattr__(self, name: str) -> Any:
        outputs = self.__dict__.get("outputs", {})
        if name in outputs:
            return outputs[name]
        how = f"condition '{self.__dict__.get('condition')}' of verb '{self.__dict__.get('verb')}'"
        raise AttributeError(f"{how} returned no output '{name}'; {did_you_mean(name, outputs) or 'it returns none'}")

    def __repr__(self) -> str:
        outputs = "".join(f", {name}={value!r}" for name, value in self.outputs.items())
        value = "" if self.value is None else f", value={self.value!r}"
        return f"{type(self).__name__}({self.verb}: {self.condition} after {self.time:.6g} s{value}{outputs})"

    def _table(self) -> Table:
        rows = [("verb", self.verb), ("instance", self.instance), ("condition", self.condition), ("time", f"{self.time:.6g} s")]
        rows += [("value", str(self.value))] if self.value is not None else []
        rows += [("message", self.message)] if self.message else []
        rows += [(name, str(value)) for name, value in self.outputs.items()]
        rows += [("way", " → ".join(f"{p.command_list} {p.condition}" for p in self.way))] if self.way else []
        rows += [(f"also {o.condition}", f"after {o.time:.6g} s{f' by {o.block}' if o.block else ''}") for o in self.others]
        return Table("end report", ["what", "is"], rows, ["", "", "good" if self.normal else "bad"])

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.outputs]


R = TypeVar("R")


_RAISED: dict[str, type[Terminated]] = {"time_lost": TimeLost}
"""Default exception classes of system conditions, used if the verb does not name one."""


def terminated(report: Report, verb: Verb[..., Any], objects: Mapping[str, Any] | None = None) -> Terminated:
    """Returns the exception for an abnormal end, of the class that the verb assigns to this condition. `objects` are the verb's objects."""
    termination = verb.termination(report.condition, report.command_list)
    kind = (termination.raises if termination else None) or _RAISED.get(report.condition, Terminated)
    where = f" in command list '{report.command_list}'" if report.command_list else ""
    block = f", reported by block '{report.block}'" if report.block else ""
    value = f" with value {report.value}" if report.value is not None else ""
    detail = f": {report.message}" if report.message else ""
    if report.way and report.way[-1].condition != report.condition:
        detail = f"; this followed '{report.way[-1].condition}' in list '{report.way[-1].command_list}'{detail}"
    error = kind(
        f"verb instance '{report.instance}' ended with '{report.condition}'{value}{where} after {report.time:.6g} s{block}{detail}",
        place=here() if packaged(verb.place) else verb.place,
    )
    error.verb, error.instance, error.condition = report.verb, report.instance, report.condition
    error.command_list, error.block, error.time = report.command_list, report.block, report.time
    error.value, error.outputs, error.others, error.report = report.value, report.outputs, report.others, report
    error.objects = objects or {}
    # The system's own message contains the remedy; a class explains a block's report.
    error.remedy = error.explanation() if report.block or not report.message else ""
    error.message += "".join(thing._said_of_end(report.message) for thing in error.objects.values() if hasattr(thing, "_said_of_end"))
    return error
