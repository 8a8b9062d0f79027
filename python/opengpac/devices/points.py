# SPDX-License-Identifier: Apache-2.0
"""Taught points of an arm, in a text file that people may edit: its comments and order stay."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import math
import os
import threading
from collections.abc import Iterator, Mapping, MutableMapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit
from tomlkit.exceptions import TOMLKitError

from .. import _native, checking
from ..errors import CallError, FileFailed, InvalidState, NotEnabled, UnknownName, ValueRefused, did_you_mean, refuse
from ..refusals.argument_types import all_taking
from ..storage import files
from ..values.numbers import number
from .groups import Group
from .logical import LogicalDevice

FORMAT = 1


class Point(Mapping[str, float]):
    """A taught point: joint → rad (m for a sliding joint). A goal of a motion: `move(arm, goal=points["pick"])`.

    Made by `points["pick"]` and `points.teach("pick")`; `name` is its own in the file. `frame` is what the numbers are: `joints`;
    `note` is for people.
    """

    def __init__(self, name: str, joints: Mapping[str, float], frame: str, note: str) -> None:
        self.name, self.frame, self.note = name, frame, note
        self._joints = dict(joints)

    @property
    def array(self) -> np.ndarray:
        """The positions in the arm's order."""
        return np.array([*self._joints.values()])

    def __getitem__(self, joint: str) -> float:
        if joint not in self._joints:
            refuse(UnknownName, f"point '{self.name}' has no joint '{joint}'", did_you_mean(str(joint), self._joints))
        return self._joints[joint]

    def __iter__(self) -> Iterator[str]:
        return iter(self._joints)

    def __len__(self) -> int:
        return len(self._joints)

    def __repr__(self) -> str:
        joints = ", ".join(f"{joint} {value:.4g}" for joint, value in self._joints.items())
        return f"point {self.name}: {joints}{f' ({self.note})' if self.note else ''}"


@all_taking
class Points(MutableMapping[str, Point]):
    """The taught points of a file: `points = gpac.Points("points.toml", arm)`, `points.teach("pick")`, `points["pick"]`.

    A mapping of names (any text that is not empty) to `Point`: a position for each joint, in rad, or m for a sliding joint.

    `path` is a TOML file, which the first change makes. `arm` is the arm that is taught, a group of joints or one joint; without it a
    method is given one. The file says whose points they are: joints, units, and what identifies the model; `any_model=True` takes the
    points of another model with the same joints.

    Each change is written at once, whole or not at all, and changes that an editor made meanwhile are read first. Several threads of a
    program may use one `Points`.

    Raises `FileFailed` for a file that cannot be read, written or understood, with its line, `ValueRefused` for points of another
    arm, and `UnknownName` for a point or joint that is not there.
    """

    def __init__(self, path: str | os.PathLike[str], arm: Group[Any] | LogicalDevice | None = None, *, any_model: bool = False) -> None:
        self.path = Path(path).expanduser().absolute()
        self._arm = None if arm is None else _group(arm)
        self._any_model = any_model
        self._lock = threading.RLock()
        self._text: str | None = None
        self._document = _new()
        self._unsaved = False
        self._refresh()

    # ---- changes ----

    def teach(self, name: str, arm: Group[Any] | LogicalDevice | None = None, *, note: str | None = None) -> Point:
        """Takes the present position of the arm, which must be enabled, as that point. A point of that name is taught again.

        `note` is for people. Raises `NotEnabled` where a joint is not enabled, `CallError` where no arm is given here or to `Points`.
        """
        given = self._arm if arm is None else _group(arm)
        if given is None:
            refuse(CallError, f"point '{name}' is taught without an arm", "say of which: points.teach('pick', arm)")
        blind = [device.name for device in given if device.state not in ("standstill", "moving")]
        if blind and not checking.active():
            refuse(
                NotEnabled, f"cannot teach point '{name}': {', '.join(blind)} is not enabled, nobody knows where it is", "enable it first"
            )
        joints = dict(zip([device.short_name for device in given], given.values("sensed"), strict=True))
        taught = None if given.system.virtual else datetime.now(UTC).replace(microsecond=0)
        with self._lock:
            self._refresh()
            self._take_arm(given)
            self._put(name, joints, note, taught)
            return self[name]

    def edit(self, name: str, joints: Mapping[str, float] | None = None, *, note: str | None = None) -> Point:
        """Changes some joints of the point of that name, `points.edit("pick", {"elbow": 1.2})`, or its note."""
        with self._lock:
            self._refresh()
            point = self[name]
            wrong = next((joint for joint in joints or {} if joint not in point), None)
            if wrong is not None:
                refuse(UnknownName, f"point '{name}' has no joint '{wrong}'", did_you_mean(str(wrong), point))
            self._put(name, {**point, **(joints or {})}, note, None)
            return self[name]

    def rename(self, name: str, to: str) -> None:
        """Gives a point another name, `to`; refused with `ValueRefused` where there is one of that name."""
        with self._lock:
            self._refresh()
            _ = self[name]
            _named(to)
            table = self._table()
            if to in table:
                refuse(
                    ValueRefused, f"cannot rename point '{name}': there is a point '{to}' already", f"delete it first: del points['{to}']"
                )
            entries = [(to if key == name else key, table[key]) for key in list(table)]
            for key in list(table):
                del table[key]
            for key, entry in entries:
                table[key] = entry
            self.save()

    def __setitem__(self, name: str, joints: Point | Mapping[str, float] | Sequence[float]) -> None:
        """`points["home"] = [0, 0, …]` in the arm's order, in rad, or joint → rad."""
        with self._lock:
            self._refresh()
            if not self._document["arm"]["joints"]:  # type: ignore[index]
                if self._arm is None:
                    refuse(CallError, f"point '{name}' is of no arm", "say of which: gpac.Points(path, arm)")
                self._take_arm(self._arm)
            names = self.joints
            if not isinstance(joints, Mapping):
                if isinstance(joints, str) or len(joints) != len(names):
                    refuse(ValueRefused, f"point '{name}' is given {joints!r}", f"give {len(names)} numbers: {', '.join(names)}")
                joints = dict(zip(names, joints, strict=True))
            if set(joints) != set(names):
                wrong = next((joint for joint in joints if joint not in names), None)
                remedy = did_you_mean(str(wrong), names) if wrong else f"give each of {', '.join(names)}; edit() changes some"
                refuse(UnknownName, f"point '{name}' is given {', '.join(map(str, joints)) or 'nothing'}", remedy)
            self._put(name, {joint: joints[joint] for joint in names}, getattr(joints, "note", None), None)

    def __delitem__(self, name: str) -> None:
        with self._lock:
            self._refresh()
            _ = self[name]
            del self._table()[name]
            self.save()

    def save(self) -> None:
        """Writes the file. Every change does; call it when one could not, for want of room, to try again."""
        with self._lock:
            self._unsaved = True
            text = tomlkit.dumps(self._document)
            files.write(self.path, text, "the points file")
            self._text, self._unsaved = text, False

    # ---- looking ----

    @property
    def joints(self) -> list[str]:
        """The joints of the arm that they are of."""
        return [str(joint) for joint in self._document["arm"]["joints"]]  # type: ignore[index,union-attr]

    @property
    def model(self) -> str:
        """Identifier of the model of the arm that they are of; empty while there is none."""
        return str(self._document["arm"]["model"])  # type: ignore[index]

    def __getitem__(self, name: str) -> Point:
        with self._lock:
            self._refresh()
            table = self._table()
            if name not in table:
                refuse(UnknownName, f"there is no point '{name}' in '{self.path}'", did_you_mean(str(name), table))
            entry = table[name]
            factors = dict(zip(self.joints, self._factors(), strict=True))
            joints = {joint: float(entry["joints"][joint]) * factor for joint, factor in factors.items()}
            return Point(name, joints, str(entry.get("frame", "joints")), str(entry.get("note", "")))

    def _names(self) -> list[str]:
        with self._lock:
            self._refresh()
            return [str(name) for name in self._table()]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names())

    def __len__(self) -> int:
        return len(self._names())

    def __contains__(self, name: object) -> bool:
        return name in self._names()

    def __repr__(self) -> str:
        points = "".join(f"\n  {self[name]!r}" for name in self)
        return f"points of '{self.path}' ({', '.join(self.joints) or 'no arm yet'}):{points or ' none'}"

    # ---- the file ----

    def _table(self) -> Any:
        return self._document["points"]

    def _factors(self) -> list[float]:
        return [_factor(unit) or 1.0 for unit in self._document["arm"]["units"]]  # type: ignore[index,union-attr]

    def _refresh(self) -> None:
        """Reads the file where it is not what was read or written last."""
        if self._unsaved:
            return
        text = files.read(self.path, "the points file")
        if text is None or text == self._text:
            return
        document = _parsed(text, self.path)
        if self._arm is not None:
            self._check_model(self._arm, document)
        self._document, self._text = document, text

    def _take_arm(self, arm: Group[Any]) -> None:
        table: Any = self._document["arm"]
        if table["joints"]:
            self._check_model(arm, self._document)
            return
        table["name"], table["model"] = arm.name, model_of(arm)
        table["joints"] = [device.short_name for device in arm]
        table["units"] = [device.sensed.unit for device in arm]

    def _check_model(self, arm: Group[Any], document: Any) -> None:
        of, joints = document["arm"], [device.short_name for device in arm]
        if not of["joints"]:
            return
        if list(of["joints"]) != joints:
            says = f"the points of '{self.path}' are of {', '.join(of['joints'])}; arm '{arm.name}' has {', '.join(joints)}"
            refuse(ValueRefused, says, "take the file of this arm")
        if not self._any_model and of["model"] != model_of(arm):
            says = f"the points of '{self.path}' were taught with another model of arm '{of['name']}' than that of '{arm.name}'"
            refuse(ValueRefused, says, "take the file of this arm; if the joints mean the same: gpac.Points(path, arm, any_model=True)")

    def _put(self, name: str, joints: Mapping[str, float], note: str | None, taught: datetime | None) -> None:
        _named(name)
        inline = tomlkit.inline_table()
        for (joint, value), factor in zip(joints.items(), self._factors(), strict=True):
            value = number(value)
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                refuse(ValueRefused, f"joint '{joint}' of point '{name}' is given {value!r}", "give a finite number, in rad or m")
            inline[joint] = round(float(value) / factor, 9)
        table = self._table()
        if name not in table:
            table[name] = tomlkit.table()
            table[name]["frame"] = "joints"
        table[name]["joints"] = inline
        if note is not None:
            table[name]["note"] = note
        if taught is not None:
            table[name]["taught"] = taught
        self.save()


@functools.lru_cache
def _factor(unit: Any) -> float | None:
    """Returns the value in rad or m of a unit in the file; Any other unit has none. A number without a unit is as it is."""
    for si in ("rad", "m") if isinstance(unit, str) and unit else ():
        with contextlib.suppress(_native.Refused):
            return _native.number_in(f"1 {unit}", si)
    return 1.0 if unit == "" else None


def model_of(arm: Group[Any]) -> str:
    """Returns the identifier of an arm's mechanics: the model file that it was loaded from, else its joints, their types and units."""
    if arm.model:
        return arm.model
    said = [(device.definition_name(), device.short_name, device.sensed.unit) for device in arm]
    return "joints:" + hashlib.sha256(repr(said).encode()).hexdigest()[:32]


def _group(arm: Any) -> Group[Any]:
    group = Group(arm.short_name, arm) if isinstance(arm, LogicalDevice) else arm
    if not isinstance(group, Group):
        refuse(CallError, f"points are given the arm {arm!r}", "give a group of joints")
    lacking = [device.name for device in group if "sensed" not in device.svv_members()]
    if lacking:
        refuse(InvalidState, f"points cannot be taught with {', '.join(lacking)}", "its type has no SVV 'sensed'")
    return group


def _named(name: Any) -> None:
    if not isinstance(name, str) or not name.strip():
        refuse(CallError, f"the name of a point is {name!r}", "give a name, for example 'pick'")


def _new() -> Any:
    document = tomlkit.document()
    document.add(tomlkit.comment("Taught points. You may edit this file: comments and order stay."))
    document["format"] = FORMAT
    document["arm"] = {"name": "", "model": "", "joints": [], "units": []}
    document["points"] = {}
    return document


def _parsed(text: str, path: Path) -> Any:
    """The document of a file whose every number can be used."""
    try:
        document: Any = tomlkit.parse(text)
    except TOMLKitError as error:
        refuse(FileFailed, f"the points file '{path}' cannot be read: {str(error).lower()}", "mend that line; nothing was changed")
    wrong = _wrong(document)
    if wrong:
        refuse(FileFailed, f"the points file '{path}' cannot be used: {wrong}", "mend it; nothing was changed")
    return document


def _wrong(document: Any) -> str:
    """Returns what is wrong with a document, or nothing."""
    if document.get("format") != FORMAT:
        return f"its format is {document.get('format')!r}, this version reads {FORMAT}"
    arm, points = document.get("arm"), document.get("points")
    if not isinstance(arm, Mapping) or not isinstance(points, Mapping):
        return "it needs the tables [arm] and [points]"
    for key, kind in (("name", str), ("model", str), ("joints", list), ("units", list)):
        if not isinstance(arm.get(key), kind):
            return f"'{key}' of [arm] is missing"
    if len(arm["joints"]) != len(arm["units"]):
        return f"[arm] has {len(arm['joints'])} joints and {len(arm['units'])} units"
    unknown = next((unit for unit in arm["units"] if _factor(unit) is None), None)
    if unknown is not None:
        return f"[arm] has the unit '{unknown}', which is none of an angle or a length: write rad, deg, m or mm"
    return next((f"point '{name}': {why}" for name, entry in points.items() if (why := _wrong_point(entry, arm["joints"]))), "")


def _wrong_point(entry: Any, joints: Sequence[str]) -> str:
    if not isinstance(entry, Mapping) or not isinstance(entry.get("joints"), Mapping):
        return "it has no 'joints = { … }'"
    if entry.get("frame", "joints") != "joints":
        return f"its frame is '{entry['frame']}', this version knows 'joints'"
    for joint in entry["joints"]:
        if joint not in joints:
            return f"'{joint}' is no joint of the arm; {did_you_mean(str(joint), joints)}"
    for joint in joints:
        value = entry["joints"].get(joint)
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            return f"joint '{joint}' is {'missing' if value is None else f'{value!r}, not a finite number'}"
    return ""
