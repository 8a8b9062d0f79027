# SPDX-License-Identifier: Apache-2.0
"""Deeply nested or very large files are refused quickly, with a sentence."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import opengpac as gpac

_TOML = 'format = "opengpac-definitions"\nversion = 1\n'
_JSON = '{"format": "opengpac-definitions", "version": 1, '


def _nested(opening: str, closing: str, depth: int) -> str:
    return opening * depth + closing * depth


@pytest.mark.parametrize("depth", [101, 300, 20_000])
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.toml", lambda depth: f"{_TOML}x = {_nested('[', ']', depth)}"),
        ("b.toml", lambda depth: _TOML + "[" + ".".join(["a"] * depth) + "]\nb = 1"),
        ("a.json", lambda depth: _JSON + '"x": ' + _nested("[", "]", depth) + "}"),
        ("b.json", lambda depth: _JSON + '"graphs": ' + '{"g": ' * depth + "1" + "}" * depth + "}"),
    ],
)
def test_a_file_that_is_nested_without_end_is_refused_in_a_sentence(
    tmp_path: Path, name: str, text: Callable[[int], str], depth: int
) -> None:
    file = tmp_path / name
    file.write_text(text(depth))
    with pytest.raises(gpac.DefinitionError, match="the tables and lists of the file are nested more than 100 levels deep"):
        gpac.load(file)


def test_a_file_with_many_thousand_blocks_is_refused_before_they_are_checked(tmp_path: Path) -> None:
    file = tmp_path / "many.toml"
    file.write_text(_TOML + "[graphs.g.blocks]\n" + "".join(f'b{n} = "library.gain"\n' for n in range(50_000)))
    with pytest.raises(gpac.DefinitionError, match="the definitions of the file have 50000 blocks in total, more than 4000"):
        gpac.load(file)


def test_graphs_that_multiply_by_names_are_refused_before_they_are_made(tmp_path: Path) -> None:
    file = tmp_path / "doubling.toml"
    text = _TOML + '[graphs.g0]\nblocks = { a = "library.gain" }\ninputs = { u = "a.u" }\noutputs = { y = "a.y" }\n'
    for level in range(1, 40):
        text += f'[graphs.g{level}]\nblocks = {{ a = "g{level - 1}", b = "g{level - 1}" }}\n'
        text += 'inputs = { u = "a.u" }\noutputs = { y = "b.y" }\ncells = { c = ["a.y", "b.u"] }\n'
    file.write_text(text)
    with pytest.raises(gpac.DefinitionError, match="blocks, including those of its graphs"):
        gpac.load(file)


@pytest.mark.parametrize("ending", ["xml", "urdf"])
def test_a_model_that_is_nested_without_end_is_refused_in_a_sentence(tmp_path: Path, ending: str) -> None:
    file = tmp_path / f"deep.{ending}"
    root = "mujoco" if ending == "xml" else "robot"
    file.write_text(f"<{root}>{_nested('<a>', '</a>', 60_000)}</{root}>")
    with pytest.raises(gpac.DeviceFailed):
        gpac.robots.load(file)


def test_a_workspace_that_is_nested_without_end_is_refused_in_a_sentence(tmp_path: Path) -> None:
    file = tmp_path / "deep.json"
    file.write_text(_nested("[", "]", 50_000))
    with gpac.System("cell", clock="virtual") as cell, pytest.raises(gpac.FileFailed, match="nested too deeply"):
        cell.workspaces.ship(str(file))
