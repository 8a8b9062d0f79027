# SPDX-License-Identifier: Apache-2.0
"""A URDF file as a tree of elements with line numbers."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NoReturn
from xml.etree import ElementTree
from xml.parsers import expat

from ...errors import DeviceFailed, refuse
from ...storage.files import XML_DEPTH_MAX
from . import macros
from .encoding import decoded, save_remedy
from .packages import Packages


class Source:
    """A file that is being corrected: its elements, and the notes on the changes."""

    def __init__(self, file: Path, root: ElementTree.Element, places: dict[ElementTree.Element, tuple[int, str]]) -> None:
        self.file = file
        self.root = root
        self.notes: list[str] = []
        self.followers: set[str] = set()
        """Joints that follow another joint (`mimic`)."""
        self.fixed: dict[str, float] = {}
        """Joints that cannot move, with their positions, rad or m."""
        self._places = places

    @classmethod
    def read(cls, file: Path, packages: Packages, kind: str = "URDF") -> Source:
        """Reads a URDF or SRDF file, with its xacro macros expanded. Raises `DeviceFailed` with the line of an error."""
        try:
            content = file.read_bytes()
        except OSError as error:
            refuse(DeviceFailed, f"cannot read '{file}': {error.strerror}", f"pass the path of a {kind} file")
        kinds = "URDF or MJCF" if kind == "URDF" else kind
        found = parsed(file, content, kinds)
        macro = macros.first(found.root.iter())
        if macro is not None or file.suffix == ".xacro":
            line = found.line(found.root if macro is None else macro)
            found = parsed(file, macros.expanded(file, packages, line), kinds)
        if found.root.tag != "robot":
            refuse(DeviceFailed, f"'{file}' begins with <{found.root.tag}>, not with <robot>", f"pass a {kinds} file")
        return found

    def line(self, element: ElementTree.Element) -> int:
        """Returns the line at which an element begins."""
        return self._places.get(element, (1, ""))[0]

    def called(self, element: ElementTree.Element) -> str:
        """Returns the kind and name of an element; for one without a name, its tag and the nearest enclosing element that has a name."""
        owner = self._places.get(element, (1, ""))[1]
        return owner if "name" in element.attrib else f"<{element.tag}>" + (f" of {owner}" if owner else "")

    def note(self, sentence: str, element: ElementTree.Element | None = None) -> None:
        """Records a note on a correction."""
        place = f"{self.file.name}:{self.line(element)}: " if element is not None else f"{self.file.name}: "
        self.notes.append(place + sentence)

    def refuse(self, element: ElementTree.Element, problem: str, remedy: str) -> NoReturn:
        """Refuses the file because of an element."""
        refuse(DeviceFailed, f"{self.file}:{self.line(element)}: {problem}", remedy)

    def refuse_number(self, element: ElementTree.Element, attribute: str, problem: str, remedy: str) -> NoReturn:
        """Refuses the file because of the value of an attribute."""
        self.refuse(element, f'{attribute}="{element.get(attribute, "")[:60]}" of {self.called(element)} {problem}', remedy)

    def numbers(self, element: ElementTree.Element, attribute: str, count: int, default: str, is_finite: bool = True) -> list[float]:
        """Returns the numbers of an attribute. Refuses malformed numbers, and, with `is_finite`, infinite ones."""
        text = element.get(attribute, default)
        try:
            values = [float(word) for word in text.split()]
        except ValueError:
            values = []
        if len(values) != count or any(math.isnan(value) or (is_finite and math.isinf(value)) for value in values):
            wanted = "a number" if count == 1 else f"{count} numbers"
            self.refuse_number(element, attribute, f"is not {wanted}", f"write {wanted} there")
        return values

    def text(self) -> str:
        """Returns the file's current text."""
        return ElementTree.tostring(self.root, encoding="unicode")


def check_xml(file: Path, kinds: str) -> None:
    """Refuses a file that is not XML, with the line; does nothing if the file cannot be read."""
    try:
        content = file.read_bytes()
    except OSError:
        return
    parsed(file, content, kinds)


def parsed(file: Path, content: bytes, kinds: str) -> Source:
    """Returns the elements with their lines. Namespace prefixes need not be declared, because files often omit the declarations for
    plugins and macros."""
    content, encoding = decoded(file, content)
    parser = expat.ParserCreate(encoding)
    places: dict[ElementTree.Element, tuple[int, str]] = {}
    open_elements: list[ElementTree.Element] = []
    roots: list[ElementTree.Element] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = ElementTree.Element(tag, attributes)
        name = attributes.get("name", "")
        around = places[open_elements[-1]][1] if len(open_elements) > 1 else ""
        places[element] = parser.CurrentLineNumber, f"{tag} '{name}'" if name else around
        if len(open_elements) >= XML_DEPTH_MAX:
            deep = f"{file}:{parser.CurrentLineNumber}: the elements are nested more than {XML_DEPTH_MAX} levels deep"
            refuse(DeviceFailed, deep, f"pass a {kinds} file")
        (open_elements[-1] if open_elements else roots).append(element)
        open_elements.append(element)

    def text(content: str) -> None:
        # Only parameters of ros2_control have text contents.
        if open_elements and open_elements[-1].tag == "param":
            open_elements[-1].text = (open_elements[-1].text or "") + content

    parser.StartElementHandler = start
    parser.CharacterDataHandler = text
    parser.EndElementHandler = lambda _tag: open_elements.pop()
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        what = expat.ErrorString(error.code)
        remedy = save_remedy(content, error.lineno) or f"pass the path of a {kinds} file"
        refuse(DeviceFailed, f"{file}:{error.lineno}: the file is not valid XML: {what}", remedy)
    return Source(file, roots[0], places)
