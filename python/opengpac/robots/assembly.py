# SPDX-License-Identifier: Apache-2.0
"""Builds one model from several MJCF files: an arm, the tool at its flange, and its surroundings.

MJCF can include a file, but cannot add to a body of an included one, so it cannot express a gripper attached to an arm. Therefore the
parts of the second file are moved here: the tool's bodies to the body of the flange's site, everything else to the section of the
same name. The positions of the keyframes `home` are concatenated.
"""

from __future__ import annotations

import copy
from pathlib import Path
from xml.etree import ElementTree

from ..errors import DeviceFailed, refuse
from ..storage.files import XML_DEPTH_MAX, XML_ERRORS, is_too_deep

FLANGE_SITES = ("tool", "attachment_site")
"""Names of the site to which a tool is attached; the first that exists is used."""


def assemble(arm: Path, tool: Path | None, scene: Path | None) -> str:
    """Returns the text of the model of an arm with a tool and a scene. The tool is attached at the arm's site `tool`.

    Joints of the arm come first, then the tool's, then the scene's; the defaults of each file apply to its own elements. Raises
    `DeviceFailed` for a file that is not MJCF, an arm without such a site, files with different angle units, or a keyframe `home` in
    only some of the files.
    """
    whole = _read(arm)
    _keep_defaults(whole, f"{arm.stem} arm")
    for part, file in (("tool", tool), ("scene", scene)):
        if file is None:
            continue
        added = _read(file)
        _keep_defaults(added, f"{file.stem} {part}")
        if _angle(added) != _angle(whole):
            _turned_to(_angle(whole), added, file)
        home = _body_of_flange(whole, arm) if part == "tool" else _section(whole, "worldbody")
        _add(whole, added, home, file)
    return ElementTree.tostring(whole, encoding="unicode")


def joint_names(file: Path) -> set[str]:
    """Returns the names of a model's own joints, excluding unnamed ones."""
    return {joint.attrib["name"] for joint in _read(file).iter("joint") if "name" in joint.attrib}


def has_site(file: Path, name: str) -> bool:
    """Returns whether a model has a site of that name."""
    return any(site.get("name") == name for site in _read(file).iter("site"))


def _read(file: Path) -> ElementTree.Element:
    try:
        root = ElementTree.parse(file).getroot()
    except OSError as error:
        refuse(DeviceFailed, f"cannot read '{file}': {error.strerror}", "pass the path of an MJCF file")
    except XML_ERRORS as error:
        refuse(DeviceFailed, f"'{file}' is not XML: {error}", "pass the path of an MJCF file")
    if is_too_deep(root):
        refuse(DeviceFailed, f"the elements of '{file}' are nested more than {XML_DEPTH_MAX} levels deep", "pass the path of an MJCF file")
    for element in root.iter():
        if "file" in element.attrib:
            element.set("file", str(file.parent / element.attrib["file"]))
    return root


def _angle(root: ElementTree.Element) -> str:
    compiler = root.find("compiler")
    return "degree" if compiler is None else compiler.get("angle", "degree")


def _turned_to(unit: str, added: ElementTree.Element, file: Path) -> None:
    """Accepts a file with a different angle unit if it contains no angles, that is, neither hinges with a range nor Euler angles."""
    hinges = [joint for joint in added.iter("joint") if joint.get("type", "hinge") == "hinge" and joint.get("class") is None]
    if any("euler" in element.attrib or "axisangle" in element.attrib for element in added.iter()) or any(
        "range" in joint.attrib for joint in hinges
    ):
        refuse(DeviceFailed, f"'{file}' has angles in {_angle(added)}s, but the arm in {unit}s", f"write its angles in {unit}s")


def _keep_defaults(root: ElementTree.Element, name: str) -> None:
    """Converts the file's default class to a class of that name, and assigns it to the elements that used the default."""
    top = root.find("default")
    if top is None:
        return
    kinds = {element.tag for element in top if element.tag != "default"}
    inner = ElementTree.Element("default", {"class": name})
    inner.extend(list(top))
    top[:] = [inner]
    for section in root:
        if section is not top:
            _give_class(section, name, kinds)


def _give_class(element: ElementTree.Element, name: str, kinds: set[str]) -> None:
    for child in element:
        if child.tag in kinds and "class" not in child.attrib:
            child.set("class", name)
        if "childclass" not in child.attrib:
            _give_class(child, name, kinds)


def _section(root: ElementTree.Element, name: str) -> ElementTree.Element:
    found = root.find(name)
    return ElementTree.SubElement(root, name) if found is None else found


def _body_of_flange(root: ElementTree.Element, arm: Path) -> ElementTree.Element:
    """Adds a frame at the flange's site to the body of the site, and returns that frame."""
    for name in FLANGE_SITES:
        for body in root.iter("body"):
            for site in body.findall("site"):
                if site.get("name") == name:
                    pose = {k: v for k, v in site.attrib.items() if k in ("pos", "quat", "euler", "axisangle", "xyaxes", "zaxis")}
                    return ElementTree.SubElement(body, "frame", pose)
    refuse(DeviceFailed, f"the arm of '{arm}' has no site for a tool", f"add a site '{FLANGE_SITES[0]}' at its flange")


def _add(whole: ElementTree.Element, added: ElementTree.Element, home: ElementTree.Element, file: Path) -> None:
    key, more = _home(whole), _home(added)
    moves = added.find(".//joint") is not None or added.find(".//freejoint") is not None
    if (key is None) != (more is None) and (moves or more is not None):
        refuse(DeviceFailed, f"keyframe 'home' is missing in some files of the model with '{file}'", "add it to all of them, or to none")
    for section in added:
        if section.tag == "worldbody":
            home.extend(copy.deepcopy(list(section)))
        elif section.tag == "option":
            _section(whole, "option").attrib.update(section.attrib)
        elif section.tag not in ("compiler", "keyframe"):
            _section(whole, section.tag).extend(copy.deepcopy(list(section)))
    if key is not None and more is not None:
        key.set("qpos", f"{key.get('qpos', '')} {more.get('qpos', '')}".strip())


def _home(root: ElementTree.Element) -> ElementTree.Element | None:
    return next((key for key in root.iter("key") if key.get("name") == "home"), None)
