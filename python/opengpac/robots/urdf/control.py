# SPDX-License-Identifier: Apache-2.0
"""The tags `ros2_control` of a URDF file: the command and state interfaces of its joints, and their limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from xml.etree import ElementTree

from .source import Source


@dataclass(frozen=True)
class Interfaces:
    """A joint in `ros2_control`: the name of its hardware, and the names of its command and state interfaces."""

    hardware: str
    command: tuple[str, ...]
    state: tuple[str, ...]


@dataclass
class Control:
    """All joints declared in `ros2_control` tags.

    `limits` maps a joint and a command interface to its minimum and its maximum value (rad, rad/s, N.m, for prismatic joints m, m/s,
    N); `home` contains the initial positions of joints.
    """

    interfaces: dict[str, Interfaces]
    limits: dict[tuple[str, str], tuple[float, float]]
    home: dict[str, float]


def read(source: Source) -> Control:
    """Reads the tags. Malformed numbers and unknown joints are ignored with a note."""
    found = Control({}, {}, {})
    known = {joint.get("name", "") for joint in source.root.findall("joint")}
    for system in source.root.findall("ros2_control"):
        for element in system.findall("joint"):
            name = element.get("name", "")
            if name not in known:
                hardware = system.get("name", "")
                source.note(f"joint '{name}' of <ros2_control name=\"{hardware}\"> is not in the file; its entries are ignored", element)
                continue
            _read_joint(source, found, element, system.get("name", ""))
    return found


def _read_joint(source: Source, found: Control, element: ElementTree.Element, hardware: str) -> None:
    """Reads the interfaces of a joint, and their limits."""
    name = element.get("name", "")
    command, state = (element.findall(f"{kind}_interface") for kind in ("command", "state"))
    found.interfaces[name] = Interfaces(hardware, *(tuple(each.get("name", "") for each in kind) for kind in (command, state)))
    for interface in command:
        low, high = (_param(source, interface, word, name) for word in ("min", "max"))
        if low is not None or high is not None:
            limits = (-float("inf") if low is None else low, float("inf") if high is None else high)
            found.limits[name, interface.get("name", "")] = limits
    for interface in state:
        initial = _param(source, interface, "initial_value", name)
        if interface.get("name") == "position" and initial is not None:
            found.home[name] = initial


def _param(source: Source, interface: ElementTree.Element, word: str, joint: str) -> float | None:
    """Returns a number of an interface, or None if it is not specified."""
    element = next((param for param in interface.findall("param") if param.get("name") == word), None)
    if element is None:
        return None
    text = (element.text or "").strip()
    try:
        value = float(text)
    except ValueError:
        value = float("inf")
    if abs(value) < float("inf"):
        return value
    of = f"'{word}' of the interface '{interface.get('name', '')}' of joint '{joint}'"
    source.note(f"{of} is '{text[:60]}', which is not a number; it is ignored", element)
    return None


def narrow(source: Source, control: Control, speeds: dict[str, float]) -> None:
    """Narrows the position and speed limits of the joints to those of `ros2_control`; a limit that leaves no range is ignored with a
    note."""
    for joint in source.root.findall("joint"):
        name, limit = joint.get("name", ""), joint.find("limit")
        if limit is None or joint.get("type") not in ("revolute", "prismatic", "continuous"):
            continue
        if joint.get("type") != "continuous":
            _narrow_range(source, limit, name, control.limits)
        if (speed := _greatest(control.limits, name, "velocity")) > 0.0:
            speeds[name] = min(speeds.get(name, speed), speed)
        effort = _greatest(control.limits, name, "effort")
        given = float(limit.get("effort", "0"))
        if effort > 0.0 and (given == 0.0 or effort < given):
            limit.set("effort", f"{effort}")


def _narrow_range(source: Source, limit: ElementTree.Element, name: str, limits: Mapping[tuple[str, str], tuple[float, float]]) -> None:
    if (name, "position") not in limits:
        return
    given = (float(limit.get("lower", "0")), float(limit.get("upper", "0")))
    least, most = limits[name, "position"]
    low, high = max(given[0], least), min(given[1], most)
    if low >= high:
        source.note(
            f"<ros2_control> gives joint '{name}' the range {least:g} to {most:g}, which does not overlap with its limit, "
            f"{given[0]:g} to {given[1]:g}; the limit is used",
            limit,
        )
    elif (low, high) != given:
        limit.attrib.update({"lower": f"{low}", "upper": f"{high}"})


def _greatest(limits: Mapping[tuple[str, str], tuple[float, float]], joint: str, interface: str) -> float:
    """Returns the larger absolute limit of an interface, or 0 if it has none, because a joint has a single speed limit and a single
    effort limit."""
    low, high = limits.get((joint, interface), (0.0, 0.0))
    most = min(abs(low), abs(high)) if low and high else max(abs(low), abs(high))
    return most if most < float("inf") else 0.0
