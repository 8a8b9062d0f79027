# SPDX-License-Identifier: Apache-2.0
"""The files that the package keeps for a user, for later processes."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from ..errors import ModuleError, refuse


def user_cache() -> Path:
    """The package's part of the user's cache."""
    return _of_user("XDG_CACHE_HOME", ".cache")


def user_data() -> Path:
    """The package's part of the user's data."""
    return _of_user("XDG_DATA_HOME", ".local/share")


def _of_user(variable: str, otherwise: str) -> Path:
    return Path(os.environ.get(variable) or Path.home() / otherwise).absolute() / "opengpac"


def put(file: Path, content: bytes) -> None:
    """Writes a file as a whole: others find all of it, or none. Errors: `OSError`, and then nothing is left of it."""
    fresh, name = tempfile.mkstemp(dir=file.parent)
    try:
        with open(fresh, "wb") as opened:
            opened.write(content)
        os.replace(name, file)
    except OSError:
        os.unlink(name)
        raise


def keep(file: Path, content: bytes) -> None:
    """Keeps a file within a `folder`, with the folders that it lies in. Errors: `ModuleError`, where there is no room for it."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        put(file, content)
    except OSError as why:
        refuse(ModuleError, f"'{file.name}' cannot be kept in '{file.parent}': {why.strerror}", "make room there, or set OPENGPAC_COMPILED")


def folder(kind: str) -> Path:
    """Returns the folder where what is made of a `kind`, "python-blocks" or "models", is kept for this user: the one that
    OPENGPAC_COMPILED names, else one in the user's cache."""
    given = os.environ.get("OPENGPAC_COMPILED")
    made = (Path(given).absolute() if given else user_cache()) / kind
    try:
        made.mkdir(parents=True, exist_ok=True, mode=0o700)
    except OSError as why:
        what = kind.replace("-", " ")
        refuse(ModuleError, f"{what} cannot be kept in '{made}': {why}", "set OPENGPAC_COMPILED to a folder of yours")
    return made
