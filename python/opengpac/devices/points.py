# SPDX-License-Identifier: Apache-2.0
"""Taught points of an arm, in a text file that can be edited by hand; changes preserve comments and order."""

from __future__ import annotations

import hashlib
import math
import os
import threading
from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import tomlkit

from .. import checking
from ..errors import CallError, FileFailed, InvalidState, NotEnabled, UnknownName, Unreachable, ValueRefused, did_you_mean, refuse
from ..refusals.argument_types import all_taking
from ..storage import files
from ..studio import offered_motions
from ..values.frames import Pose
from ..values.numbers import number
from . import point_file
from .groups import Group
from .logical import LogicalDevice
from .point import JOINTS, WORLD, Point, PointEntry

_WHAT = "the points file"
_SAME = 1e-8
"""Tolerance (m, rad) between the tool's pose at the taught joints and the pose of a point; if the difference is smaller, the taught
joints are used unchanged."""


@all_taking
class Points(MutableMapping[str, Point]):
    """The taught points of a file: `points = gpac.Points("points.toml", arm)`, `points.teach("pick")`, `points["pick"]`.

    A mapping of names (any text that is not empty) to `Point`: a position for each joint, in rad, or m for a prismatic joint. A point
    taught in a frame, `points.teach("pick", frame="table")`, is a point in space: it moves with `points.frames["table"]`, is valid
    for every tool of the arm, and is reached in the configuration in which it was taught.

    `path` is a TOML file, created by the first change. `arm` is the arm that is taught, a group of joints or one joint; without it an
    arm must be passed to each method. The file identifies its arm: joints, units, and an identifier of the model; `any_model=True`
    accepts the points of another model with the same joints.

    Each change is written immediately and atomically, after rereading the file if an editor or another program has changed it. A
    `Points` object is thread-safe.

    Raises `FileFailed` for a file that cannot be read, written or parsed, with its line, `ValueRefused` for points of another arm,
    and `UnknownName` for a point or joint that does not exist.
    """

    def __init__(self, path: str | os.PathLike[str], arm: Group[Any] | LogicalDevice | None = None, *, any_model: bool = False) -> None:
        self.path = Path(path).expanduser().absolute()
        self._arm = None if arm is None else _group(arm)
        self._any_model = any_model
        self._lock = threading.RLock()
        self._seen: str | None = None
        self._document = point_file.new_document()
        self._unwritten: list[Callable[[str], str]] = []
        self._refresh()
        if self._arm is not None and hasattr(self._arm, "kinematics"):
            # A page of the system teaches the points of this file and moves to them.
            self._arm.system._point_files[self._arm.name] = self.path, any_model
            offered_motions.offer_for(self._arm)

    # ---- changes ----

    def teach(
        self,
        name: str,
        arm: Group[Any] | LogicalDevice | None = None,
        *,
        note: str | None = None,
        frame: str = JOINTS,
        tool: str | None = None,
    ) -> Point:
        """Stores the current position of the arm, which must be enabled, as the point `name`; replaces an existing point of that name.

        `frame` makes it a point in space: the pose of the arm's tool in a frame of `frames`, or in the frame of the arm's poses,
        `"world"`. `tool` selects a frame of `tools` to use instead of the arm's current tool. `note` is a free-text comment. Raises
        `NotEnabled` if a joint is not enabled, `CallError` if no `arm` is passed here or to `Points`, `UnknownName` for a frame or
        tool that does not exist, and `InvalidState` for a point in space if the joints do not form an arm.
        """
        given = self._arm if arm is None else _group(arm)
        if given is None:
            refuse(CallError, f"cannot teach point '{name}' without an arm", "pass the arm: points.teach('pick', arm)")
        blind = [device.name for device in given if device.state not in ("standstill", "moving")]
        if blind and not checking.active():
            refuse(
                NotEnabled,
                f"cannot teach point '{name}': the positions of joints that are not enabled are unknown: {', '.join(blind)}",
                "enable them first",
            )
        joints = dict(zip(given.short_names, map(float, given.values("sensed")), strict=True))
        taught = None if given.system.virtual else datetime.now(UTC).replace(microsecond=0)
        _named(name)

        def put(document: Any) -> None:
            self._take_arm(given, document)
            before = point_file.entry_of(document, name) if name in document["points"] else None
            entry = self._placed(document, name, given, PointEntry(joints, frame, tool, taught=taught))
            kept = before.note if before and note is None else note
            point_file.put_entry(document, name, replace(entry, note=kept or "", taught=taught or (before.taught if before else None)))

        self._edit(put)
        return self._point(name, given)

    def edit(self, name: str, joints: Mapping[str, float] | None = None, *, note: str | None = None, pose: Pose | None = None) -> Point:
        """Changes some `joints` of the point `name`, `points.edit("pick", {"elbow": 1.2})`, its `note`, or its `pose` in its frame."""

        def put(document: Any) -> None:
            entry = self._entry(document, name)
            wrong = next((joint for joint in joints or {} if joint not in entry.joints), None)
            if wrong is not None:
                refuse(UnknownName, f"point '{name}' has no joint '{wrong}'", did_you_mean(str(wrong), entry.joints))
            if joints and entry.pose is not None:
                refuse(
                    ValueRefused,
                    f"point '{name}' is stored as a pose in '{entry.frame}', not as joint positions",
                    "edit its pose=, or teach it again",
                )
            if pose is not None and entry.pose is None:
                refuse(
                    ValueRefused,
                    f"point '{name}' is stored as joint positions, not as a pose",
                    f"teach it in a frame: points.teach('{name}', frame=\"world\")",
                )
            entry = replace(
                entry, joints=_checked(name, {**entry.joints, **(joints or {})}), pose=entry.pose if pose is None else Pose.of(pose)
            )
            point_file.put_entry(document, name, entry if note is None else replace(entry, note=note))

        self._edit(put)
        return self[name]

    def rename(self, name: str, to: str) -> None:
        """Renames the point `name` to `to`; raises `ValueRefused` if `to` already exists."""
        _named(to)

        def change(text: str) -> str:
            document = point_file.parsed(text, self.path)
            self._entry(document, name)
            if to in document["points"]:
                refuse(ValueRefused, f"cannot rename point '{name}': point '{to}' already exists", f"delete it first: del points['{to}']")
            done = point_file.renamed(text, name, to)
            written = point_file.parsed(done, self.path)["points"]
            if to in written and name not in written:
                return done
            # The name is written in an unusual form: move the point to the end.
            document["points"][to] = document["points"][name]
            del document["points"][name]
            return tomlkit.dumps(document)

        self._change(change)

    def __setitem__(self, name: str, joints: Point | Mapping[str, float] | Sequence[float]) -> None:
        """Sets a point from joint positions, `points["home"] = [0, 0, …]` in the arm's order (rad), from a mapping joint → rad, or from
        another point, which is copied with its frame."""
        _named(name)

        def put(document: Any) -> None:
            if not document["arm"]["joints"]:
                if self._arm is None:
                    refuse(CallError, f"point '{name}' has no arm", "pass the arm: gpac.Points(path, arm)")
                self._take_arm(self._arm, document)
            names = [str(joint) for joint in document["arm"]["joints"]]
            before = point_file.entry_of(document, name) if name in document["points"] else PointEntry({})
            if isinstance(joints, Point) and list(joints) == names:
                entry = replace(joints._entry, taught=before.taught, note=joints.note or before.note)
                self._frame(document, joints.name, entry.frame)
                self._tool(document, joints.name, entry.tool)
            else:
                entry = PointEntry(_joints_of(name, joints, names), note=before.note, taught=before.taught)
            point_file.put_entry(document, name, entry)

        self._edit(put)

    def __delitem__(self, name: str) -> None:
        def remove(document: Any) -> None:
            self._entry(document, name)
            del document["points"][name]

        self._edit(remove)

    def save(self) -> None:
        """Writes the file. Called by every change; call it yourself to retry after a failed write, for example because the disk was
        full."""
        self._change(lambda text: text)

    # ---- queries ----

    @property
    def joints(self) -> list[str]:
        """Joints of the arm to which the points belong."""
        return [str(joint) for joint in self._document["arm"]["joints"]]

    @property
    def model(self) -> str:
        """Identifier of the model of the arm to which the points belong; empty if unknown."""
        return str(self._document["arm"]["model"])

    @property
    def frames(self) -> PlaceTable:
        """Work frames of the file, in which points are taught: `points.frames["table"] = gpac.Frame.by_points(…)`."""
        return PlaceTable(self, "frames")

    @property
    def tools(self) -> PlaceTable:
        """Tools of the file, as frames relative to the flange: `points.tools["gripper"] = gpac.Frame((0, 0, "120 mm"))`."""
        return PlaceTable(self, "tools")

    def __getitem__(self, name: str) -> Point:
        return self._point(name, self._arm)

    def _point(self, name: str, arm: Group[Any] | None) -> Point:
        document = self._now()
        entry = self._entry(document, name)
        if arm is None or not hasattr(arm, "kinematics"):
            return Point(name, entry)
        return Point(name, entry, lambda: self._reached(document, name, entry, arm))

    def __iter__(self) -> Iterator[str]:
        return iter([str(name) for name in self._now()["points"]])

    def __len__(self) -> int:
        return len(self._now()["points"])

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and name in self._now()["points"]

    def __repr__(self) -> str:
        points = "".join(f"\n  {self[name]!r}" for name in self)
        return f"points of '{self.path}' ({', '.join(self.joints) or 'no arm yet'}):{points or ' none'}"

    # ---- points in space ----

    def _placed(self, document: Any, name: str, arm: Any, entry: PointEntry) -> PointEntry:
        """Returns the entry with the pose that the arm has at the entry's joint positions, expressed in the entry's frame."""
        if entry.frame == JOINTS:
            if entry.tool is not None:
                refuse(CallError, f"point '{name}' has a tool but no frame", 'pass the frame too: frame="world"')
            return entry
        if not hasattr(arm, "kinematics"):
            refuse(
                InvalidState,
                f"cannot teach point '{name}' in a frame: '{arm.name}' has no geometry",
                "teach its joints instead, without frame=",
            )
        frame, tool = self._frame(document, name, entry.frame), self._tool(document, name, entry.tool)
        q = [*entry.joints.values()]
        place = arm.forward(q)
        if tool is not None:
            place = place @ arm.tool.inverse() @ tool
        chosen = arm.configuration(q) if arm.kinematics.has_configurations else None
        return replace(entry, pose=frame.inverse() @ place, configuration=chosen)

    def _reached(self, document: Any, name: str, entry: PointEntry, arm: Any) -> tuple[dict[str, float], Pose]:
        """Returns the joints of the arm at a point, with the current frame and tool, and the arm's pose there."""
        taught = [*entry.joints.values()]
        if entry.pose is None:
            return entry.joints, arm.forward(taught)
        goal = self._frame(document, name, entry.frame) @ entry.pose
        tool = self._tool(document, name, entry.tool)
        if tool is not None:
            goal = goal @ tool.inverse() @ arm.tool
        there = arm.forward(taught)
        if there.distance(goal) < _SAME and there.angle(goal) < _SAME:
            return entry.joints, goal
        try:
            q = arm.inverse(goal, taught, configuration=entry.configuration)
        except Unreachable as error:
            error.message = f"point '{name}': {error.message}"
            raise
        return dict(zip(entry.joints, map(float, q), strict=True)), goal

    def _frame(self, document: Any, name: str, frame: str) -> Pose:
        frames = document.get("frames", {})
        if frame in (JOINTS, WORLD):
            return Pose()
        if frame not in frames:
            remedy = did_you_mean(str(frame), [WORLD, *frames]) or f"define it: points.frames['{frame}'] = gpac.Frame(…)"
            refuse(UnknownName, f"frame '{frame}' of point '{name}' is not in '{self.path}'", remedy)
        return point_file.pose_of(frames[frame])

    def _tool(self, document: Any, name: str, tool: str | None) -> Pose | None:
        tools = document.get("tools", {})
        if tool is not None and tool not in tools:
            remedy = did_you_mean(str(tool), tools) or f"define it: points.tools['{tool}'] = arm.tool"
            refuse(UnknownName, f"tool '{tool}' of point '{name}' is not in '{self.path}'", remedy)
        return None if tool is None else point_file.pose_of(tools[tool])

    # ---- the file ----

    def _entry(self, document: Any, name: str) -> PointEntry:
        if name not in document["points"]:
            refuse(UnknownName, f"'{self.path}' has no point '{name}'", did_you_mean(str(name), document["points"]))
        return point_file.entry_of(document, name)

    def _now(self) -> Any:
        with self._lock:
            self._refresh()
            return self._document

    def _refresh(self) -> None:
        """Rereads the file if it differs from the version last read or written, and reapplies changes that could not be written before."""
        text = files.read(self.path, _WHAT)
        if text is None or text == self._seen:
            return
        document = point_file.parsed(text, self.path)
        if self._arm is not None:
            self._check_model(self._arm, document)
        now = text
        for change in self._unwritten:
            now = change(now)
        self._document, self._seen = point_file.parsed(now, self.path) if self._unwritten else document, text

    def _edit(self, change: Callable[[Any], None]) -> None:
        """Applies `change` to the document of the file."""

        def on_text(text: str) -> str:
            document = point_file.parsed(text, self.path)
            change(document)
            return tomlkit.dumps(document)

        self._change(on_text)

    def _change(self, change: Callable[[str], str]) -> None:
        """Applies `change` to the current text of the file, and writes it."""
        with self._lock, files.locked(self.path, _WHAT):
            self._refresh()
            text = change(tomlkit.dumps(self._document))
            self._document = point_file.parsed(text, self.path)
            try:
                files.write(self.path, text, _WHAT)
            except FileFailed:
                self._unwritten.append(change)
                raise
            self._unwritten.clear()
            if not checking.active():
                self._seen = text

    def _take_arm(self, arm: Group[Any], document: Any) -> None:
        table: Any = document["arm"]
        if table["joints"]:
            self._check_model(arm, document)
            return
        table["name"], table["model"] = arm.name, model_of(arm)
        table["joints"] = arm.short_names
        table["units"] = [device.sensed.unit for device in arm]

    def _check_model(self, arm: Group[Any], document: Any) -> None:
        of, joints = document["arm"], arm.short_names
        if not of["joints"]:
            return
        if list(of["joints"]) != joints:
            says = f"the points of '{self.path}' are for joints {', '.join(of['joints'])}, but arm '{arm.name}' has {', '.join(joints)}"
            refuse(ValueRefused, says, "use the file of this arm")
        if not self._any_model and of["model"] != model_of(arm):
            says = f"the points of '{self.path}' were taught with a model of arm '{of['name']}' that differs from the model of '{arm.name}'"
            refuse(
                ValueRefused,
                says,
                "use the file of this arm, or, if the joints have the same meaning, write gpac.Points(path, arm, any_model=True)",
            )


@all_taking
class PlaceTable(MutableMapping[str, Pose]):
    """The frames or the tools of a points file: a mapping from names to `Pose`. Obtained as `points.frames` and `points.tools`.

    A point taught in a frame moves with it. Deleting an entry that points use raises `ValueRefused`.
    """

    def __init__(self, points: Points, section: str) -> None:
        self._points, self._section = points, section

    def __setitem__(self, name: str, place: Pose) -> None:
        one = self._section[:-1]
        if not isinstance(name, str) or not name.strip() or name in (JOINTS, WORLD):
            refuse(CallError, f"a {one} cannot be named {name!r}", f"choose a non-empty name other than '{JOINTS}' and '{WORLD}'")
        entry = point_file.pose_entry(Pose.of(place))

        def put(document: Any) -> None:
            if self._section not in document:
                document[self._section] = tomlkit.table()
            document["format"] = point_file.FORMAT
            line = tomlkit.inline_table()
            line.update(entry)
            document[self._section][name] = line

        self._points._edit(put)

    def __getitem__(self, name: str) -> Pose:
        table = self._table()
        if name not in table:
            refuse(UnknownName, f"'{self._points.path}' has no {self._section[:-1]} '{name}'", did_you_mean(str(name), table))
        return point_file.pose_of(table[name])

    def __delitem__(self, name: str) -> None:
        _ = self[name]
        key = self._section[:-1]

        def remove(document: Any) -> None:
            of = [point for point, entry in document["points"].items() if entry.get(key) == name]
            if of:
                refuse(
                    ValueRefused,
                    f"cannot delete {key} '{name}': point '{of[0]}' uses it",
                    f"teach that point with another {key}, or delete the point",
                )
            del document[self._section][name]

        self._points._edit(remove)

    def _table(self) -> Any:
        return self._points._now().get(self._section, {})

    def __iter__(self) -> Iterator[str]:
        return iter([str(name) for name in self._table()])

    def __len__(self) -> int:
        return len(self._table())

    def __repr__(self) -> str:
        return f"{self._section} of '{self._points.path}': {', '.join(f'{name} {self[name]!r}' for name in self) or 'none'}"


def model_of(arm: Group[Any]) -> str:
    """Returns the identifier of an arm's mechanics: the identifier of its model file, or else its joints with their types and units."""
    if arm.model:
        return arm.model
    said = [(device.definition_name(), name, device.sensed.unit) for device, name in zip(arm, arm.short_names, strict=True)]
    return "joints:" + hashlib.sha256(repr(said).encode()).hexdigest()[:32]


def _group(arm: Any) -> Group[Any]:
    group = Group(arm.short_name, arm) if isinstance(arm, LogicalDevice) else arm
    if not isinstance(group, Group):
        refuse(CallError, f"the arm of points must be a group of joints, not {arm!r}", "pass a group of joints")
    lacking = [device.name for device in group if "sensed" not in device.svv_members()]
    if lacking:
        refuse(InvalidState, f"points cannot be taught with {', '.join(lacking)}", "use an arm whose device type has an SVV 'sensed'")
    return group


def _named(name: Any) -> None:
    if not isinstance(name, str) or not name.strip():
        refuse(CallError, f"a point cannot be named {name!r}", "pass a non-empty string, for example 'pick'")


def _joints_of(name: str, joints: Any, names: list[str]) -> dict[str, float]:
    """Returns the joints passed for a point, in the arm's order."""
    if not isinstance(joints, Mapping):
        if isinstance(joints, str) or len(joints) != len(names):
            refuse(
                ValueRefused,
                f"joints of point '{name}' must be {len(names)} numbers, not {joints!r}",
                f"pass a number for each of {', '.join(names)}",
            )
        joints = dict(zip(names, joints, strict=True))
    if set(joints) != set(names):
        wrong = next((joint for joint in joints if joint not in names), None)
        remedy = did_you_mean(str(wrong), names) if wrong else f"pass each of {', '.join(names)}, or change some with edit()"
        refuse(UnknownName, f"the joints of point '{name}' must be {', '.join(names)}, not {', '.join(map(str, joints)) or 'none'}", remedy)
    return _checked(name, {joint: joints[joint] for joint in names})


def _checked(name: str, joints: Mapping[str, Any]) -> dict[str, float]:
    """Checks that the joint positions are finite numbers, and returns them."""
    found = {}
    for joint, given in joints.items():
        value = number(given)
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            refuse(ValueRefused, f"joint '{joint}' of point '{name}' must be a finite number, not {value!r}", "write it in rad or m")
        found[joint] = float(value)
    return found
