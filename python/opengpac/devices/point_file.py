# SPDX-License-Identifier: Apache-2.0
"""The file of taught points: reads, checks and changes it; comments and order are preserved.

Format 2 has one line per point. Files of format 1, with one table per point, keep their format when they are written; adding a point
in space or a frame converts them to format 2, but keeps the tables.
"""

from __future__ import annotations

import contextlib
import functools
import math
import re
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.items import InlineTable

from .. import _native
from ..errors import Error, FileFailed, did_you_mean, refuse
from ..values.configurations import Configuration
from ..values.frames import Pose
from .point import JOINTS, WORLD, PointEntry

FORMAT = 2
DIGITS = 9
"""Number of decimal places in the file."""


def new_document() -> Any:
    """Returns the document of a file without points."""
    document = tomlkit.document()
    document.add(tomlkit.comment("Taught points, one per line. You may edit this file: comments and order are kept."))
    document["format"] = FORMAT
    document["arm"] = {"name": "", "model": "", "joints": [], "units": []}
    document["points"] = {}
    return document


def parsed(text: str, path: Path) -> Any:
    """Parses the document of a file, and checks that all of its numbers are valid."""
    try:
        document: Any = tomlkit.parse(text)
        wrong = _wrong(document)
    except Error:
        raise
    except Exception as error:
        why = "it is nested too deeply" if isinstance(error, RecursionError) else str(error).lower() or "it is damaged"
        refuse(FileFailed, f"points file '{path}' cannot be read: {why}", "fix that line; the file is unchanged")
    if wrong:
        at, why = wrong
        line = _line_of(text, *at) if at else None
        where = f"'{path}', line {line}," if line else f"'{path}'"
        refuse(FileFailed, f"points file {where} cannot be used: {why}", "fix it; the file is unchanged")
    return document


@functools.lru_cache
def factor(unit: Any) -> float | None:
    """Returns the factor from a unit in the file to rad or m, or None for other units. Numbers without a unit have the factor 1."""
    for si in ("rad", "m") if isinstance(unit, str) and unit else ():
        with contextlib.suppress(_native.Refused):
            return _native.number_in(f"1 {unit}", si)
    return 1.0 if unit == "" else None


# ---- entries ----


def entry_of(document: Any, name: str) -> PointEntry:
    """Returns a point of a document."""
    entry, arm = document["points"][name], document["arm"]
    listed = zip(_listed(entry, arm).items(), arm["units"], strict=True)
    joints = {str(joint): float(value) * (factor(unit) or 1.0) for (joint, value), unit in listed}
    pose, signs, taught = None, entry.get("configuration"), entry.get("taught")
    if "position" in entry:
        pose = pose_of(entry)
    configuration = None if signs is None else Configuration.of(str(signs), [int(turn) for turn in entry.get("turns", [])])
    return PointEntry(
        joints,
        str(entry.get("frame", JOINTS)),
        None if entry.get("tool") is None else str(entry["tool"]),
        pose,
        configuration,
        str(entry.get("note", "")),
        taught if isinstance(taught, datetime) else None,
    )


def put_entry(document: Any, name: str, point: PointEntry) -> None:
    """Writes a point into a document: replaces the point of the same name, or appends a new one."""
    table, arm = document["points"], document["arm"]
    in_lines = is_in_lines(document)
    if point.pose is not None:
        document["format"] = FORMAT
    if name not in table:
        table[name] = tomlkit.inline_table() if in_lines else tomlkit.table()
    entry = table[name]
    values = [round(value / (factor(unit) or 1.0), DIGITS) for value, unit in zip(point.joints.values(), arm["units"], strict=True)]
    if isinstance(entry.get("joints"), Mapping) or not in_lines:
        joints = tomlkit.inline_table()
        joints.update(dict(zip(point.joints, values, strict=True)))
    else:
        joints = values
    if point.pose is None and not in_lines:
        _keep(entry, "frame", JOINTS)
    elif point.pose is None:
        _keep(entry, "frame", None)
    else:
        _keep(entry, "frame", point.frame)
    _keep(entry, "tool", point.tool if point.pose is not None else None)
    place = None if point.pose is None else pose_entry(point.pose)
    for key in ("position", "rpy_deg"):
        _keep(entry, key, None if place is None else place[key])
    chosen = point.configuration if point.pose is not None else None
    _keep(entry, "configuration", None if chosen is None else chosen.signs)
    _keep(entry, "turns", list(chosen.turns) if chosen is not None and any(chosen.turns) else None)
    _keep(entry, "joints", joints)
    _keep(entry, "note", point.note or None)
    _keep(entry, "taught", point.taught)


def _keep(entry: Any, key: str, value: Any) -> None:
    """Sets an item of an entry if it differs; removes the item if the value is None."""
    if value is None:
        if key in entry:
            del entry[key]
    elif key not in entry or entry[key] != value:
        entry[key] = value


def pose_of(entry: Mapping[str, Any]) -> Pose:
    """Returns the pose that an entry specifies as `position` (m) and `rpy_deg`."""
    turn = [math.radians(float(angle)) for angle in entry.get("rpy_deg", [0.0, 0.0, 0.0])]
    return Pose([float(x) for x in entry["position"]], rpy=turn)


def pose_entry(pose: Pose) -> dict[str, Any]:
    """Returns the items that describe a pose in the file."""
    return {
        "position": [round(float(x), DIGITS) + 0.0 for x in pose.position],
        "rpy_deg": [round(math.degrees(x), DIGITS) + 0.0 for x in pose.rpy],
    }


def is_in_lines(document: Any) -> bool:
    """Returns whether the points of a document are stored as lines rather than tables."""
    points = document["points"]
    return all(isinstance(points[name], InlineTable) for name in points) if len(points) else document["format"] == FORMAT


def renamed(text: str, name: str, to: str) -> str:
    """Returns the text of a file after renaming a point; the rest is unchanged."""
    lines, section = text.split("\n"), ""
    for number, line in enumerate(lines):
        header = re.match(r"\s*\[([^\[\]]+)\]", line)
        if header:
            section = header.group(1).strip()
            lines[number] = re.sub(_header(name), lambda found: f"{found.group(1)}{_key(to)}{found.group(2)}", line)
        elif section == "points":
            lines[number] = re.sub(
                rf"^(\s*)(?:{_written(name)})(\s*[=.])", lambda found: f"{found.group(1)}{_key(to)}{found.group(2)}", line
            )
    return "\n".join(lines)


def _key(name: str) -> str:
    return tomlkit.key(name).as_string() if re.fullmatch(r"[A-Za-z0-9_-]+", name) else tomlkit.string(name).as_string()


def _written(name: str) -> str:
    """Returns the pattern that matches a name as a key in a file."""
    forms = {_key(name), tomlkit.string(name).as_string()} | ({f"'{name}'"} if "'" not in name and "\n" not in name else set())
    return "|".join(re.escape(form) for form in forms)


def _header(name: str) -> str:
    return rf"^(\s*\[\s*points\s*\.\s*)(?:{_written(name)})(\s*[\].])"


def _line_of(text: str, section: str, name: str) -> int | None:
    """Returns the number of an entry's line, from 1, or None if it cannot be found in the text."""
    current = ""
    for number, line in enumerate(text.split("\n"), 1):
        header = re.match(r"\s*\[([^\[\]]+)\]", line)
        if header:
            current = header.group(1).strip()
            if section == "points" and re.match(_header(name), line):
                return number
            if current == section and not name:
                return number
        elif current == section and re.match(rf"\s*(?:{_written(name)})\s*[=.]", line):
            return number
    return None


# ---- checks ----


def _wrong(document: Any) -> tuple[tuple[str, str] | None, str] | None:
    """Returns the first error of a document, with the section and name concerned."""
    if document.get("format") not in (1, FORMAT):
        return None, f"its format is {document.get('format')!r}, but this version reads {FORMAT}"
    arm, points = document.get("arm"), document.get("points")
    if not isinstance(arm, Mapping) or not isinstance(points, Mapping):
        return None, "it needs the tables [arm] and [points]"
    for key, kind in (("name", str), ("model", str), ("joints", list), ("units", list)):
        if not isinstance(arm.get(key), kind):
            return ("arm", key), f"'{key}' of [arm] is missing"
    if len(arm["joints"]) != len(arm["units"]):
        return ("arm", "units"), f"[arm] has {len(arm['joints'])} joints but {len(arm['units'])} units"
    if len({*map(str, arm["joints"])}) != len(arm["joints"]) or not all(isinstance(joint, str) for joint in arm["joints"]):
        return ("arm", "joints"), "'joints' of [arm] must be distinct names"
    unknown = next((unit for unit in arm["units"] if factor(unit if isinstance(unit, str) else None) is None), None)
    if unknown is not None:
        return ("arm", "units"), f"[arm] has unit '{unknown}', which is neither an angle nor a length; write rad, deg, m or mm"
    for section in ("frames", "tools"):
        entries = document.get(section, {})
        if not isinstance(entries, Mapping):
            return None, f"'{section}' is not a table"
        for name, entry in entries.items():
            why = _wrong_pose(entry) if isinstance(entry, Mapping) else "it has no 'position = […]'"
            if why:
                return (section, str(name)), f"{section[:-1]} '{name}': {why}"
    for name, entry in points.items():
        if why := _wrong_point(entry, document):
            return ("points", str(name)), f"point '{name}': {why}"
    return None


def _wrong_point(entry: Any, document: Any) -> str:
    joints = document["arm"]["joints"]
    of = entry.get("joints") if isinstance(entry, Mapping) else None
    if not isinstance(of, Mapping | list):
        return "it has no 'joints = […]'"
    if isinstance(of, list) and len(of) != len(joints):
        return f"it has {len(of)} joints, but the arm has {len(joints)}: {', '.join(joints)}"
    for joint in of if isinstance(of, Mapping) else ():
        if joint not in joints:
            return f"'{joint}' is not a joint of the arm; {did_you_mean(str(joint), joints)}"
    values = of if isinstance(of, Mapping) else dict(zip(joints, of, strict=True))
    for joint in joints:
        value = values.get(joint)
        if not _is_finite(value):
            return f"joint '{joint}' is missing" if value is None else f"joint '{joint}' must be finite, not {value!r}"
    if not isinstance(entry.get("note", ""), str):
        return "its note is not a string"
    return _wrong_place(entry, document)


def _wrong_place(entry: Mapping[str, Any], document: Any) -> str:
    """Returns the error in the frame, tool, pose or configuration of a point."""
    frame, tool = entry.get("frame", JOINTS), entry.get("tool")
    if frame == JOINTS:
        extra = next((key for key in ("position", "rpy_deg", "tool", "configuration", "turns") if key in entry), None)
        return f"it has '{extra}', but its frame is 'joints'; write frame = \"world\", or the name of a work frame" if extra else ""
    known = [WORLD, *document.get("frames", {})]
    if frame not in known:
        return f"its frame '{frame}' is not in [frames]; {did_you_mean(str(frame), [JOINTS, *known])}"
    if tool is not None and tool not in document.get("tools", {}):
        return f"its tool '{tool}' is not in [tools]; {did_you_mean(str(tool), document.get('tools', {}))}"
    signs, turns = entry.get("configuration"), entry.get("turns", [])
    if signs is not None and not (isinstance(signs, str) and re.fullmatch(r"[+-]{3}", signs)):
        return f"its configuration must be three signs such as '+-+', not {signs!r}"
    if not isinstance(turns, list) or not all(isinstance(turn, int) and not isinstance(turn, bool) and abs(turn) <= 1000 for turn in turns):
        return f"its turns must be an integer for each joint, not {turns!r}"
    return _wrong_pose(entry)


def _wrong_pose(entry: Mapping[str, Any]) -> str:
    for key, needed in (("position", True), ("rpy_deg", False)):
        given = entry.get(key, None if needed else [0, 0, 0])
        if not isinstance(given, list) or len(given) != 3 or not all(_is_finite(x) for x in given):
            return (
                f"it has no '{key} = [x, y, z]' with finite numbers"
                if needed
                else f"its '{key}' must be [roll, pitch, yaw] with finite numbers"
            )
    try:
        pose_of(entry)
    except Error as error:
        return error.message
    return ""


def _is_finite(value: Any) -> bool:
    return not isinstance(value, bool) and isinstance(value, int | float) and -1e300 < value < 1e300


def _listed(entry: Mapping[str, Any], arm: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the joints of an entry, in the arm's order."""
    joints: Sequence[str] = arm["joints"]
    of = entry["joints"]
    return {joint: of[joint] for joint in joints} if isinstance(of, Mapping) else dict(zip(joints, of, strict=True))
