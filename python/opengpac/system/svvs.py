# SPDX-License-Identifier: Apache-2.0
"""State vector variables: a typed current value, and optionally a history."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from .. import checking
from ..application.arguments import Argument
from ..errors import CallError, Error, NotEnabled, UnknownName, ValueRefused, gone, refusals, refuse
from ..refusals.declared_names import DeclaredNames
from ..values.arrays import np
from ..values.encoding import decoder_of, dtype_of, plain
from ..values.tables import Table, TableDisplay

if TYPE_CHECKING:
    from ..devices.logical import LogicalDevice
    from ..devices.physical import Channel
    from .system import System

T = TypeVar("T")


class Predicate:
    """Comparison of an SVV with a value; `cell.advance(until=joint.sensed > 1.0)` evaluates it after each firing.

    Created by comparing an SVV; `&`, `|` and `~` combine predicates.
    """

    def __init__(self, ask: Callable[[], bool], text: str) -> None:
        self._ask = ask
        self._text = text

    def __call__(self) -> bool:
        """Evaluates the predicate."""
        return self._ask()

    __bool__ = __call__

    def __and__(self, other: Predicate) -> Predicate:
        return Predicate(lambda: self() and other(), f"({self!r} and {other!r})")

    def __or__(self, other: Predicate) -> Predicate:
        return Predicate(lambda: self() or other(), f"({self!r} or {other!r})")

    def __invert__(self) -> Predicate:
        return Predicate(lambda: not self(), f"not {self!r}")

    def __repr__(self) -> str:
        return self._text


class SVV(TableDisplay, DeclaredNames, Argument, Generic[T]):
    """A state vector variable. `value`, `number` and `time` are those of its latest publication; setting `value` writes it.

    Created by `cell.svv(...)`, and by each logical device for the members of its type.

    `value` has the shape of its C type: a number or bool, an array of shape (3,) for `double[3]`, a structured value for a struct;
    its numbers are in `unit`. If the type is a number, a text with a unit can be stored, `"30 deg"`. `number` counts the publications
    from 0, `time` is in s of the system's clock. `history[-100:]` is a structured array, shape (n,), of the most recent values with
    `number`, `time` (s) and `value`. A comparison, `svv > 1.0`, is a predicate for `cell.advance(until=...)`. The object refers to
    the SVV for which it was created; an SVV created later under the name of a deleted one is different, and must be requested again.

    Storing raises `ValueRefused` for a value of the wrong shape or a number that is not finite, `UnitMismatch` for a unit of the
    wrong dimension, `OutOfRange` for a value outside `within`, and `SecondWriter` while a verb instance writes it; every access
    raises `UnknownName` once it is deleted.
    """

    def __init__(self, system: System, name: str) -> None:
        self.system = system
        self.name = name
        self._reading_of: LogicalDevice | None = None

    @functools.cached_property
    def _about(self) -> dict[str, Any]:
        with refusals:
            return self.system._alive().svv_about(self.name)

    @property
    def _asked(self) -> str:
        """Name with the SVV's number, by which the system checks that it is still the same SVV."""
        number = self._about.get("id")
        return self.name if number is None else f"{self.name}@{number}"

    def _named(self) -> str:
        """Returns the name by which a verb binds the SVV. Refuses if another SVV with that name has been created since."""
        known = self.system._svvs.get(self.name, self)
        if known is not self and known._asked != self._asked:
            refuse(UnknownName, f"this SVV '{self.name}' was deleted, and its name is now used by another one", "use the newer one")
        return self.name

    def _argument(self) -> dict[str, Any]:
        return {"svv": self._named()}

    def _is_there(self) -> bool:
        """Returns whether the SVV still exists; another SVV with the same name does not count."""
        try:
            with refusals:
                self.system._alive().svv_about(self._asked)
        except UnknownName:
            return False
        return True

    @functools.cached_property
    def dtype(self) -> np.dtype[Any]:
        """NumPy dtype of the value."""
        return dtype_of(self._about["type"])

    @functools.cached_property
    def _decode(self) -> Callable[[bytes], Any]:
        """Returns a function that decodes the bytes of a value."""
        return decoder_of(self._about["type"])

    @property
    def type(self) -> str:
        """C type of the value."""
        return self._about["type_text"]

    @property
    def unit(self) -> str:
        """Unit of the value, or an empty text."""
        return self._about["unit"]

    def _read(self) -> tuple[Any, int, float]:
        with refusals:
            _, [(data, number, time_ns)] = self.system._alive().read([self._asked])
        return self._decode(data), number, time_ns * 1e-9

    @property
    def value(self) -> T:
        """Latest published value."""
        value, number, time = self._read()
        self._know(number, time)
        return value

    def _know(self, number: int, time: float) -> None:
        """Refuses to read a member of a device that was never enabled, because no value has been read from the machine."""
        device = self._reading_of
        if device is not None and number == 0 and time == 0.0 and device.state == "disabled" and not checking.active():
            refuse(NotEnabled, f"cannot read '{self.name}': '{device.name}' was never enabled, so its value is unknown", "enable it first")

    @value.setter
    def value(self, value: T) -> None:
        with refusals:
            self.system._alive().write(self._asked, plain(value, f"the value for SVV '{self.name}'"))

    @property
    def number(self) -> int:
        """Number of the latest publication."""
        return self._read()[1]

    @property
    def time(self) -> float:
        """Release time of the latest publication, in s of the system's clock."""
        return self._read()[2]

    @property
    def history(self) -> History:
        """Previous values that have been kept."""
        return History(self)

    def delete(self) -> None:
        """Deletes the SVV; refused while a verb or device is bound to it."""
        with refusals:
            self.system._alive().delete_svv(self._asked)

    def _called(self) -> str:
        return f"SVV '{self.name}'"

    def _compare(self, operation: Callable[[Any, Any], Any], sign: str, other: Any) -> Predicate:
        def ask() -> bool:
            right = other.value if isinstance(other, SVV) else other
            found = operation(self.value, right)
            return found if isinstance(found, bool) else bool(np.all(found))

        return Predicate(ask, f"{self.name} {sign} {other.name if isinstance(other, SVV) else other}")

    def __gt__(self, other: Any) -> Predicate:
        return self._compare(operator.gt, ">", other)

    def __ge__(self, other: Any) -> Predicate:
        return self._compare(operator.ge, ">=", other)

    def __lt__(self, other: Any) -> Predicate:
        return self._compare(operator.lt, "<", other)

    def __le__(self, other: Any) -> Predicate:
        return self._compare(operator.le, "<=", other)

    def __bool__(self) -> bool:
        raise TypeError(f"SVV '{self.name}' has no truth value; compare its .value")

    def _table(self) -> Table | None:
        if self.system.closed:
            return None
        value, number, time = self._read()
        columns = ["SVV", "type", "unit", "value", "number", "time"]
        return Table("", columns, [(self.name, self.type, self.unit, value, number, f"{time:.6g} s")])

    def __repr__(self) -> str:
        if self.system.closed:
            return f"SVV {self.name} of the closed system '{self.system.name}'"
        try:
            value, number, time = self._read()
        except Error as error:
            return f"SVV {self.name}: {gone(error)}"
        unit = f" {self.unit}" if self.unit else ""
        return f"SVV {self.name} ({self.type}) = {value!r}{unit}, number {number} at {time:.6g} s"


class History:
    """Most recent values of an SVV. An index or a slice returns a structured array of `number`, `time` (s) and `value`."""

    def __init__(self, svv: SVV[Any]) -> None:
        self._svv = svv

    def __len__(self) -> int:
        return len(self._rows())

    def _rows(self, which: Any = None) -> list[tuple[int, int, bytes]]:
        """Returns the kept values, or at least those selected by `which` if it counts from the newest one."""
        kept = self._svv._about["history"]
        if not kept:
            refuse(ValueRefused, f"SVV '{self._svv.name}' has no history", "create it with history=1000")
        first = which.start if isinstance(which, slice) and which.stop is None and which.step is None else which
        count = min(kept, -first) if isinstance(first, int) and first < 0 else kept
        with refusals:
            return self._svv.system._alive().history(self._svv._asked, count)

    def __getitem__(self, which: int | slice) -> Any:
        dtype = self._svv.dtype
        rows = self._rows(which)
        array = np.zeros(len(rows), dtype=[("number", "<u8"), ("time", "<f8"), ("value", dtype)])
        if rows:
            # Converting thousands of rows one by one takes ten times as long.
            numbers, times_ns, values = zip(*rows, strict=True)
            array["number"], array["time"] = np.array(numbers, "<u8"), np.array(times_ns, "<i8") * 1e-9
            array["value"] = np.frombuffer(b"".join(values), dtype)
        try:
            return array[which]
        except (TypeError, ValueError, OverflowError, KeyError) as error:
            refuse(
                CallError,
                f"the history of '{self._svv.name}' cannot be indexed with {which!r}: {error}",
                "use an index or a slice: history[-100:]",
            )

    def __repr__(self) -> str:
        try:
            return f"history of {self._svv.name}: {len(self)} values"
        except Error as error:
            return f"history of {self._svv.name}: {gone(error)}"


class Snapshot(tuple[Any, ...]):
    """Consistent values of several SVVs: a tuple in the requested order, with their `time` (s) and `numbers`."""

    time: float
    numbers: tuple[int, ...]


def snapshot(system: System, svvs: tuple[SVV[Any] | Channel, ...]) -> Snapshot:
    """Takes one consistent snapshot of these SVVs and channels."""
    time_ns, rows = rows_of(system, svvs)
    for svv, (_, number, row_ns) in zip(svvs, rows, strict=True):
        if isinstance(svv, SVV):
            svv._know(number, row_ns)
    values = Snapshot(value for value, _, _ in rows)
    values.time = time_ns * 1e-9
    values.numbers = tuple(number for _, number, _ in rows)
    return values


def rows_of(system: System, svvs: Sequence[SVV[Any] | Channel]) -> tuple[int, list[tuple[Any, int, int]]]:
    """Reads SVVs and channels in one consistent snapshot. Returns its time in ns, and the value, number and time (ns) of each."""
    with refusals:
        time_ns, rows = system._alive().read([each._asked for each in svvs])
    return time_ns, [(svv._decode(data), number, at_ns) for svv, (data, number, at_ns) in zip(svvs, rows, strict=True)]
