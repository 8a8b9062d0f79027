# SPDX-License-Identifier: Apache-2.0
"""Code that the package generates from definitions (blocks in Python, symbolic functions, FMUs): compiled once per content, and cached
for later processes of this user."""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from .. import __version__, _native
from ..errors import DefinitionError, refusals, refuse
from ..storage.cache import folder
from .entering import without_system


def block_name(name: str) -> str:
    """Returns `name` if it is a valid block name in C."""
    if not name.isidentifier() or not name.isascii():
        refuse(
            DefinitionError, f"'{name}' is not a valid name for a block", "pass name= with letters, digits and '_', starting with a letter"
        )
    if _native.is_word_of_c(name):
        refuse(
            DefinitionError, f"'{name}' is reserved by C or OpenGPAC and cannot name a block", f"choose another name: name='{name}_block'"
        )
    return name


def kept(kind: str, name: str, key: object, source: Callable[[], str]) -> Path:
    """Returns the shared object of block `name`. If none is cached for `key` (a JSON-compatible value), compiles the C code that
    `source` returns."""
    digest = hashlib.sha256(json.dumps([__version__, key]).encode()).hexdigest()[:24]
    found = folder(kind) / f"{name}-{digest}.so"
    if not found.exists():
        _build(source(), found, name)
    return found


def _build(text: str, kept: Path, name: str) -> None:
    with tempfile.TemporaryDirectory(dir=kept.parent) as temporary:
        source = Path(temporary) / f"{name}.c"
        source.write_text(text)
        with refusals:
            built = _native.build([str(source)], str(source.with_suffix(".so")))
        os.replace(built, kept)


def interface(module: str, file: Path) -> Mapping[str, Any]:
    """Returns the interface of the only block of a compiled file, as read by the real-time system."""
    return without_system().enter_module(module, str(file))[0]
