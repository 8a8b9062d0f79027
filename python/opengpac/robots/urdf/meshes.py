# SPDX-License-Identifier: Apache-2.0
"""Meshes of a URDF file: finds them, and converts them to a format that MuJoCo reads, or removes them, because an arm can move without
them."""

from __future__ import annotations

import hashlib
import importlib
import re
from pathlib import Path
from xml.etree import ElementTree

from ...storage import cache
from .packages import Packages
from .source import Source

READ_BY_MUJOCO = (".stl", ".obj", ".msh")
FACES_MAX = 200_000
"""Maximum number of faces that MuJoCo accepts in a mesh."""
_STL_HEAD, _STL_FACE = 84, 50


def place(source: Source, packages: Packages) -> None:
    """Sets the full path of every mesh. Meshes that do not exist or cannot be read are removed with a note.

    Purely visual shapes are removed first, as MuJoCo does unless the file prevents it, because reading their meshes takes seconds.
    """
    compiler = _compiler(source.root)
    if compiler.get("discardvisual", "true") != "false":
        for link in source.root.findall("link"):
            for shape in link.findall("visual"):
                link.remove(shape)
    kept: dict[str, str | None] = {}
    for link in source.root.findall("link"):
        for shape in [shape for kind in ("visual", "collision") for shape in link.findall(kind)]:
            mesh = shape.find("geometry/mesh")
            if mesh is None:
                continue
            name = mesh.get("filename", "")
            if name not in kept:
                kept[name] = _usable(source, mesh, packages.find(name))
            if kept[name] is None:
                link.remove(shape)
            else:
                mesh.set("filename", kept[name] or "")
    compiler.attrib.update({"strippath": "false", "meshdir": ""})


def leave_out(source: Source, problem: str) -> bool:
    """Removes the meshes that a message of MuJoCo names; returns False if it names none."""
    words = set(re.findall(r"[^'\"\s,;:()]+", problem))
    named = {Path(word).stem for word in words} | words
    left_out: set[str] = set()
    for link in source.root.findall("link"):
        for shape in [shape for kind in ("visual", "collision") for shape in link.findall(kind)]:
            mesh = shape.find("geometry/mesh")
            if mesh is not None and Path(mesh.get("filename", "")).stem in named:
                link.remove(shape)
                left_out.add(Path(mesh.get("filename", "")).name)
    for name in sorted(left_out):
        source.note(f"mesh '{name}' is ignored: {' '.join(problem.removeprefix('Error: ').split())}")
    return bool(left_out)


def _usable(source: Source, mesh: ElementTree.Element, file: Path | None) -> str | None:
    """Returns the path of a file that MuJoCo can read, converted if necessary; or None, with a note."""
    name = mesh.get("filename", "")
    if file is None:
        source.note(f"mesh '{name}' was not found and is ignored; specify where packages are with package_paths=", mesh)
        return None
    if file.suffix.lower() in READ_BY_MUJOCO and not _is_ascii_stl(file):
        return str(file)
    try:
        trimesh = importlib.import_module("trimesh")
    except ImportError:
        source.note(f"mesh '{name}' is ignored: 'trimesh', which reads {file.suffix or 'such files'}, is not installed", mesh)
        return None
    try:
        shape = trimesh.load(file, force="mesh")
        if len(shape.faces) == 0:
            raise ValueError("it has no face")
        if shape.units:
            shape.convert_units("meters")
        content = shape.export(file_type="stl")
    except Exception as error:  # the reader of each format raises its own
        source.note(f"mesh '{name}' is ignored: {' '.join(str(error).split())}", mesh)
        return None
    kept = cache.folder("models") / hashlib.sha256(content).hexdigest()[:32] / f"{file.stem}.stl"
    if not kept.exists():
        cache.keep(kept, content)
    return str(kept)


def _is_ascii_stl(file: Path) -> bool:
    """Returns whether an STL file is in ASCII format. MuJoCo reads only the binary format, whose length follows from its number of
    faces."""
    if file.suffix.lower() != ".stl":
        return False
    with open(file, "rb") as opened:
        head = opened.read(_STL_HEAD)
    faces = int.from_bytes(head[80:84], "little") if len(head) == _STL_HEAD else 0
    return head[:5] == b"solid" and file.stat().st_size != _STL_HEAD + faces * _STL_FACE


def _compiler(root: ElementTree.Element) -> ElementTree.Element:
    """Returns the element from which MuJoCo takes its settings in a URDF file."""
    mujoco = root.find("mujoco")
    if mujoco is None:
        mujoco = ElementTree.SubElement(root, "mujoco")
    compiler = mujoco.find("compiler")
    return ElementTree.SubElement(mujoco, "compiler") if compiler is None else compiler
