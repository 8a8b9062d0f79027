# SPDX-License-Identifier: Apache-2.0
"""Errors in a file are reported all at once, each with its line and remedy; nothing in a file is executed."""

from __future__ import annotations

import io
import json
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

import opengpac as gpac
from opengpac import cli

HEAD = 'format = "opengpac-definitions"\nversion = 1\n'

FAULTS = {
    "a word that is not TOML": ("graphs = \n", ["3: DefinitionError: the file is not valid TOML: invalid value; fix this line first"]),
    "an unknown key": (
        '[graphs.g]\nblocks = { a = "library.gain" }\ninput = { u = "a.u" }\n',
        ["5: UnknownName: 'graphs.g' cannot have 'input'; did you mean 'inputs'?"],
    ),
    "an unknown command": (
        '[verbs.v]\nblocks.w = "library.chirp"\ncommand_lists.start = [\n  { actvate = "w", every = "1 ms" },\n]\n',
        [
            "6: UnknownName: 'verbs.v.command_lists.start[0]' must have one of command, install, "
            "execute, activate, deactivate, wait, ready; "
            "did you mean 'activate'?"
        ],
    ),
    "a misspelt word of a command": (
        '[verbs.v]\nblocks.w = "library.chirp"\ncommand_lists.start = [\n  { activate = "w", evry = "1 ms" },\n]\n',
        ["6: UnknownName: 'verbs.v.command_lists.start[0]' cannot have 'evry'; did you mean 'every'?"],
    ),
    "a time without a unit": (
        '[verbs.v]\nblocks.w = "library.chirp"\n[verbs.v.command_lists]\nstart = [\n  { activate = "w", every = "20" },\n]\n',
        ["7: ValueRefused: 'verbs.v.command_lists.start[0].every' '20' has no unit; write, for example, '20 ms', or a number of seconds"],
    ),
    "a number for a time": (
        '[verbs.v]\nblocks.w = "library.chirp"\ncommand_lists.start = [{ activate = "w", every = 20 }]\n',
        ["5: DefinitionError: 'verbs.v.command_lists.start[0].every' must be a string, not 20; write a string"],
    ),
    "an unknown block, port and constant": (
        '[graphs.g.blocks]\na = "library.gian"\nb = { block = "library.gain", constants = { kk = 1 } }\n[graphs.h]\n'
        'blocks = { a = "library.gain", b = "library.gain" }\n[graphs.h.cells]\nc = ["a.y", "b.why"]\n[graphs.h.inputs]\nu = "a.u"\n',
        [
            "4: UnknownName: the library has no block 'library.gian'; did you mean 'library.gain'?",
            "9: UnknownName: 'b' (library.gain) has no 'why'; there are u, y, k",
        ],
    ),
    "a constant of no parameter": (
        '[graphs.g]\ninputs.u = "b.u"\n[graphs.g.blocks.b]\nblock = "library.gain"\n[graphs.g.blocks.b.constants]\nkk = 1\n',
        ["5: UnknownName: 'b' (library.gain) has no parameter 'kk'; did you mean 'k'?"],
    ),
    "types that differ on a wire": (
        '[graphs.g]\nblocks = { a = "library.comparator", b = "library.counter" }\n[graphs.g.inputs]\nu = "a.u"\n'
        '[graphs.g.cells]\nwrong = ["b.value", "a.reference"]\n',
        [],
    ),
    "a graph that is not there": (
        '[graphs.g]\nblocks.a = "smoth"\n[graphs.smooth]\nblocks.f = "library.gain"\ninputs.u = "f.u"\n',
        ["4: UnknownName: this file has no graph 'smoth'; did you mean 'smooth'?"],
    ),
    "graphs in a circle": (
        '[graphs.g]\nblocks.a = "h"\n[graphs.h]\nblocks.a = "g"\n',
        ["3: DefinitionError: definitions form a cycle: g → h → g; remove one of these references"],
    ),
    "an unknown list, condition and transition": (
        '[verbs.v]\nblocks.w = "library.chirp"\ninitial = "start"\ntransitions = [\n'
        '  { from = "start", condition = "end", to = "strat" },\n]\n'
        '[verbs.v.command_lists]\nstart = [\n  { activate = "w", every = "1 ms" },\n  { wait = "w.finish" },\n]\n[verbs.v.conditions]\n'
        'end = { on = "w.finished", returns = "y" }\n',
        [
            "12: UnknownName: 'w' (library.chirp) has no 'finish'; did you mean 'finished'?",
            "15: UnknownName: the condition 'end' returns 'y', which is not an output value",
            "7: UnknownName: the transition ('start', 'end') → 'strat' names the command list 'strat', which does not exist; "
            "did you mean 'start'?",
        ],
    ),
    "an exception class that is not given": (
        '[verbs.v]\nblocks.w = "library.chirp"\ncommand_lists.start = [{ activate = "w", every = "1 ms" }]\n'
        '[verbs.v.conditions]\nhalted = { raises = "os:system" }\n',
        ["7: UnknownName: there is no class 'os:system', which condition 'halted' raises; pass it: gpac.load(…, raises={'os:system': …})"],
    ),
    "a device type that is not there": (
        '[verbs.v]\nblocks.w = "library.chirp"\nobjects.arm = "robot_jiont"\ncommand_lists.start = [{ activate = "w", every = "1 ms" }]\n',
        [
            "5: UnknownName: there is no device type 'robot_jiont'; did you mean 'robot_joint'? or pass it: "
            "gpac.load(…, devices={'robot_jiont': …})"
        ],
    ),
    "a code module that is not loaded": (
        '[modules]\npress = "press.c"\n[graphs.g]\nblocks.a = "press.gauge"\n',
        [
            "6: UnknownName: code module 'press' is not loaded; pass the system to which it is downloaded, gpac.load(…, system=cell), "
            "or pass modules={'press': code}"
        ],
    ),
    "a name for two definitions": (
        '[graphs.g]\nblocks.f = "library.gain"\ninputs.u = "f.u"\n[verbs.g]\nblocks.w = "library.chirp"\n'
        'command_lists.start = [{ activate = "w", every = "1 ms" }]\n',
        ["6: DefinitionError: 'g' is defined twice, in graphs and in verbs; give them different names"],
    ),
}


def said(path: Path) -> list[str]:
    """Returns `LINE: CLASS: MESSAGE; REMEDY` for each error."""
    try:
        gpac.load(path)
    except gpac.Error as error:
        errors = getattr(error, "errors", [error])
        assert all(e.file == str(path) for e in errors)
        return [f"{e.line}: {type(e).__name__}: {e.message}{'; ' + e.remedy if e.remedy else ''}" for e in errors]
    return []


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_named_with_its_line(fault: str, tmp_path: Path) -> None:
    text, expected = FAULTS[fault]
    path = tmp_path / "file.toml"
    path.write_text(HEAD + text)
    found = said(path)
    assert found == expected or (not expected and found)


def test_types_that_differ_are_shown_on_the_wire(tmp_path: Path) -> None:
    path = tmp_path / "wire.toml"
    path.write_text(HEAD + FAULTS["types that differ on a wire"][0])
    assert [error for error in said(path) if error.startswith("8: TypeMismatch: cannot bind output 'b.value'")]


def test_another_format_and_a_newer_version_are_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "file.toml"
    path.write_text("x = 1\n")
    assert said(path) == [
        "1: DefinitionError: the file is not a file of definitions: it has no format; "
        'write at its beginning: format = "opengpac-definitions"'
    ]
    path.write_text('format = "opengpac-definitions"\nversion = 2\nshapes = 1\n')
    assert said(path) == [
        "2: DefinitionError: this OpenGPAC reads version 1 of the format, but the file has version 2; "
        "update OpenGPAC: a newer one wrote the file"
    ]


def test_a_key_twice_in_json_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "file.json"
    path.write_text('{"format": "opengpac-definitions", "format": 1}')
    assert said(path) == ["1: DefinitionError: the file is not valid JSON: 'format' occurs twice in one object; fix this line first"]
    path.write_text('{\n  "format": "opengpac-definitions",\n  "version": 1\n  "graphs": {}\n}')
    assert said(path) == ["4: DefinitionError: the file is not valid JSON: expecting ',' delimiter; fix this line first"]


def test_lines_of_json_are_found(tmp_path: Path) -> None:
    path = tmp_path / "file.json"
    tree = {
        "format": "opengpac-definitions",
        "version": 1,
        "graphs": {"g": {"blocks": {"a": "library.gain"}, "cells": {"c": ["a.y", "a.why"]}}},
    }
    path.write_text(json.dumps(tree, indent=1))
    assert said(path)[0].split(": ", 1)[0] == str(1 + path.read_text()[: path.read_text().index('"c"')].count("\n"))


def test_nothing_of_a_file_is_executed(tmp_path: Path) -> None:
    (tmp_path / "trap.py").write_text("raise SystemExit('executed')\n")
    path = tmp_path / "file.toml"
    for name in ("trap:Thing", "opengpac.cli:main", "opengpac.storage.files:shutil.rmtree", "opengpac:Verb"):
        path.write_text(
            HEAD + '[verbs.v]\nblocks.w = "library.chirp"\ncommand_lists.start = [{ activate = "w", every = "1 ms" }]\n'
            f'[verbs.v.conditions]\nhalted = {{ raises = "{name}" }}\n[verbs.v.input_parameters]\n'
            f'f = {{ targets = "w.amplitude", form = "{name}" }}\n'
        )
        found = said(path)
        assert len(found) == 2 and all("UnknownName: there is no " in line for line in found), name


def checked(path: Path) -> tuple[int, str]:
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = cli.main(["check", str(path)])
    return code, err.getvalue() + out.getvalue()


def test_opengpac_check_shows_the_line_and_the_word(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = Path("file.toml")
    path.write_text(HEAD + '[graphs.g.blocks]\na = "library.gian"\n')
    assert checked(path) == (
        1,
        "file.toml:4:6: UnknownName: the library has no block 'library.gian'\n"
        '     4 | a = "library.gian"\n'
        "       |      ^^^^^^^^^^^^\n"
        "  help: did you mean 'library.gain'?\n"
        "0 definitions checked, 1 error\n",
    )


def test_opengpac_check_builds_the_modules_of_a_file(tmp_path: Path) -> None:
    (tmp_path / "press.c").write_text(
        '#include <opengpac.h>\nFUNCTION_BLOCK(gauge, "Gauge: y = u.", in(double, u, "in"), out(double, y, "out"))\n'
        "{ self->y = self->u; return OK; }\n"
    )
    path = tmp_path / "file.toml"
    path.write_text(
        HEAD
        + '[modules]\npress = "press.c"\n[graphs.g]\nblocks.a = "press.gauge"\ninputs.u = "a.u"\n[verbs.v]\nblocks.w = "library.chirp"\n'
        'command_lists.start = [{ activate = "w", every = "1 ms" }]\nconditions.halted = { raises = "mine:Collision" }\n'
    )
    assert checked(path) == (0, "2 definitions checked, 0 errors\n")
    with gpac.System("pressing", clock="virtual") as cell:
        loaded = gpac.load(path, system=cell, raises={"mine:Collision": gpac.Terminated})
        loaded.g.save(tmp_path / "again.json")
        again = gpac.load(tmp_path / "again.json", system=cell)
        assert again.g.blocks["a"].block is not None and [*again.modules] == ["press"]
