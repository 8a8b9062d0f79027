# SPDX-License-Identifier: Apache-2.0
"""Repairs robot files that MuJoCo rejects or misreads. Corrections follow the URDF specification, and each is noted."""

from __future__ import annotations

from xml.etree import ElementTree

from . import numbers, structure
from .source import Source
from .structure import MOVING

_READ = ("link", "joint", "mujoco")
"""Elements that are read from a file; materials, transmissions, plugins and `ros2_control` are ignored."""
_PRODUCTS = numbers.MOMENTS[3:]

BALL_M = 0.05
"""Radius of the ball used for the inertia of a link for which only a mass is specified, m."""
_ONCE = ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic", "inertial", "mass", "inertia", "geometry")
RANGE_MAX = 1e6
"""Limit above which a range counts as unlimited, rad or m."""
EFFORT_MAX = 1e9
"""Limit above which an effort counts as unlimited, N.m or N."""
SPEEDS = (1e-6, 1e6)
"""Bounds outside which a maximum speed is ignored, rad/s or m/s."""
_SIZES = {"box": ("size",), "cylinder": ("radius", "length"), "capsule": ("radius", "length"), "sphere": ("radius",), "mesh": ()}
"""Shapes, with the attributes that define their sizes."""
_KINDS = (*MOVING, "fixed", "floating", "planar")


def clean(source: Source) -> dict[str, float]:
    """Corrects the elements, and returns the maximum speed of each joint that has one, rad/s (m/s).

    Raises `DeviceFailed` if the file is invalid.
    """
    root = source.root
    for element in [element for element in root if element.tag not in _READ]:
        root.remove(element)
    numbers.clean(source)
    for element in [*root.findall("joint"), *root.findall("link"), *root.findall("link/*")]:
        _drop_second(source, element)
    for geometry in root.iter("geometry"):
        _drop_second_shape(source, geometry)
    _number_names(source, "link")
    _number_names(source, "joint")
    links = {link.get("name", "") for link in root.findall("link")}
    speeds = {}
    for joint in root.findall("joint"):
        speed = _clean_joint(source, joint, links)
        if speed > 0.0:
            speeds[joint.get("name", "")] = speed
    structure.check_tree(source)
    structure.resolve_followers(source)
    moved = {child.get("link") for joint in root.findall("joint") if joint.get("type") in MOVING for child in joint.findall("child")}
    for link in root.findall("link"):
        _clean_link(source, link, link.get("name") in moved)
    return speeds


def _drop_second(source: Source, element: ElementTree.Element) -> None:
    """Keeps the first of two child elements of which only one is allowed."""
    seen: set[str] = set()
    for part in list(element):
        if part.tag in seen:
            called = f"<{element.tag}> '{element.get('name')}'" if element.get("name") else f"a <{element.tag}>"
            source.note(f"{called} has two <{part.tag}>; the first is used", part)
            element.remove(part)
        if part.tag in _ONCE:
            seen.add(part.tag)


def _drop_second_shape(source: Source, geometry: ElementTree.Element) -> None:
    """Keeps the first of several shapes, because a geometry has only one."""
    first, *more = [part for part in geometry if part.tag in _SIZES] or [None]
    for part in more:
        assert first is not None and part is not None
        source.note(f"a <geometry> has a <{part.tag}> after its <{first.tag}>; the first is used", part)
        geometry.remove(part)


def _number_names(source: Source, tag: str) -> None:
    """Refuses elements without a name. A second joint with the same name is renamed by adding a number; a second link with the same name
    is refused."""
    known: set[str] = set()
    for element in source.root.findall(tag):
        name = element.get("name", "").strip()
        if not name:
            source.refuse(element, f"a <{tag}> has no name", "add one")
        if name in known and tag == "link":
            source.refuse(element, f"two links are named '{name}', so it is unclear which one a joint refers to", "rename one of them")
        fresh, number = name, 2
        while fresh in known:
            fresh, number = f"{name}_{number}", number + 1
        if fresh != name:
            source.note(f"a second joint '{name}' is renamed '{fresh}'", element)
        element.set("name", fresh)
        known.add(fresh)


def _clean_joint(source: Source, joint: ElementTree.Element, links: set[str]) -> float:
    """Corrects a joint, and returns its maximum speed, or 0 if it has none. `links` are the links of the file."""
    name, kind = joint.get("name", ""), joint.get("type", "")
    if kind not in _KINDS:
        source.refuse(joint, f"joint '{name}' has the unknown type '{kind}'", f"use one of {', '.join(_KINDS)}")
    for end in ("parent", "child"):
        link = joint.find(end)
        if link is None or link.get("link") not in links:
            found = "none" if link is None else f"'{link.get('link')}'"
            source.refuse(joint, f"the {end} link of joint '{name}', {found}, is not in the file", "name an existing link")
    if kind not in MOVING:
        return 0.0
    axis = joint.find("axis")
    if axis is not None and not any(source.numbers(axis, "xyz", 3, "1 0 0")):
        source.refuse(axis, f"the axis of joint '{name}' is 0 0 0", "write a direction")
    _clean_dynamics(source, joint)
    return _clean_limit(source, joint)


def _clean_limit(source: Source, joint: ElementTree.Element) -> float:
    """Corrects the limits of a joint; returns its maximum speed, or 0 if it has none."""
    name, kind, limit = joint.get("name", ""), joint.get("type"), joint.find("limit")
    if limit is None:
        if kind != "continuous":
            source.note(f"{kind} joint '{name}' has no limit; its range and effort are unlimited", joint)
            _free(joint)
        return 0.0
    low, high = (source.numbers(limit, bound, 1, "0", is_finite=False)[0] for bound in ("lower", "upper"))
    speed, effort = (source.numbers(limit, word, 1, "0", is_finite=False)[0] for word in ("velocity", "effort"))
    missing = [bound for bound in ("lower", "upper") if bound not in limit.attrib]
    if kind != "continuous" and len(missing) == 1:
        source.note(f"joint '{name}' has no {missing[0]} limit, for which URDF specifies 0: its range is {low:g} to {high:g}", limit)
        limit.set(missing[0], "0")
    if kind == "continuous":
        if max(abs(low), abs(high)) > RANGE_MAX:
            source.note(f"the range of continuous joint '{name}', {low:g} to {high:g}, is ignored", limit)
        limit.attrib.pop("lower", None)
        limit.attrib.pop("upper", None)
    elif max(abs(low), abs(high)) > RANGE_MAX:
        source.note(f"the range of joint '{name}' is {low:g} to {high:g}; it is treated as unlimited", limit)
        limit.attrib.pop("lower", None)
        limit.attrib.pop("upper", None)
        _free(joint)
    elif low > high:
        source.note(f"the range of joint '{name}', {low:g} to {high:g}, is empty; its limits are swapped", limit)
        limit.attrib.update({"lower": f"{high}", "upper": f"{low}"})
    elif ("lower" not in limit.attrib and "upper" not in limit.attrib) or not any((low, high, speed, effort)):
        source.note(f"{kind} joint '{name}' has no range; it is treated as unlimited", limit)
        _free(joint)
    elif low == high:
        source.note(f"the range of joint '{name}' is {low:g} to {high:g}; the joint is fixed there", limit)
        source.fixed[name] = low
    if effort < 0.0 or speed < 0.0:
        source.note(f"joint '{name}' has a negative limit; its absolute value is used", limit)
    limit.set("effort", f"{_effort(source, limit, name, abs(effort))}")
    return _speed(source, limit, name, abs(speed))


def _effort(source: Source, limit: ElementTree.Element, joint: str, effort: float) -> float:
    """Returns the effort limit of a joint, or 0 if it has none."""
    if 0.0 < effort <= EFFORT_MAX:
        return effort
    said = "no effort limit" if effort == 0.0 else f"an effort limit of {effort:g}"
    source.note(f"joint '{joint}' has {said}; the effort of its motor is unlimited", limit)
    return 0.0


def _speed(source: Source, limit: ElementTree.Element, joint: str, speed: float) -> float:
    """Returns the maximum speed of a joint, or 0 if it has none."""
    low, high = SPEEDS
    if speed == 0.0 or low <= speed <= high:
        return speed
    source.note(f"joint '{joint}' has an implausible maximum speed of {speed:g}; it is ignored", limit)
    return 0.0


def _clean_dynamics(source: Source, joint: ElementTree.Element) -> None:
    """Takes the absolute value of damping and dry friction, because negative values would drive the joint."""
    for dynamics in joint.findall("dynamics"):
        for word in ("damping", "friction"):
            value = source.numbers(dynamics, word, 1, "0")[0]
            if value < 0.0:
                source.note(f"joint '{joint.get('name')}' has a {word} of {value:g}; its absolute value is used", dynamics)
                dynamics.set(word, f"{-value}")


def _free(joint: ElementTree.Element) -> None:
    if joint.get("type") == "revolute":
        joint.set("type", "continuous")


def _clean_link(source: Source, link: ElementTree.Element, moves: bool) -> None:
    """Removes invalid shapes, and corrects an impossible inertia.

    Without a mass, MuJoCo computes the inertia from the shapes; otherwise the inertia of a ball is used.
    """
    inertial, name = link.find("inertial"), link.get("name", "")
    for shape in [*link.findall("visual"), *link.findall("collision")]:
        found = next((part for kind in _SIZES for part in shape.findall(f"geometry/{kind}")), None)
        if found is None:
            source.note(f"a <{shape.tag}> of link '{name}' has no shape and is ignored; use one of {', '.join(_SIZES)}", shape)
            link.remove(shape)
        elif flat := _flat(found):
            source.note(f"a <{shape.tag}> of link '{name}' is ignored: its <{found.tag}> has {flat}, but a size must be above 0", found)
            link.remove(shape)
    if inertial is None:
        if moves and link.find("collision") is None:
            source.note(f"link '{name}' has neither an inertia nor a shape to compute one from; the minimum mass is used", link)
        return
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    kilograms = 0.0 if mass is None else source.numbers(mass, "value", 1, "0")[0]
    moments = [0.0] * 6
    if inertia is not None:
        moments = [source.numbers(inertia, word, 1, "0")[0] for word in numbers.MOMENTS]
    if kilograms <= 0.0:
        if moves:
            source.note(f"link '{name}' has a mass of {kilograms:g} kg; the mass is computed from its shapes instead", inertial)
        link.remove(inertial)
    elif not _is_possible(moments):
        if moves:
            source.note(f"link '{name}' has a physically impossible inertia; that of a ball of 5 cm is used", inertial)
        moment = 0.4 * kilograms * BALL_M**2
        element = ElementTree.SubElement(inertial, "inertia") if inertia is None else inertia
        element.attrib.update({word: f"{0.0 if word in _PRODUCTS else moment}" for word in numbers.MOMENTS})


def _flat(shape: ElementTree.Element) -> str:
    """Returns a size of a shape that is not positive, as text, or an empty text."""
    for word in _SIZES[shape.tag]:
        text = shape.get(word)
        if text is None:
            return f"no {word}"
        if min(float(value) for value in text.split()) <= 0.0:
            return f'{word}="{text}"'
    return ""


def _is_possible(moments: list[float]) -> bool:
    """Returns whether an inertia matrix is positive definite, by Sylvester's criterion."""
    xx, yy, zz, xy, xz, yz = moments
    determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    return xx > 0.0 and xx * yy - xy * xy > 0.0 and determinant > 0.0
