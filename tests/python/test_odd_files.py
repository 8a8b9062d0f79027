# SPDX-License-Identifier: Apache-2.0
"""Damaged and odd files of arms: each loads, or is refused with a sentence that names the file and the place in it.

40 files are tried, or as many as `OPENGPAC_ODD_FILES` says; `OPENGPAC_ODD_SEED` is the first seed.
"""

from __future__ import annotations

import os
import random
import re
import warnings
from collections.abc import Callable
from pathlib import Path

import pytest

import opengpac as gpac
from opengpac.robots.catalogue import ARMS

COUNT = int(os.environ.get("OPENGPAC_ODD_FILES", "40"))
SEED = int(os.environ.get("OPENGPAC_ODD_SEED", "1"))
ORIGINALS = [*(ARMS[name].file() for name in ("ur3e", "iiwa14", "kr16", "puma560", "z1")), Path(gpac.robots.__file__).parent / "ur5e.xml"]
VALUES = ["", "nan", "inf", "1e999", "fast", "-1", "0 0", "1 2 3 4 5 6 7", "ä", "0", "99999999999", "a/b.c"]
PLACE = re.compile(r":\d+:|line \d+|'[^']+'|element|joint")
"""A line, or a name in the file."""


def turned(chance: random.Random, content: bytes) -> bytes:
    """Some bytes are others."""
    changed = bytearray(content)
    for _ in range(chance.randint(1, 5)):
        changed[chance.randrange(len(changed))] = chance.randrange(256)
    return bytes(changed)


def cut(chance: random.Random, content: bytes) -> bytes:
    """The end is missing."""
    return content[: chance.randrange(len(content))]


def twice(chance: random.Random, content: bytes) -> bytes:
    """A line stands there twice."""
    lines = content.splitlines(keepends=True)
    at = chance.randrange(len(lines))
    return b"".join([*lines[:at], lines[at], *lines[at:]])


def without(chance: random.Random, content: bytes) -> bytes:
    """A line is missing."""
    lines = content.splitlines(keepends=True)
    del lines[chance.randrange(len(lines))]
    return b"".join(lines)


def nonsense(chance: random.Random, content: bytes) -> bytes:
    """An attribute has another value."""
    found = chance.choice([*re.finditer(rb'="([^"]*)"', content)])
    return content[: found.start(1)] + chance.choice(VALUES).encode() + content[found.end(1) :]


def nested(chance: random.Random, content: bytes) -> bytes:
    """Elements are nested deep."""
    depth, at = chance.choice([50, 500, 5000]), content.rindex(b"</")
    return content[:at] + b"<link>" * depth + b"</link>" * depth + content[at:]


DAMAGES: list[Callable[[random.Random, bytes], bytes]] = [turned, cut, twice, without, nonsense, nonsense, nested]


@pytest.mark.parametrize("number", range(SEED, SEED + COUNT))
def test_an_odd_file_loads_or_says_what_and_where(number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # where MuJoCo writes its log of warnings
    chance = random.Random(number)
    original, damage = chance.choice(ORIGINALS), chance.choice(DAMAGES)
    file = tmp_path / f"odd{original.suffix}"
    file.write_bytes(damage(chance, original.read_bytes()))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            arm = gpac.robots.load(file, clock="virtual", name="odd")
        except gpac.Error as error:
            said = str(error)
            assert file.name in said, f"{damage.__name__} of {original.name}: {said}"
            assert PLACE.search(said.replace(str(file), "").replace(file.name, "")), said
            return
        with arm.system:
            arm.system.advance("10 ms")
