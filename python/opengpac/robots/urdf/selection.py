# SPDX-License-Identifier: Apache-2.0
"""Selection of the joints of a URDF file: those that have a motor, that form the arm or that are stationary, and their initial
positions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from . import srdf
from .source import Source
from .structure import MOVING
from .tree import Tree


@dataclass(frozen=True)
class Selection:
    """Joints of a file, by role.

    `motors` have a motor. `arm` contains those of the selected group, and is empty if no group is selected. `still` are stationary at
    `home`, which contains positions of joints, rad or m; `state` is the name of its SRDF state. `tip` is the link whose frame is the
    frame of poses, empty for the flange of the last joint.
    """

    motors: frozenset[str]
    arm: frozenset[str]
    still: frozenset[str]
    home: Mapping[str, float]
    state: str
    tip: str


def select(source: Source, semantics: srdf.Semantics, initial: Mapping[str, float], group: str | None) -> Selection:
    """Selects the joints of a group, or all joints. Without an SRDF state they start at `initial`.

    Joints outside the group are stationary, except joints of its end effectors, which have motors, and joints that never have one.
    """
    tree = Tree(source.root)
    moving = [name for name, joint in tree.joints.items() if joint.get("type") in MOVING]
    fixed = {name: position for name, position in source.fixed.items() if name in moving}
    driven = {name for name in moving if name not in source.followers and name not in semantics.passive and name not in fixed}
    if group is None:
        state, home = semantics.home_of(driven)
        positions = {**_inside(source, tree, home or initial, state), **fixed}
        return Selection(frozenset(driven), frozenset(), frozenset(fixed), positions, state, "")
    members = srdf.chosen(semantics, group, driven)
    state, home = semantics.home_of(members)
    hands = _hands(tree, semantics, group, members)
    motors = driven & (set(members) | hands)
    still = {name for name in moving if name in driven - motors or _leader(tree, name) in driven - motors} | {*fixed}
    positions = {**_inside(source, tree, _followed(tree, home or initial, still - {*fixed}), state), **fixed}
    return Selection(frozenset(motors), frozenset(members), frozenset(still), positions, state, _tip(tree, semantics, group, members))


def _leader(tree: Tree, name: str) -> str:
    """Returns the joint that a mimic joint ultimately follows, or an empty text."""
    found, seen = "", {name}
    while (mimic := tree.joints[found or name].find("mimic")) is not None:
        found = mimic.get("joint", "")
        if found in seen or found not in tree.joints:
            break
        seen.add(found)
    return found


def _followed(tree: Tree, home: Mapping[str, float], still: set[str]) -> dict[str, float]:
    """Returns the positions, including those of stationary mimic joints."""
    found = dict(home)
    for name in still:
        mimic = tree.joints[name].find("mimic")
        if mimic is not None:
            multiplier, offset = (float(mimic.get(word, default)) for word, default in (("multiplier", "1"), ("offset", "0")))
            found[name] = multiplier * found.get(mimic.get("joint", ""), 0.0) + offset
    return found


def _inside(source: Source, tree: Tree, home: Mapping[str, float], state: str) -> dict[str, float]:
    """Returns the positions, clamped to the ranges of their joints."""
    found: dict[str, float] = {}
    for name, position in home.items():
        joint = tree.joints[name]
        limit = joint.find("limit")
        found[name] = position
        if joint.get("type") not in ("revolute", "prismatic") or limit is None:
            continue
        low, high = float(limit.get("lower", "0")), float(limit.get("upper", "0"))
        found[name] = min(max(position, low), high)
        if abs(found[name] - position) > 1e-6:
            where = f"in state '{state}'" if state else "initially"
            source.note(
                f"joint '{name}' is {where} at {position:g}, outside its range, {low:g} to {high:g}; it starts at the end of the range",
                joint,
            )
    return found


def _hands(tree: Tree, semantics: srdf.Semantics, group: str, members: list[str]) -> set[str]:
    """Returns the joints of the end effectors that a group carries."""
    found: set[str] = set()
    for effector in semantics.end_effectors:
        own = semantics.groups.get(effector.group, ())
        if set(own).isdisjoint(semantics.groups[group]) and (
            effector.arm == group or not set(tree.above(effector.link)).isdisjoint(members)
        ):
            found.update(own)
    return found


def _tip(tree: Tree, semantics: srdf.Semantics, group: str, members: list[str]) -> str:
    """Returns the last link of a group that is a chain; otherwise the link of an end effector that the last joint of the group moves."""
    if group in semantics.tips:
        return semantics.tips[group]
    last = max(members, key=lambda name: len(tree.moved(name)))
    for effector in semantics.end_effectors:
        if group in (effector.arm, effector.group) and last in tree.above(effector.link):
            return effector.link
    return ""
