# SPDX-License-Identifier: Apache-2.0
"""Locations of the files to which a URDF file refers by `package://PACKAGE/PATH`.

The program `expand.py` uses this module too, so it imports nothing from OpenGPAC.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree

ABOVE = 2
"""Number of folder levels above a file in which a relative path is searched for."""


class Packages:
    """Folders in which the files that a URDF file refers to are searched for.

    They are searched in this order: `given` (folders of packages, or packages themselves), the folders in `ROS_PACKAGE_PATH`, `share`
    in the folders of `AMENT_PREFIX_PATH`, and the folders above the file.
    """

    def __init__(self, file: Path, given: Iterable[Path] = ()) -> None:
        self._folder = file.parent
        ros = [Path(path) for path in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if path]
        ament = [Path(path) / "share" for path in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if path]
        self.roots = [*given, *ros, *ament, *file.absolute().parents]

    def find(self, name: str) -> Path | None:
        """Returns the file with that name. Searches in a package, by URL, relative to the URDF file or to a folder above it, and next to
        it."""
        name = unquote(name.strip())
        if name.startswith("package://"):
            package, _, path = name.removeprefix("package://").partition("/")
            candidates = [folder / path for folder in self._folders(package)]
        else:
            path = name.removeprefix("file://")
            # Paths in some files are relative to their package's folder, which is above their own.
            candidates = [folder / path for folder in (self._folder, *self._folder.absolute().parents[:ABOVE])]
        candidates += [self._folder / path, self._folder / Path(path).name]
        return next((found for found in candidates if found.is_file()), None)

    def folder(self, package: str) -> Path | None:
        """Returns the folder of a package, or None if it was not found."""
        return next(self._folders(package), None)

    def _folders(self, package: str) -> Iterator[Path]:
        if not package:
            return
        for root in self.roots:
            if root.name == package or _name(root) == package:
                yield root
            if (root / package).is_dir():
                yield root / package


def _name(folder: Path) -> str | None:
    """Returns the name that the `package.xml` of a folder declares."""
    try:
        name = ElementTree.parse(folder / "package.xml").find("name")
    except (OSError, ElementTree.ParseError, LookupError, ValueError):
        return None
    return name.text.strip() if name is not None and name.text else None
