# SPDX-License-Identifier: Apache-2.0
"""Files that the package stores for a user, for use by later processes."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from ..errors import ModuleError, refuse


def user_cache() -> Path:
    """Returns the package's folder in the user's cache directory."""
    return _of_user("XDG_CACHE_HOME", ".cache")


def user_data() -> Path:
    """Returns the package's folder in the user's data directory."""
    return _of_user("XDG_DATA_HOME", ".local/share")


def _of_user(variable: str, otherwise: str) -> Path:
    return Path(os.environ.get(variable) or Path.home() / otherwise).absolute() / "opengpac"


def put(file: Path, content: bytes) -> None:
    """Writes a file atomically. If it raises `OSError`, no partial file is left behind."""
    fresh, name = tempfile.mkstemp(dir=file.parent)
    try:
        with open(fresh, "wb") as opened:
            opened.write(content)
        os.replace(name, file)
    except OSError:
        os.unlink(name)
        raise


def keep(file: Path, content: bytes) -> None:
    """Stores a file in a `folder`, and creates its parent folders. Raises `ModuleError` if the disk is full."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        put(file, content)
    except OSError as why:
        refuse(
            ModuleError,
            f"'{file.name}' cannot be stored in '{file.parent}': {why.strerror}",
            "free up space there, or set OPENGPAC_COMPILED to another folder",
        )


def folder(kind: str) -> Path:
    """Returns the folder in which files of a `kind`, "python-blocks" or "models", are cached for this user: the one specified by
    OPENGPAC_COMPILED, or else one in the user's cache directory."""
    given = os.environ.get("OPENGPAC_COMPILED")
    made = (Path(given).absolute() if given else user_cache()) / kind
    try:
        made.mkdir(parents=True, exist_ok=True, mode=0o700)
    except OSError as why:
        what = kind.replace("-", " ")
        refuse(ModuleError, f"{what} cannot be stored in '{made}': {why}", "set OPENGPAC_COMPILED to a writable folder")
    return made
