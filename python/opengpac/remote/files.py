# SPDX-License-Identifier: Apache-2.0
"""Files for a remote system: code modules, and the models of simulated machines with the files to which they refer."""

from __future__ import annotations

import functools
import hashlib
import json
import platform
import re
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlencode
from xml.etree import ElementTree

from .. import _native
from ..errors import DeviceFailed, ModuleError, refusals, refuse
from ..policies.block import whole_content
from ..storage.files import XML_DEPTH_MAX, XML_ERRORS, is_source, is_too_deep
from .session import Session

TARGET = f"{platform.machine()}-{sys.platform}"
"""Platform for which shared objects are built here."""


def put_module(session: Session, path: str, name: str | None) -> dict[str, Any]:
    """Downloads a code module to the system, and returns the system's answer.

    Source code is compiled here if the remote machine has the same platform, so that its includes are found and errors refer to the
    user's file; otherwise it is sent unchanged, and compiled there. An ONNX network has no includes, and is translated there.
    """
    file = Path(path)
    if not file.is_file():
        refuse(ModuleError, f"file '{path}' does not exist", "pass a C or C++ file, or a shared object")
    module = name or file.stem.removeprefix("lib")
    if is_source(file) and file.suffix != ".onnx" and session.version["target"] == TARGET:
        with tempfile.TemporaryDirectory() as folder:
            built = Path(folder) / f"{file.stem}.so"
            with refusals:
                _native.build([path], str(built))
            return _put(session, module, built)
    return _put(session, module, file)


def _put(session: Session, module: str, file: Path) -> dict[str, Any]:
    content = whole_content(file) if file.suffix == ".onnx" else _content(file, ModuleError)
    about = {"file": file.name, "sha256": hashlib.sha256(content).hexdigest()}
    if not is_source(file):
        about |= {"abi": str(_abi()), "target": TARGET}
    return session.answer("PUT", f"/v1/modules/{quote(module, safe='')}?{urlencode(about)}", content)["result"]


@functools.cache
def _abi() -> int:
    """Returns the version of the block interface that modules built here use."""
    found = re.search(r"#define OPENGPAC_ABI (\d+)", _native.header_text())
    assert found is not None, "the header says its version"
    return int(found[1])


def carried(session: Session, kind: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the options of a driver for the remote system: uploads files, and removes options that apply only to this machine."""
    if kind == "plant_process":
        return _carried_process(session, options)
    if kind != "mujoco":
        return dict(options)
    files = model_files(Path(options["path"]))
    for content in files.values():
        _put_file(session, content)
    names = {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
    reference = {"main": next(iter(files)), "files": names}
    return {name: reference if name == "path" else value for name, value in options.items() if name != "library"}


def _carried_process(session: Session, options: Mapping[str, Any]) -> dict[str, Any]:
    inner = options["driver"]
    driver = {"kind": inner["kind"], "options": carried(session, inner["kind"], inner["options"])}
    # The command line belongs to this machine; the remote system has its own.
    return {name: value for name, value in options.items() if name != "command"} | {"driver": driver}


def _put_file(session: Session, content: bytes) -> None:
    path = f"/v1/files/{hashlib.sha256(content).hexdigest()}"
    try:
        session.request("GET", path)
    except _native.Refused as refused:
        if json.loads(refused.args[0])[0]["class"] != "UnknownName":
            raise
        session.answer("PUT", path, content)


def model_files(main: Path) -> dict[str, bytes]:
    """Returns an MJCF file and all files to which it refers, the main file first, renamed so that they can be stored in one folder.

    A model without references is unchanged, byte for byte. Raises `DeviceFailed` for a file that does not exist or is not XML.
    """
    content = _content(main, DeviceFailed)
    root = _parsed(content, main)
    if not any("file" in element.attrib for element in root.iter()):
        return {main.name: content}
    files: dict[str, bytes] = {main.name: b""}
    _collect(root, main.parent, main.parent, _folders(root), files)
    files[main.name] = ElementTree.tostring(root)
    return files


def _folders(root: ElementTree.Element) -> dict[str, str]:
    """Returns the folders of meshes and textures that the model's `compiler` element declares."""
    found: dict[str, str] = {}
    for compiler in root.iter("compiler"):
        both = compiler.attrib.pop("assetdir", "")
        for kind in ("meshdir", "texturedir"):
            found[kind] = compiler.attrib.pop(kind, "") or both or found.get(kind, "")
    return found


_REFERENCES = ("file", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback")
"""Attributes that name a file; a cube texture may have six of them."""


def _collect(root: ElementTree.Element, folder: Path, top: Path, folders: Mapping[str, str], files: dict[str, bytes]) -> None:
    """Collects the files to which a tree refers, and renames them in the tree."""
    for element in root.iter():
        if element.tag == "include":
            given = element.attrib["file"]
            file = folder / given if (folder / given).exists() else top / given
            inner = _parsed(_content(file, DeviceFailed), file)
            name = _fresh(file, files)
            _collect(inner, file.parent, top, {**folders, **{k: v for k, v in _folders(inner).items() if v}}, files)
            files[name] = ElementTree.tostring(inner)
            element.set("file", name)
            continue
        for key in [key for key in element.attrib if key in _REFERENCES]:
            file = top / folders.get("texturedir" if element.tag == "texture" else "meshdir", "") / element.attrib[key]
            name = _fresh(file, files)
            files[name] = _content(file, DeviceFailed)
            element.set(key, name)
            # An unnamed asset takes its name from its file, which has changed.
            if key == "file" and "name" not in element.attrib:
                element.set("name", file.stem)


def _fresh(file: Path, files: dict[str, bytes]) -> str:
    """Returns a name that no other file has, and reserves it."""
    name, more = file.name, 1
    while name in files:
        name, more = f"{file.stem}_{more}{file.suffix}", more + 1
    files[name] = b""
    return name


def _parsed(content: bytes, file: Path) -> ElementTree.Element:
    try:
        root = ElementTree.fromstring(content)
        if is_too_deep(root):
            refuse(
                DeviceFailed, f"the elements of '{file}' are nested more than {XML_DEPTH_MAX} levels deep", "pass the path of an MJCF file"
            )
        return root
    except XML_ERRORS as error:
        refuse(DeviceFailed, f"'{file}' is not XML: {error}", "pass the path of an MJCF file")


def _content(file: Path, kind: type[DeviceFailed | ModuleError]) -> bytes:
    try:
        return file.read_bytes()
    except OSError as error:
        refuse(kind, f"cannot read '{file}': {(error.strerror or str(error)).lower()}", "check the path")
