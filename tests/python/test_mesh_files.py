# SPDX-License-Identifier: Apache-2.0
"""Meshes of URDF files in every common format: the collision shape is that of the file."""

from __future__ import annotations

import importlib
import itertools
import json
import struct
import sys
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac.robots import urdf

ARM = """<robot name="arm"><link name="base"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="100" velocity="2"/></joint>
<link name="upper"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><mesh filename="{}"/></geometry></collision></link></robot>"""
POINTS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
"""Tetrahedron of 1 m."""


def obj() -> bytes:
    lines = [f"v {x} {y} {z}" for x, y, z in POINTS] + ["f " + " ".join(str(index + 1) for index in face) for face in FACES]
    return "\n".join(lines).encode()


def ply() -> bytes:
    head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n"
    lines = [f"{x} {y} {z}" for x, y, z in POINTS] + ["3 " + " ".join(map(str, face)) for face in FACES]
    return (head + "property list uchar int vertex_indices\nend_header\n" + "\n".join(lines) + "\n").encode()


def stl_as_text() -> bytes:
    corners = [["vertex {} {} {}".format(*POINTS[index]) for index in face] for face in FACES]
    faces = ["facet normal 0 0 0\nouter loop\n" + "\n".join(of) + "\nendloop\nendfacet" for of in corners]
    return ("solid part\n" + "\n".join(faces) + "\nendsolid part\n").encode()


def stl() -> bytes:
    faces = b"".join(struct.pack("<12fH", 0.0, 0.0, 0.0, *(value for index in face for value in POINTS[index]), 0) for face in FACES)
    return bytes(80) + struct.pack("<I", len(FACES)) + faces


def glb() -> bytes:
    """Returns glTF 2.0 in one file: a header, the description, the numbers."""
    points = b"".join(struct.pack("<3f", *point) for point in POINTS)
    faces = b"".join(struct.pack("<3H", *face) for face in FACES)
    views = [{"buffer": 0, "byteOffset": 0, "byteLength": len(points)}, {"buffer": 0, "byteOffset": len(points), "byteLength": len(faces)}]
    description = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0.0] * 3, "max": [1.0] * 3},
            {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": len(points + faces)}],
    }
    text = json.dumps(description).encode()
    text += b" " * (-len(text) % 4)
    inner = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(points + faces), 0x004E4942) + points + faces
    return struct.pack("<III", 0x46546C67, 2, 12 + len(inner)) + inner


READ: dict[str, Callable[[], bytes]] = {"part.obj": obj, "part.stl": stl, "text.stl": stl_as_text, "part.ply": ply, "part.glb": glb}
OTHERS: dict[str, Callable[[], bytes]] = {"text.stl": stl_as_text, "part.ply": ply, "part.dae": lambda: b"<COLLADA/>"}


@pytest.mark.parametrize("name", READ)
def test_a_mesh_of_that_format_is_the_shape_of_its_link(tmp_path: Path, name: str) -> None:
    mujoco: Any = importlib.import_module("mujoco")
    (tmp_path / name).write_bytes(READ[name]())
    (tmp_path / "arm.urdf").write_text(ARM.format(name))
    converted = urdf.convert(tmp_path / "arm.urdf")
    assert converted.notes == ()
    corners = mujoco.MjModel.from_xml_string(converted.text).mesh_vert
    edges = [float(np.linalg.norm(one - other)) for one, other in itertools.combinations(corners, 2)]
    assert sorted(edges) == pytest.approx([1.0] * 3 + [2.0**0.5] * 3, abs=1e-5)


MAKERS = Path(str(metadata.distribution("rtb-data").locate_file("rtbdata")))
KUKA = MAKERS / "xacro/kuka_description"


def extents(folder: Path, file: Path) -> np.ndarray:
    """Returns the size of the shape made from a mesh, along its principal axes, m."""
    mujoco: Any = importlib.import_module("mujoco")
    (folder / "arm.urdf").write_text(ARM.format(file))
    converted = urdf.convert(folder / "arm.urdf")
    assert converted.notes == ()
    corners = mujoco.MjModel.from_xml_string(converted.text).mesh_vert
    return np.sort(np.ptp(corners, axis=0))


@pytest.mark.parametrize("link", ["kuka_kr210/meshes/kr210l150/{}/link_3.{}", "kuka_kr16/meshes/kr16_2/{}/link_2.{}"])
def test_a_mesh_of_a_maker_in_collada_is_as_large_as_the_one_in_stl(tmp_path: Path, link: str) -> None:
    """The first is in inches. The visual mesh of a link and its simpler hull differ by about a tenth."""
    seen, hull = extents(tmp_path, KUKA / link.format("visual", "dae")), extents(tmp_path, KUKA / link.format("collision", "stl"))
    assert seen == pytest.approx(hull, rel=0.15)


def test_a_scan_in_ply_is_a_shape(tmp_path: Path) -> None:
    assert 0.5 < extents(tmp_path, MAKERS / "data/test-mesh/walle2.ply").min() < 1.0


def test_meshes_that_are_only_seen_are_not_read(tmp_path: Path) -> None:
    (tmp_path / "part.dae").write_text("<COLLADA/>")
    (tmp_path / "arm.urdf").write_text(ARM.format("part.dae").replace("collision", "visual"))
    assert urdf.convert(tmp_path / "arm.urdf").notes == ()


@pytest.mark.parametrize("content", [b"", b"<COLLADA/>", b"\0" * 1000, b"solid", b"glTF\2\0\0\0"])
@pytest.mark.parametrize("ending", ["dae", "ply", "glb", "gltf", "stl", "obj", "xyz"])
def test_a_damaged_mesh_is_left_out_with_a_note(tmp_path: Path, ending: str, content: bytes) -> None:
    (tmp_path / f"part.{ending}").write_bytes(content)
    (tmp_path / "arm.urdf").write_text(ARM.format(f"part.{ending}"))
    assert any(f"mesh 'part.{ending}' is ignored" in note for note in urdf.convert(tmp_path / "arm.urdf").notes)


@pytest.mark.parametrize("name", OTHERS)
def test_an_arm_moves_without_a_mesh_that_nothing_here_reads(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "trimesh", None)
    (tmp_path / name).write_bytes(OTHERS[name]())
    (tmp_path / "arm.urdf").write_text(ARM.format(name))
    with pytest.warns(UserWarning, match=rf"arm.urdf:5: mesh '{name}' is ignored: 'trimesh', which reads .*, is not installed"):
        arm = gpac.robots.load(tmp_path / "arm.urdf", clock="virtual")
    with arm.system:
        assert arm.enable().turn.state == "standstill"
