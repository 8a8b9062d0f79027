# SPDX-License-Identifier: Apache-2.0
"""The page's view of a whole cell: an installed arm, its shape, its forms."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from mcap import reader

import opengpac as gpac
from opengpac import motion


def drawn(text: str) -> Any:
    """Returns the answer of a call of the core."""
    return json.loads(text)


def test_an_arm_is_drawn_and_its_joints_are_read_by_the_names_that_it_gives() -> None:
    with gpac.System("cell", clock="virtual") as cell:
        rtp = cell.processor("rtp0")
        fast = rtp.timer("fast", period="1 ms", priority=80)
        slow = rtp.timer("slow", period="20 ms", priority=60)
        arm = gpac.robots.load("ur5e", rtp, on=fast)
        native = cell._native
        shape = drawn(native.call("geometry", json.dumps({"device": "ur5e"})))
        joints = [body["joint"] for body in shape["bodies"] if body["joint"]]
        assert [joint["kind"] for joint in joints] == ["hinge"] * 6
        assert shape["bodies"][0]["parent"] is None
        geoms = [geom for body in shape["bodies"] for geom in body["geoms"]]
        assert geoms and all(geom["mesh"] is None or shape["meshes"][geom["mesh"]]["faces"] for geom in geoms)
        with arm.enabled():
            names = [joint["svv"] for joint in joints]
            before, readings = native.read(names)
            assert len(readings) == 6 and native.now() == before
            running = gpac.robots.move.on({"*": slow}).asynch(arm, goal=[joint.sensed.value + 0.1 for joint in arm])
            cell.advance("40 ms")
            (move,) = [i for i in drawn(native.call("installed"))["instances"] if i["name"] == running.name]
            assert move["state"] == "running" and move["owner"] is None and move["list"] in {one["name"] for one in move["lists"]}
            cells = {one["name"]: one for one in move["cells"]}
            private = next(name for name, one in cells.items() if one["kind"] == "private")
            about = drawn(native.call("svv_about", json.dumps({"name": private})))
            assert private.startswith(f"{running.name}:") and about["kind"] == "private"
            ports = [port for block in move["blocks"] for port in block["ports"]]
            bound = {name for port in ports for name in port.get("cells", [port["cell"]]) if name is not None}
            assert bound and bound <= cells.keys()
            owned = [i for i in drawn(native.call("installed"))["instances"] if i["owner"]]
            assert {i["device"] for i in owned} == {joint.name for joint in arm}
            running.halt()


def test_a_free_body_of_a_plant_is_read_by_the_name_that_it_is_drawn_with(tmp_path: Path) -> None:
    model = tmp_path / "table.xml"
    model.write_text(
        """<mujoco><worldbody><body name="b"><joint name="j" axis="0 0 1"/><geom size="0.1" mass="1"/></body>
        <body name="ball" pos="1 2 3"><freejoint/><geom size="0.05" mass="1"/></body></worldbody>
        <actuator><motor joint="j"/></actuator></mujoco>"""
    )
    with gpac.System("cell", clock="virtual") as cell:
        rtp = cell.processor("rtp0")
        gpac.robots.load(model, rtp, on=rtp.timer("fast", period="1 ms", priority=80))
        shape = drawn(cell._native.call("geometry", json.dumps({"device": "table"})))
        (ball,) = [body["joint"] for body in shape["bodies"] if body["name"] == "ball"]
        assert (ball["kind"], ball["svv"]) == ("free", "table.ball.pose")
        cell.advance("100 ms")
        (reading,) = json.loads(cell._native.call("read", json.dumps({"names": ["table.ball.pose"]})))["values"].values()
        x, y, z, *turn = reading["value"]
        assert (x, y, turn) == (1.0, 2.0, [1.0, 0.0, 0.0, 0.0]) and 2.9 < z < 3.0


CORNERS = [[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]]


def test_a_mesh_is_drawn_by_its_triangles_where_the_model_has_it(tmp_path: Path) -> None:
    model = tmp_path / "wedge.xml"
    model.write_text(
        f"""<mujoco><asset><mesh name="wedge" vertex="{" ".join(str(x) for corner in CORNERS for x in corner)}"/></asset><worldbody>
        <body name="b"><joint name="j" axis="0 0 1"/><geom type="mesh" mesh="wedge" mass="1"/>
        <geom type="mesh" mesh="wedge" mass="0" pos="0 0 3"/></body>
        <body name="c" pos="9 0 0"><joint name="k" axis="0 0 1"/><geom type="sphere" size="0.1" mass="1"/></body></worldbody>
        <actuator><motor joint="j"/><motor joint="k"/></actuator></mujoco>"""
    )
    with gpac.System("cell", clock="virtual") as cell:
        rtp = cell.processor("rtp0")
        gpac.robots.load(model, rtp, on=rtp.timer("fast", period="1 ms", priority=80))
        shape = drawn(cell._native.call("geometry", json.dumps({"device": "wedge"})))
        # A recording contains it too, however short it is.
        cell.record(tmp_path / "run.mcap").stop()
        with open(tmp_path / "run.mcap", "rb") as file:
            (kept,) = [json.loads(message.data) for _, _, message in reader.make_reader(file).iter_messages("/geometry/wedge")]
    assert kept == shape
    first, second, ball = (geom for body in shape["bodies"] for geom in body["geoms"])
    assert [(geom["kind"], geom["mesh"]) for geom in (first, second, ball)] == [("mesh", 0), ("mesh", 0), ("sphere", None)]
    (mesh,) = shape["meshes"]
    vertices, faces = np.reshape(mesh["vertices"], (-1, 3)), np.reshape(mesh["faces"], (-1, 3))
    for geom, lifted in ((first, 0), (second, 3)):
        # If MuJoCo has turned and moved a mesh into its own axes, the mesh's pose on the body undoes that.
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, np.array(geom["quaternion"]))
        corners = vertices @ turn.reshape(3, 3).T + geom["position"] - [0, 0, lifted]
        assert sorted(np.round(corners, 5).tolist()) == sorted(CORNERS)
    # Four faces, each with three different corners, and each edge common to two of them.
    assert len(faces) == 4 and sorted(faces.ravel().tolist()) == sorted([0, 1, 2, 3] * 3)


def test_an_arm_with_a_tool_is_drawn_and_tells_its_contacts(tmp_path: Path) -> None:
    scene = tmp_path / "scene.xml"
    scene.write_text(
        """<mujoco><worldbody><body name="ball" pos="1 1 0.05"><freejoint/>
        <geom size="0.05" mass="2"/></body></worldbody><keyframe><key name="home" qpos="1 1 0.05 1 0 0 0"/></keyframe></mujoco>"""
    )
    with gpac.System("cell", clock="virtual") as cell:
        rtp = cell.processor("rtp0")
        fast = rtp.timer("fast", period="1 ms", priority=80)
        arm = gpac.robots.load("ur5e", rtp, on=fast, tool="two_finger", scene=scene, contacts=2)
        shape = drawn(cell._native.call("geometry", json.dumps({"device": arm.name})))
        assert shape["contacts"] == "ur5e.contacts" and "ball" in {body["name"] for body in shape["bodies"]}
        cell.advance("2 s")
        (reading,) = json.loads(cell._native.call("read", json.dumps({"names": ["ur5e.contacts"]})))["values"].values()
        x, y, z, *force = reading["value"][:6]
        assert np.allclose([x, y, z], [1, 1, 0], atol=1e-3) and np.allclose(force, [0, 0, 2 * 9.81], atol=0.05)
        assert reading["value"][6:] == [0.0] * 6
        with pytest.raises(gpac.CallError, match="contacts= applies to a simulated arm"):
            gpac.robots.load("ur5e", rtp, on=fast, name="other", driver=gpac.drivers.loopback("x"), contacts=2)


def test_the_form_of_a_motion_has_its_units_and_limits() -> None:
    with gpac.System("cell", clock="virtual") as cell:
        cell._enter_verb(motion.move_absolute)
        form = drawn(cell._native.call("verb_form", json.dumps({"name": motion.move_absolute.name})))
        assert form["defined"]["name"] == form["name"] == motion.move_absolute.name
        assert [argument["kind"] for argument in form["arguments"]] and all(one["type_text"] for one in form["inputs"])
        assert {"name", "type_text", "unit", "default", "doc", "minimum", "maximum", "required"} <= form["inputs"][0].keys()
