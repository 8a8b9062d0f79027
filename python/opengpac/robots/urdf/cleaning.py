# SPDX-License-Identifier: Apache-2.0
"""Repair of robot files that MuJoCo refuses or misreads: they are put right as the URDF specification says, each time with a note."""

from __future__ import annotations

from xml.etree import ElementTree

from .source import Source

_READ = ("link", "joint", "mujoco")
"""What is taken from a file; materials, transmissions, plugins and `ros2_control` are not."""
_MOVING = ("revolute", "continuous", "prismatic")
_MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
_PRODUCTS = _MOMENTS[3:]

BALL_M = 0.05
"""Radius of the ball whose inertia a link is given that has a mass alone, m."""
_ONCE = ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic", "inertial", "mass", "inertia", "geometry")
_SHAPES = ("box", "cylinder", "sphere", "mesh", "capsule")
RANGE_MAX = 1e6
"""A range beyond this is none, rad or m."""
_KINDS = (*_MOVING, "fixed", "floating", "planar")


def clean(source: Source) -> dict[str, float]:
    """Puts the elements right, and gives the maximum speed of each joint that has one, rad/s (m/s).

    Raises `DeviceFailed` where the file has no meaning.
    """
    root = source.root
    for element in [element for element in root if element.tag not in _READ]:
        root.remove(element)
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
    moved = {child.get("link") for joint in root.findall("joint") if joint.get("type") in _MOVING for child in joint.findall("child")}
    for link in root.findall("link"):
        _clean_link(source, link, link.get("name") in moved)
    return speeds


def _drop_second(source: Source, element: ElementTree.Element) -> None:
    """Takes the first of two parts that an element has once."""
    seen: set[str] = set()
    for part in list(element):
        if part.tag in seen:
            called = f"<{element.tag}> '{element.get('name')}'" if element.get("name") else f"a <{element.tag}>"
            source.note(f"{called} has two <{part.tag}>: the first is taken", part)
            element.remove(part)
        if part.tag in _ONCE:
            seen.add(part.tag)


def _drop_second_shape(source: Source, geometry: ElementTree.Element) -> None:
    """Takes the first of several shapes: a geometry is one."""
    first, *more = [part for part in geometry if part.tag in _SHAPES] or [None]
    for part in more:
        assert first is not None and part is not None
        source.note(f"a <geometry> has a <{part.tag}> behind its <{first.tag}>: the first is taken", part)
        geometry.remove(part)


def _number_names(source: Source, tag: str) -> None:
    """Refuses elements without a name; a second joint of one name gets a number, a second link has no meaning."""
    known: set[str] = set()
    for element in source.root.findall(tag):
        name = element.get("name", "").strip()
        if not name:
            source.refuse(element, f"a <{tag}> has no name", "give it one")
        if name in known and tag == "link":
            source.refuse(
                element, f"there are two links '{name}': it is not said which of them a joint means", "name one of them otherwise"
            )
        fresh, number = name, 2
        while fresh in known:
            fresh, number = f"{name}_{number}", number + 1
        if fresh != name:
            source.note(f"a second joint '{name}' is called '{fresh}'", element)
        element.set("name", fresh)
        known.add(fresh)


def _clean_joint(source: Source, joint: ElementTree.Element, links: set[str]) -> float:
    """Puts a joint right, and gives its maximum speed, 0 without one. `links` are those of the file."""
    name, kind = joint.get("name", ""), joint.get("type", "")
    if kind not in _KINDS:
        source.refuse(joint, f"joint '{name}' is of type '{kind}'", f"its type is one of {', '.join(_KINDS)}")
    for end in ("parent", "child"):
        link = joint.find(end)
        if link is None or link.get("link") not in links:
            found = "none" if link is None else f"'{link.get('link')}'"
            source.refuse(joint, f"the {end} link of joint '{name}' is {found}, which is not in the file", "name one of its links")
    if kind not in _MOVING:
        return 0.0
    axis = joint.find("axis")
    if axis is not None and not any(source.numbers(axis, "xyz", 3, "1 0 0")):
        source.refuse(axis, f"the axis of joint '{name}' is 0 0 0", "give it a direction")
    if joint.find("mimic") is not None:
        source.followers.add(name)
    return _clean_limit(source, joint)


def _clean_limit(source: Source, joint: ElementTree.Element) -> float:
    """Puts the limits of a joint right; its maximum speed, 0 without one."""
    name, kind, limit = joint.get("name", ""), joint.get("type"), joint.find("limit")
    if limit is None:
        if kind != "continuous":
            source.note(f"{kind} joint '{name}' has no limit: it turns or slides without end, with any effort", joint)
            _free(joint)
        return 0.0
    low, high = (source.numbers(limit, bound, 1, "0")[0] for bound in ("lower", "upper"))
    speed, effort = (source.numbers(limit, word, 1, "0")[0] for word in ("velocity", "effort"))
    if kind == "continuous":
        limit.attrib.pop("lower", None)
        limit.attrib.pop("upper", None)
    elif max(abs(low), abs(high)) > RANGE_MAX:
        source.note(f"the range of joint '{name}' is {low:g} to {high:g}: it turns or slides without end", limit)
        limit.attrib.pop("lower", None)
        limit.attrib.pop("upper", None)
        _free(joint)
    elif low > high:
        source.note(f"the range of joint '{name}' is {low:g} to {high:g}, which is empty: its ends are exchanged", limit)
        limit.attrib.update({"lower": f"{high}", "upper": f"{low}"})
    elif ("lower" not in limit.attrib and "upper" not in limit.attrib) or not any((low, high, speed, effort)):
        source.note(f"{kind} joint '{name}' has no range: it turns or slides without end", limit)
        _free(joint)
    elif low == high:
        source.note(f"the range of joint '{name}' is {low:g} to {high:g}: it is fixed there" + (", at its zero" if low else ""), limit)
        joint.set("type", "fixed")
        return 0.0
    if effort < 0.0 or speed < 0.0:
        source.note(f"joint '{name}' has a negative limit: its absolute value is taken", limit)
    if effort == 0.0:
        source.note(f"joint '{name}' has no limit of effort: its motor has none", limit)
    limit.set("effort", f"{abs(effort)}")
    return abs(speed)


def _free(joint: ElementTree.Element) -> None:
    if joint.get("type") == "revolute":
        joint.set("type", "continuous")


def _clean_link(source: Source, link: ElementTree.Element, moves: bool) -> None:
    """Leaves out shapes that are none, and puts right an inertia that no body has.

    MuJoCo takes it from the shapes where there is no mass, else it is that of a ball.
    """
    inertial, name = link.find("inertial"), link.get("name", "")
    for shape in [*link.findall("visual"), *link.findall("collision")]:
        if not any(shape.find(f"geometry/{kind}") is not None for kind in _SHAPES):
            source.note(f"a <{shape.tag}> of link '{name}' has no shape, and is left out; it is one of {', '.join(_SHAPES)}", shape)
            link.remove(shape)
    if inertial is None:
        if moves and link.find("collision") is None:
            source.note(f"link '{name}' has neither an inertia nor a shape to take it from: it has the least mass", link)
        return
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    kilograms = 0.0 if mass is None else source.numbers(mass, "value", 1, "0")[0]
    moments = [0.0] * 6
    if inertia is not None:
        moments = [source.numbers(inertia, word, 1, "0")[0] for word in _MOMENTS]
    if kilograms <= 0.0:
        if moves:
            source.note(f"link '{name}' has a mass of {kilograms:g} kg: it is taken from its shapes", inertial)
        link.remove(inertial)
    elif not _is_possible(moments):
        if moves:
            source.note(f"link '{name}' has an inertia that no body has: that of a ball of 5 cm is taken", inertial)
        moment = 0.4 * kilograms * BALL_M**2
        element = ElementTree.SubElement(inertial, "inertia") if inertia is None else inertia
        element.attrib.update({word: f"{0.0 if word in _PRODUCTS else moment}" for word in _MOMENTS})


def _is_possible(moments: list[float]) -> bool:
    """Returns whether a matrix of inertia is positive definite: Sylvester's criterion."""
    xx, yy, zz, xy, xz, yz = moments
    determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    return xx > 0.0 and xx * yy - xy * xy > 0.0 and determinant > 0.0
