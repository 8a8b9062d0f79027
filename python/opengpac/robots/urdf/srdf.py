# SPDX-License-Identifier: Apache-2.0
"""SRDF files: the joints of a URDF file that form an arm, its home, links that do not collide, and joints without a motor.

Interpreted as in MoveIt. A name that the URDF file lacks is ignored with a note; an invalid file is refused.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

from ...errors import DeviceFailed, UnknownName, did_you_mean, refuse
from ..plausible import ANGLE
from .packages import Packages
from .source import Source
from .tree import Tree

_MEMBERS = ("joint", "link", "chain", "group")


@dataclass(frozen=True)
class State:
    """Named positions of joints, rad or m; `group` is the group to which they belong, or empty."""

    name: str
    group: str
    positions: Mapping[str, float]


@dataclass(frozen=True)
class EndEffector:
    """A tool: the link to which it is attached, the group of its own joints, and the group of the arm, which is empty if not specified."""

    link: str
    group: str
    arm: str


@dataclass
class Semantics:
    """Contents of an SRDF file that concern the joints and links of the URDF file.

    `groups` contains the joints of each group in the order of the URDF file, including fixed ones; `lines` contains the line of each
    group, `tips` the last link of a group that is a single chain, and `pairs` the links that do not collide, each pair once.
    """

    file: Path | None = None
    groups: dict[str, tuple[str, ...]] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)
    tips: dict[str, str] = field(default_factory=dict)
    states: list[State] = field(default_factory=list)
    passive: set[str] = field(default_factory=set)
    pairs: list[tuple[str, str]] = field(default_factory=list)
    end_effectors: list[EndEffector] = field(default_factory=list)

    def states_of(self, joints: Collection[str]) -> dict[str, dict[str, float]]:
        """Returns the states that include any of these joints, by name; states with the same name, such as those of an arm and its hand,
        are merged."""
        found: dict[str, dict[str, float]] = {}
        for state in self.states:
            if not set(joints).isdisjoint(state.positions):
                found.setdefault(state.name, {}).update(state.positions)
        return found

    def home_of(self, joints: Collection[str]) -> tuple[str, dict[str, float]]:
        """Returns the name and the positions of the initial state of an arm with these joints: `home`, or else the only state, or else
        an empty one."""
        states = self.states_of(joints)
        name = "home" if "home" in states else next(iter(states)) if len(states) == 1 else ""
        return name, states.get(name, {})


def beside(urdf: Path) -> list[Path]:
    """Returns the SRDF files in the folder of a URDF file; if there are none, those in the sibling folder `srdf`.

    `.srdf.xacro` files are considered only in a folder without `.srdf` files, because those with the same name are often generated
    from them.
    """
    for folder in (urdf.parent, urdf.parent.parent / "srdf"):
        for pattern in ("*.srdf", "*.srdf.xacro"):
            if found := sorted(folder.glob(pattern)):
                return found
    return []


def read(file: Path, arm: Source, packages: Packages) -> Semantics:
    """Returns the contents of an SRDF file for a URDF file. Raises `DeviceFailed` with the line if it is invalid."""
    source = Source.read(file, packages, "SRDF")
    return _Reading(source, Tree(arm.root), arm).semantics()


class _Reading:
    """Reader state for one SRDF file."""

    def __init__(self, source: Source, tree: Tree, arm: Source) -> None:
        self.source, self.tree, self.arm = source, tree, arm
        self.groups: dict[str, ElementTree.Element] = {}
        self.virtual = {joint.get("name", "") for joint in source.root.findall("virtual_joint")}
        self.foreign: dict[str, ElementTree.Element] = {}
        """Names in the SRDF file that do not exist in the URDF file."""
        self.lost: dict[str, ElementTree.Element] = {}
        """Notes on references to groups that the SRDF file does not define."""

    def semantics(self) -> Semantics:
        root, found = self.source.root, Semantics(self.source.file)
        for element in root.findall("group"):
            name = self._named(element)
            if name in self.groups:
                self.source.refuse(element, f"two groups are named '{name}'", "rename one of them")
            self.groups[name] = element
            found.lines[name] = self.source.line(element)
        for name, element in self.groups.items():
            joints = set(self._joints(element, (name,)))
            found.groups[name] = tuple(joint for joint in self.tree.joints if joint in joints)
            chains = element.findall("chain")
            if len(chains) == 1 and chains[0].get("tip_link") in self.tree.links:
                found.tips[name] = chains[0].get("tip_link", "")
        found.states.extend(self._state(element) for element in root.findall("group_state"))
        for element in root.findall("passive_joint"):
            name = self._named(element)
            if self._has("joint", name, element):
                found.passive.add(name)
        found.pairs.extend(sorted({pair for element in root.findall("disable_collisions") if (pair := self._pair(element))}))
        for element in root.findall("end_effector"):
            link = element.get("parent_link", "")
            if self._has("link", link, element):
                found.end_effectors.append(EndEffector(link, element.get("group", ""), element.get("parent_group", "")))
        self._tell()
        return found

    def _named(self, element: ElementTree.Element) -> str:
        name = element.get("name", "").strip()
        if not name:
            self.source.refuse(element, f"a <{element.tag}> has no name", "add one")
        return name

    def _has(self, kind: str, name: str, element: ElementTree.Element) -> bool:
        """Returns whether the URDF file has a joint or link; records the name if it does not."""
        if name in (self.tree.joints if kind == "joint" else self.tree.links):
            return True
        if name not in self.virtual:
            self.foreign.setdefault(f"{kind} '{name}'", element)
        return False

    def _joints(self, group: ElementTree.Element, inside: tuple[str, ...]) -> list[str]:
        """Returns the joints of a group; `inside` contains the enclosing groups."""
        found: list[str] = []
        for member in group:
            if member.tag == "chain":
                found += self._chain(member, inside[0])
            elif member.tag == "group":
                found += self._subgroup(member, inside)
            elif member.tag in ("joint", "link"):
                name = self._named(member)
                joint = (name if member.tag == "joint" else self.tree.carrier(name)) if self._has(member.tag, name, member) else None
                found += [] if joint is None else [joint]
            else:
                known = " or ".join(f"<{tag}>" for tag in _MEMBERS)
                self.source.refuse(member, f"group '{inside[-1]}' cannot have a <{member.tag}>", f"use only {known}")
        return found

    def _chain(self, chain: ElementTree.Element, group: str) -> list[str]:
        base, tip = chain.get("base_link", ""), chain.get("tip_link", "")
        if not base or not tip:
            self.source.refuse(chain, f"a chain of group '{group}' lacks base_link or tip_link", "name its first and its last link")
        has_both = [self._has("link", link, chain) for link in (base, tip)]
        return self.tree.chain(base, tip) if all(has_both) else []

    def _subgroup(self, member: ElementTree.Element, inside: tuple[str, ...]) -> list[str]:
        name = self._named(member)
        if name in inside:
            self.source.refuse(member, f"group '{name}' contains itself", "remove it there")
        if name not in self.groups:
            self.lost.setdefault(f"group '{inside[-1]}' contains group '{name}', which is not in the file; it is ignored", member)
            return []
        return self._joints(self.groups[name], (*inside, name))

    def _state(self, element: ElementTree.Element) -> State:
        name, group = self._named(element), element.get("group", "")
        if group and group not in self.groups:
            self.lost[f"state '{name}' belongs to group '{group}', which is not in the file; it is used without a group"] = element
        positions: dict[str, float] = {}
        for member in element.findall("joint"):
            joint = self._named(member)
            # A floating base has several numbers, and its joint is in few files.
            if len(member.get("value", "").split()) > 1 and joint not in self.tree.joints:
                continue
            if self._has("joint", joint, member) and self.tree.joints[joint].get("type") not in ("fixed", "floating", "planar"):
                positions[joint] = self._position(member, f"joint '{joint}' in state '{name}'")
        return State(name, group, positions)

    def _position(self, member: ElementTree.Element, of: str) -> float:
        text = member.get("value", "")
        try:
            value = float(text)
        except ValueError:
            value = float("inf")
        if ANGLE.broken_by([value]) or value != value:
            self.source.refuse(member, f"the value of {of} must be a number, not '{text[:60]}'", "write a number in rad or m")
        return value

    def _pair(self, element: ElementTree.Element) -> tuple[str, str] | None:
        first, second = element.get("link1", ""), element.get("link2", "")
        if not first or not second:
            self.source.refuse(element, "a <disable_collisions> lacks link1 or link2", "name two links")
        has_both = [self._has("link", link, element) for link in (first, second)]
        return (min(first, second), max(first, second)) if all(has_both) and first != second else None

    def _tell(self) -> None:
        """Adds notes on ignored contents: names that the URDF file lacks, and elements that do not belong to SRDF."""
        name, robot = self.source.root.get("name", ""), self.arm.root.get("name", "")
        if name and robot and name != robot:
            self.source.note(f"it describes robot '{name}', but the URDF file describes '{robot}'", self.source.root)
        for sentence, element in self.lost.items():
            self.source.note(sentence, element)
        if self.foreign:
            what, element = next(iter(self.foreign.items()))
            more = f", and neither are {len(self.foreign) - 1} other names in it" if len(self.foreign) > 1 else ""
            self.source.note(f"{what} is not in the URDF file{more}; its entries are ignored", element)
        self.arm.notes += self.source.notes


def chosen(semantics: Semantics, group: str, driven: Collection[str]) -> list[str]:
    """Returns the actuated joints of the requested group. Raises `UnknownName` if the group does not exist."""
    if semantics.file is None:
        refuse(UnknownName, f"there is no group '{group}', because no SRDF file was read", "pass its file: srdf=")
    if group not in semantics.groups:
        refuse(UnknownName, f"'{semantics.file}' has no group '{group}'", did_you_mean(group, semantics.groups))
    joints = [name for name in semantics.groups[group] if name in driven]
    if not joints:
        refuse(
            DeviceFailed,
            f"{semantics.file}:{semantics.lines[group]}: group '{group}' has no joint that a motor drives",
            "add joints of the URDF file that are neither fixed nor passive",
        )
    return joints
