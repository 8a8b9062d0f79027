# SPDX-License-Identifier: Apache-2.0
"""Workspaces: those shipped by a program, refusals, files, and permissions to replace one."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

EXAMPLE = Path(__file__).parents[2] / "examples" / "operator_panel"


@pytest.fixture(scope="module")
def cell() -> gpac.System:
    """Returns a system with the SVVs `level` (m) and `wave`, the verb `pour`, and its instance `filling`."""
    cell = gpac.System("plant", clock="virtual")
    fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
    cell.svv("level", float, unit="m")
    pour = gpac.Verb(
        "pour",
        blocks={"wave": lib.signal_generator},
        instantiation_parameters={"y": "wave.y"},
        input_parameters={"amplitude": gpac.input("wave.amplitude"), "offset": gpac.input("wave.offset", default=0.0)},
        command_lists={"start": [activate("wave", every="1 ms")]},
    )
    pour.on(fast).named("filling").new_instance(cell.svv("wave", float))
    return cell


def one(panel: str, **of: Any) -> dict[str, Any]:
    """Returns a workspace of one panel."""
    return {"name": "tank", "layout": {"panel": panel, "title": "Tank", **of}}


def test_what_is_shipped_is_there_and_is_replaced(cell: gpac.System) -> None:
    cell.workspaces.ship(one("plot", names=["level", "wave"], seconds=5.0))
    cell.workspaces.ship({**one("alarms"), "operator": True})
    assert list(cell.workspaces) == ["tank"] and "tank" in cell.workspaces and len(cell.workspaces) == 1
    assert cell.workspaces["tank"] == {"name": "tank", "operator": True, "layout": {"panel": "alarms", "title": "Tank"}}
    assert repr(cell.workspaces) == "tank  shipped; for operators"
    cell.workspaces.withdraw("tank")
    assert repr(cell.workspaces) == "no workspaces"
    with pytest.raises(gpac.UnknownName, match="no workspace 'tank'"):
        cell.workspaces.withdraw("tank")


START = {"verb": "pour", "arguments": {"y": {"svv": "wave"}}, "values": {"amplitude": 1.0}}


@pytest.mark.parametrize(
    ("panel", "kind", "message"),
    [
        (one("plot", names=["levl"]), gpac.UnknownName, "panel 'Tank': there is no SVV 'levl'; did you mean 'level'"),
        (one("values", values=[{"name": "filling:x"}]), gpac.UnknownName, "there is no SVV 'filling:x'"),
        (one("scene", device="arm"), gpac.UnknownName, "there is no physical device 'arm'"),
        (one("verb", verb="poor"), gpac.UnknownName, "there is no verb 'poor'; did you mean 'pour'"),
        (one("buttons", buttons=[{"label": "Go", "instance": "fill"}]), gpac.UnknownName, "button 'Go': there is no verb instance 'fill'"),
        (
            one("buttons", buttons=[{"label": "Go", "instance": "filling", "values": {"amplitud": 1.0}}]),
            gpac.InstallationErrors,
            "there is no input parameter of verb 'pour' 'amplitud'; did you mean 'amplitude'",
        ),
        (
            one("buttons", buttons=[{"label": "Go", "instance": "filling"}]),
            gpac.DefinitionError,
            "'amplitude' of verb 'pour' has no value",
        ),
        (one("buttons", buttons=[{"label": "Go", "start": {**START, "verb": "poor"}}]), gpac.UnknownName, "did you mean 'pour'"),
        (one("plot"), gpac.DefinitionError, "panel 'Tank': it cannot have 0 'names'; name the SVVs that it shows"),
        (one("clock"), gpac.CallError, "plot"),
        ({**one("alarms"), "layot": {}}, gpac.CallError, "layot"),
        ({"name": "tank"}, gpac.CallError, "has no 'layout'"),
        ({**one("alarms"), "workspace": 2}, gpac.CallError, "this OpenGPAC reads version 1"),
    ],
)
def test_what_is_wrong_is_refused_with_its_panel_and_remedy(
    cell: gpac.System, panel: dict[str, Any], kind: type[gpac.Error], message: str
) -> None:
    with pytest.raises(kind) as caught:
        cell.workspaces.ship(panel)
    assert message in str(caught.value)
    with pytest.raises(kind):
        cell.workspaces.check(panel)
    assert len(cell.workspaces) == 0


def test_a_button_that_makes_its_instance_is_checked_as_a_start_is(cell: gpac.System) -> None:
    cell.workspaces.check(one("buttons", buttons=[{"label": "Go", "start": START}]))


def test_neither_kind_takes_the_place_of_the_other(cell: gpac.System) -> None:
    cell.workspaces.ship(one("alarms"))
    native = cell._alive()
    with pytest.raises(gpac.InUse, match="was shipped by a program; save this one under another name"), gpac.errors.refusals:
        native.keep_workspace(one("alarms"))
    with pytest.raises(gpac.InUse, match="was shipped by a program"):
        cell.workspaces.forget("tank")
    native.keep_workspace({**one("alarms"), "name": "mine"})
    with pytest.raises(gpac.InUse, match="was saved by a user"):
        cell.workspaces.ship({**one("alarms"), "name": "mine"})
    with pytest.raises(gpac.InUse, match="was saved by a user"):
        cell.workspaces.withdraw("mine")
    cell.workspaces.forget("mine")
    cell.workspaces.withdraw("tank")


def test_a_workspace_goes_through_a_file(cell: gpac.System, tmp_path: Path) -> None:
    cell.workspaces.ship(one("plot", names=["level"]))
    file = tmp_path / "tank.workspace.json"
    cell.workspaces.save("tank", file)
    assert json.loads(file.read_text())["workspace"] == 1
    cell.workspaces.withdraw("tank")
    cell.workspaces.ship(file)
    assert cell.workspaces["tank"] == one("plot", names=["level"])
    cell.workspaces.withdraw("tank")
    file.write_text("{")
    with pytest.raises(gpac.FileFailed, match=r"is not a workspace: .*line 1"):
        cell.workspaces.ship(file)
    with pytest.raises(gpac.FileFailed, match="does not exist"):
        cell.workspaces.ship(tmp_path / "none.json")


def test_the_example_ships_its_panel_and_its_buttons_move_the_joint(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(EXAMPLE))
    monkeypatch.delitem(sys.modules, "program", raising=False)
    import program  # type: ignore[import-not-found]

    with program.make("virtual") as cell:
        assert repr(cell.workspaces) == "joint  shipped; for operators"
        buttons = cell.workspaces["joint"]["layout"]["row"][0]["column"][0]["buttons"]
        out = next(button for button in buttons if button["label"] == "Reach out")
        native = cell._alive()
        number = next(one["id"] for one in native.installed()["instances"] if one["name"] == out["instance"])
        native.start(number, out["values"])
        assert cell.instance(out["instance"]).wait().condition == "arrived"
