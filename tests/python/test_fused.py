# SPDX-License-Identifier: Apache-2.0
"""Fused blocks from a user's point of view: which are fused, which are not and why; nothing else changes."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

import opengpac as gpac
from opengpac import activate, on
from opengpac import library as lib
from rig import Rig

CODE = """
#include <opengpac.h>

FUNCTION_BLOCK(clock, "y = the number of the invocation.", out(double, y, "number"))
{
    self->y = (double)invocation->number;
    return OK;
}

FUNCTION_BLOCK(lag, "y += (u - y) / 8.",
    in(double, u, "value"),
    out(double, y, "smooth value"),
    condition_of_default(double, above, 40, "it is above"))
{
    self->y += 0.125 * (self->u - self->y);
    if (self->y > self->above) report_value(above, self->y);
    return OK;
}

FUNCTION_BLOCK(inverse, "y = 1 / (u - at).", in(double, u, "value"), out(double, y, "inverse"), param(double, at, -1, "pole"))
{
    self->y = 1.0 / (self->u - self->at);
    return OK;
}
"""


@pytest.fixture
def cell() -> Iterator[gpac.System]:
    with gpac.System("fused", clock="virtual") as made:
        yield made


@pytest.fixture
def code(cell: gpac.System, tmp_path: Path) -> gpac.Module:
    """Returns the blocks of a source."""
    return cell.download(source(tmp_path), "code")


def source(folder: Path) -> Path:
    path = folder / "code.c"
    path.write_text(CODE)
    return path


@pytest.fixture
def rig(cell: gpac.System, built: dict[str, str]) -> Rig:
    return Rig(cell, built)


def chain(code: gpac.Module, name: str = "chain", lags: int = 4) -> gpac.Verb[..., object]:
    """Returns a clock, some lags in series and an inverse; the verb ends when the last lag exceeds a value."""
    labels = [f"lag{n}" for n in range(lags)]
    blocks = {"clock": code.clock, **dict.fromkeys(labels, code.lag), "inverse": code.inverse}
    names = list(blocks)
    return gpac.Verb(
        name,
        blocks=blocks,
        cells={f"wire{n}": [f"{one}.y", f"{other}.u"] for n, (one, other) in enumerate(pairwise(names))},
        input_parameters={"limit": gpac.input(f"{labels[-1]}.above", default=40), "pole": "inverse.at"},
        output_values={"last": f"{labels[-1]}.y", "inverse": "inverse.y"},
        command_lists={"start": [activate("clock", every="1 ms"), *map(activate, names[1:])]},
        conditions={"above": on(f"{labels[-1]}.above", returns=["last", "inverse"])},
    )


def ran(rig: Rig, code: gpac.Module, name: str, fuse: bool, **values: float) -> gpac.Report:
    instance = chain(code, name).on(rig.fast).new_instance()
    instance.start(**{"pole": -1.0, **values})
    if fuse:
        rig.cell.fuse()
    return instance.wait()


def test_a_chain_of_c_blocks_is_fused_and_ends_the_same(rig: Rig, code: gpac.Module) -> None:
    single = ran(rig, code, "single", fuse=False)
    fused = ran(rig, code, "fused", fuse=True)
    assert single.condition == fused.condition == "above"
    assert single.outputs == fused.outputs
    assert single.outputs["last"] > 40


def test_it_says_what_is_fused_and_what_is_not_and_why(rig: Rig, code: gpac.Module) -> None:
    assert rig.cell.fused == {"on": False, "waiting": 0, "groups": [], "single": []}
    chain(code).on(rig.fast).asynch(limit=1e9, pole=-1.0)
    beside = gpac.Verb("beside", blocks={"wave": lib.signal_generator}, command_lists={"start": [activate("wave", every="1 ms")]})
    beside.on(rig.fast).asynch()
    told = rig.cell.fuse()
    labels = ["clock", "lag0", "lag1", "lag2", "lag3", "inverse"]
    assert told["groups"] == [{"source": "rtp0.fast", "blocks": [f"chain#1.{label}" for label in labels], "fused": True, "why": None}]
    assert [entry["why"] for entry in told["single"]] == ["it was not built here from a source in C"]
    assert rig.cell.fused == told
    assert all(text in told._repr_html_() for text in ("6 blocks are fused", "chain#1.lag2", "beside#1.wave"))
    # Another instance of the same blocks with the same wiring is fused at its installation, and all of it is undone at once.
    chain(code, "again").on(rig.fast).asynch(limit=1e9, pole=-1.0)
    assert [group["fused"] for group in rig.cell.fused["groups"]] == [True, True]
    told = rig.cell.fuse(on=False)
    assert [group["fused"] for group in told["groups"]] == [False, False]
    assert "blocks are not fused" in told._repr_html_()


def test_a_block_that_could_change_the_floating_point_state_is_not_fused(rig: Rig, tmp_path: Path) -> None:
    path = source(tmp_path)
    text = CODE.replace("self->y += 0.125", "fesetround(FE_TONEAREST); self->y += 0.125")
    path.write_text(f"#include <fenv.h>\n{text}")
    chain(rig.cell.download(path, "code")).on(rig.fast).asynch(limit=1e9, pole=-1.0)
    told = rig.cell.fuse()
    assert told["groups"] == []
    assert told["single"][0] == {"block": "chain#1.clock", "why": "its floating-point state is checked after each invocation"}


def test_a_fault_names_the_block_inside(rig: Rig, code: gpac.Module) -> None:
    for name, fuse in (("single", False), ("fused", True)):
        with pytest.raises(gpac.Terminated, match=rf"'{name}#1' ended with 'fault'.*after 0\.001 s.*output 'y' of block 'inverse'"):
            ran(rig, code, name, fuse, pole=0.0)


def test_taps_and_values_see_inside(rig: Rig, code: gpac.Module, tmp_path: Path) -> None:
    """A recording contains the same values of each private cell, whether or not it is fused, even if it is fused in the middle of the
    recording."""
    kept = []
    for name, when in (("a", None), ("b", 0), ("c", 20)):
        instance = chain(code, name).on(rig.fast).new_instance()
        path = tmp_path / f"{name}.mcap"
        with rig.cell.record(path, cells=True):
            instance.start(limit=1e9, pole=-1.0)
            for firing in range(40):
                if firing == when:
                    rig.cell.fuse()
                rig.cell.advance("1 ms")
            instance.halt()
        rig.cell.fuse(on=False)
        recorded = gpac.open_recording(path)
        kept.append([list(recorded[f"{instance.name}:wire{n}"]["value"]) for n in range(5)])
    assert kept[0] == kept[1] == kept[2]
    assert all(len(values) >= 40 for values in kept[0])


def test_what_a_compiler_refuses_runs_as_before_and_is_tried_again(rig: Rig, code: gpac.Module, monkeypatch: pytest.MonkeyPatch) -> None:
    chain(code).on(rig.fast).asynch(limit=1e9, pole=-1.0)
    monkeypatch.setenv("CC", "false")
    told = rig.cell.fuse()
    assert [group["fused"] for group in told["groups"]] == [False] and "it cannot be compiled" in told["groups"][0]["why"]
    rig.cell.advance("5 ms")
    monkeypatch.delenv("CC")
    assert rig.cell.fuse()["groups"][0]["fused"] is False
    rig.cell.fuse(on=False)
    assert rig.cell.fuse()["groups"][0]["fused"] is True


def test_a_module_that_comes_anew_is_fused_anew(rig: Rig, tmp_path: Path) -> None:
    path = source(tmp_path)
    first = ran(rig, rig.cell.download(path, "code"), "first", fuse=True)
    path.write_text(CODE.replace("0.125", "0.25"))
    second = ran(rig, rig.cell.download(path, "code"), "second", fuse=True)
    assert first.outputs["last"] != second.outputs["last"]
    assert second.outputs == ran(rig, rig.cell.download(path, "code"), "third", fuse=False).outputs
