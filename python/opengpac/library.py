# SPDX-License-Identifier: Apache-2.0
"""The component data base: every block of the standard library is an attribute, `library.pid`.

>>> from opengpac import library as lib
>>> lib.lowpass.name
'library.lowpass'
>>> [block.name for block in lib.search("low-pass")]
['library.lowpass']
"""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping

from . import _native
from .blocks import Block
from .errors import UnknownName, did_you_mean, refuse


@functools.cache
def blocks() -> Mapping[str, Block]:
    """Every block of the library by its short name."""
    return {b["name"].split(".", 1)[1]: Block(b) for b in json.loads(_native.library_json())}


def search(*words: str) -> list[Block]:
    """The blocks whose name, description or items have all these words, whatever their case."""
    wanted = [word.lower() for word in words]
    return [block for block in blocks().values() if all(word in repr(block).lower() for word in wanted)]


def show(name: str) -> str:
    """The manual of one block: its description and every item."""
    return repr(block(name))


def block(name: str) -> Block:
    """The block of that name, `pid` or `library.pid`."""
    short = name.removeprefix("library.")
    if short not in blocks():
        refuse(UnknownName, f"the library has no block '{short}'", did_you_mean(short, blocks()))
    return blocks()[short]


def __getattr__(name: str) -> Block:
    if name.startswith("__"):
        raise AttributeError(name)
    return block(name)


def __dir__() -> list[str]:
    return [*blocks(), "block", "blocks", "search", "show"]
