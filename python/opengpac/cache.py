# SPDX-License-Identifier: Apache-2.0
"""The files that the package keeps for a user, for later processes."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from .errors import ModuleError, refuse


def user_cache() -> Path:
    """The package's part of the user's cache."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache").absolute() / "opengpac"


def put(file: Path, content: bytes) -> None:
    """Writes a file as a whole: others find all of it, or none."""
    with tempfile.NamedTemporaryFile(dir=file.parent, delete=False) as fresh:
        fresh.write(content)
    os.replace(fresh.name, file)


def folder(kind: str) -> Path:
    """Where what is made of a `kind`, "python-blocks" or "models", is kept for this user: in the folder that OPENGPAC_COMPILED names,
    else in that of the user's cache."""
    given = os.environ.get("OPENGPAC_COMPILED")
    made = (Path(given).absolute() if given else user_cache()) / kind
    try:
        made.mkdir(parents=True, exist_ok=True, mode=0o700)
    except OSError as why:
        what = kind.replace("-", " ")
        refuse(ModuleError, f"{what} cannot be kept in '{made}': {why}", "set OPENGPAC_COMPILED to a folder of yours")
    return made
