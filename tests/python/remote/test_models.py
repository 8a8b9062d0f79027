# SPDX-License-Identifier: Apache-2.0
"""Files to which a model refers are transferred with it, under names in one folder."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

import opengpac as gpac
from opengpac.remote.files import model_files


def test_a_model_without_references_stays_as_it_is(tmp_path: Path) -> None:
    main = tmp_path / "arm.xml"
    main.write_bytes(b"<mujoco>\r\n  <worldbody/>\n</mujoco>")
    assert model_files(main) == {"arm.xml": main.read_bytes()}


def test_meshes_textures_and_includes_are_named_anew(tmp_path: Path) -> None:
    for name, text in (("meshes/base.obj", "base"), ("other/base.obj", "other"), ("skins/wood.png", "wood"), ("parts/tool.xml", "")):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    (tmp_path / "parts/tool.xml").write_text('<mujocoinclude><asset><mesh file="../other/base.obj"/></asset></mujocoinclude>')
    (tmp_path / "arm.xml").write_text(
        '<mujoco><compiler meshdir="meshes" texturedir="skins"/><include file="parts/tool.xml"/>'
        '<asset><mesh file="base.obj"/><texture name="t" type="cube" fileup="wood.png"/></asset></mujoco>'
    )
    files = model_files(tmp_path / "arm.xml")
    assert next(iter(files)) == "arm.xml" and all("/" not in name for name in files)
    assert sorted(files.values())[-3:] == [b"base", b"other", b"wood"]
    root = ElementTree.fromstring(files["arm.xml"])
    compiler, mesh, include, texture = (root.find(f".//{tag}") for tag in ("compiler", "mesh", "include", "texture"))
    assert compiler is not None and compiler.attrib == {}
    assert mesh is not None and mesh.get("name") == "base" and files[mesh.attrib["file"]] == b"base"
    assert texture is not None and files[texture.attrib["fileup"]] == b"wood"
    assert include is not None
    inner = ElementTree.fromstring(files[include.attrib["file"]]).find(".//mesh")
    assert inner is not None and files[inner.attrib["file"]] == b"other"


def test_what_is_not_there_is_said(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text('<mujoco><asset><mesh file="base.obj"/></asset></mujoco>')
    with pytest.raises(gpac.DeviceFailed, match=r"cannot read '.*base\.obj': no such file"):
        model_files(tmp_path / "arm.xml")
    with pytest.raises(gpac.DeviceFailed, match=r"cannot read '.*other\.xml'"):
        model_files(tmp_path / "other.xml")
    (tmp_path / "arm.xml").write_text("arm")
    with pytest.raises(gpac.DeviceFailed, match="is not XML"):
        model_files(tmp_path / "arm.xml")
