# SPDX-License-Identifier: Apache-2.0
"""Structure of a URDF file: its links must form a tree, and a mimic joint must follow a joint that moves."""

from __future__ import annotations

from xml.etree import ElementTree

from .source import Source

MOVING = ("revolute", "continuous", "prismatic")
"""Types of joints that have a single position."""


def check_tree(source: Source) -> None:
    """Refuses a file whose links do not form a tree because a link is attached to itself, a link has two parent joints, or there is a
    cycle."""
    carriers: dict[str, ElementTree.Element] = {}
    for joint in source.root.findall("joint"):
        name, parent, child = joint.get("name", ""), _end(joint, "parent"), _end(joint, "child")
        if parent == child:
            source.refuse(joint, f"joint '{name}' joins link '{child}' to itself", "set its parent to the link to which it is attached")
        if child in carriers:
            other = carriers[child]
            source.refuse(
                joint,
                f"link '{child}' is the child of two joints, '{other.get('name')}' (line {source.line(other)}) "
                f"and '{name}', but links must form a tree",
                "remove one of the joints; write a closed loop as an <equality> in MJCF",
            )
        carriers[child] = joint
    for link, joint in carriers.items():
        way = [link]
        while (carrier := carriers.get(way[-1])) is not None:
            parent = _end(carrier, "parent")
            if parent == link:
                circle = ", ".join(f"'{_name(carriers[each])}'" for each in way)
                source.refuse(joint, f"joints {circle} form a cycle: none of their links is connected to the base", "remove one of them")
            if parent in way:
                break
            way.append(parent)


def resolve_followers(source: Source) -> None:
    """Registers the joints that follow another joint, and fixes those whose leader is stationary, at their offset from it.

    A mimic joint whose leader does not exist in the file is fixed, with a note. Refuses a joint that follows itself, directly or in a
    cycle.
    """
    joints = {_name(joint): joint for joint in source.root.findall("joint")}
    leaders: dict[str, str] = {}
    for name, joint in joints.items():
        mimic = joint.find("mimic")
        if mimic is None:
            continue
        if joint.get("type") not in MOVING or name in source.fixed:
            joint.remove(mimic)
            continue
        leader = mimic.get("joint", "").strip()
        remedy = "name the joint that it follows, or remove <mimic>"
        if leader == name:
            source.refuse(mimic, f"joint '{name}' mimics itself", remedy)
        if leader not in joints:
            said = f"joint '{leader}', which is not in the file" if leader else "no joint"
            source.note(f"joint '{name}' mimics {said}; it is fixed", joint)
            source.fixed[name] = _nearest_zero(joint)
            joint.remove(mimic)
            continue
        mimic.set("joint", leader)
        leaders[name] = leader
    for name in leaders:
        way = [name]
        while way[-1] in leaders:
            if leaders[way[-1]] in way:
                circle = ", ".join(f"'{each}'" for each in way)
                source.refuse(joints[name], f"joints {circle} mimic each other", "remove the <mimic> of one of them")
            way.append(leaders[way[-1]])
        source.followers.add(name)
        _follow(source, joints, way)


def _follow(source: Source, joints: dict[str, ElementTree.Element], way: list[str]) -> None:
    """Fixes a joint whose leader, the last of `way`, is stationary."""
    leader = way[-1]
    if leader in source.fixed:
        position = source.fixed[leader]
    elif joints[leader].get("type") not in MOVING:
        position = 0.0
    else:
        return
    for name in reversed(way[:-1]):
        mimic = joints[name].find("mimic")
        assert mimic is not None
        multiplier, offset = (source.numbers(mimic, word, 1, default)[0] for word, default in (("multiplier", "1"), ("offset", "0")))
        position = multiplier * position + offset
    source.fixed[way[0]] = position
    joints[way[0]].remove(joints[way[0]].findall("mimic")[0])
    source.note(f"joint '{way[0]}' mimics '{leader}', which is fixed; it is fixed at {position:g}", joints[way[0]])


def _nearest_zero(joint: ElementTree.Element) -> float:
    """Returns the position within the range of a joint that is nearest to zero."""
    limit = joint.find("limit")
    if joint.get("type") == "continuous" or limit is None:
        return 0.0
    return min(max(0.0, float(limit.get("lower", "0"))), float(limit.get("upper", "0")))


def _end(joint: ElementTree.Element, word: str) -> str:
    """Returns the link at one end of a joint."""
    link = joint.find(word)
    return "" if link is None else link.get("link", "")


def _name(joint: ElementTree.Element) -> str:
    return joint.get("name", "")
