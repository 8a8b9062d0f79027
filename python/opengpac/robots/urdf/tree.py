# SPDX-License-Identifier: Apache-2.0
"""Tree of the links and joints of a URDF file; finds the joints between two links."""

from __future__ import annotations

from xml.etree import ElementTree


class Tree:
    """Joints by name, in the order of the file, and the joint to which each link is attached."""

    def __init__(self, root: ElementTree.Element) -> None:
        self.links = {link.get("name", "") for link in root.findall("link")}
        self.joints = {joint.get("name", ""): joint for joint in root.findall("joint")}
        self._above: dict[str, str] = {}
        self._carrier: dict[str, str] = {}
        for name, joint in self.joints.items():
            parent, child = joint.find("parent"), joint.find("child")
            if parent is not None and child is not None:
                self._above[name] = parent.get("link", "")
                self._carrier.setdefault(child.get("link", ""), name)

    def carrier(self, link: str) -> str | None:
        """Returns the joint to which a link is attached, or None for the root."""
        return self._carrier.get(link)

    def above(self, link: str) -> list[str]:
        """Returns the joints between a link and the root, nearest first."""
        found: list[str] = []
        joint = self.carrier(link)
        while joint is not None and joint not in found:
            found.append(joint)
            joint = self.carrier(self._above[joint])
        return found

    def chain(self, base: str, tip: str) -> list[str]:
        """Returns the joints between two links, through their common ancestor if neither carries the other."""
        down, up = self.above(tip), self.above(base)
        while down and up and down[-1] == up[-1]:
            down.pop()
            up.pop()
        return [*up, *reversed(down)]

    def moved(self, joint: str) -> list[str]:
        """Returns the joints between a joint and the root, starting with the joint itself."""
        return [joint, *self.above(self._above.get(joint, ""))]
