# SPDX-License-Identifier: Apache-2.0
"""Paths from arguments, and text files that are written atomically."""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from .. import _native, checking
from ..errors import CallError, FileFailed, refuse


def path_of(given: Any, what: str) -> Path:
    """Converts the argument `what` to an absolute path. Raises `CallError` if it is not a path."""
    if not isinstance(given, str | os.PathLike) or not str(given).strip() or not str(given).isprintable():
        refuse(CallError, f"{what} must be a path, not {str(given)[:80]!r}", "pass the path of a file")
    try:
        return Path(given).expanduser().absolute()
    except RuntimeError as error:
        refuse(CallError, f"{what} cannot have the path {str(given)[:80]!r}: {error}", "pass the path of a file")


def is_source(path: Path) -> bool:
    """Returns whether the extension is that of C or C++ source code, which is built on loading. The core defines the extensions."""
    return path.suffix.removeprefix(".") in _native.source_endings()


def there(path: Path) -> bool:
    """Returns whether the file exists. An invalid path does not exist."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def read(path: Path, what: str) -> str | None:
    """Returns the text of a file, or None if it does not exist."""
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError) as error:
        refuse(FileFailed, f"cannot read {what} '{path}': {_why(error)}", "check that it is a text file and that you may read it")


def write(path: Path, text: str, what: str, *, previous: Path | None = None) -> None:
    """Replaces the contents of the file with `text` atomically; on failure the file is unchanged. The old file is kept at `previous`, if
    set.

    Under `opengpac check`, nothing is written.
    """
    if checking.active():
        return
    with contextlib.suppress(OSError):
        path = path.resolve()  # a link stays a link
    temporary = path.with_name(f".{path.name}.{os.getpid()}.{threading.get_ident()}.new")
    try:
        with temporary.open("w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        if path.exists():
            shutil.copymode(path, temporary)
            if previous is not None:
                os.replace(path, previous)
        os.replace(temporary, path)
        _settle(path.parent)
    except OSError as error:
        with contextlib.suppress(OSError):
            temporary.unlink()
        with contextlib.suppress(OSError):
            if previous is not None and previous.exists() and not path.exists():
                os.replace(previous, path)
        refuse(
            FileFailed,
            f"cannot write {what} '{path}': {_why(error)}",
            "check that there is space and that you may write there; the file is unchanged",
        )


LOCK_WAIT_S = 10.0
"""Maximum time to wait for another program's change to a file before changing it, s."""

_LOCK_LOOK_S = 0.005


@contextlib.contextmanager
def locked(path: Path, what: str) -> Iterator[None]:
    """Locks the file's folder, so that other programs that call this function cannot change the file in the meantime. The lock leaves no
    files behind.

    Raises `FileFailed` if another program holds the lock for longer than `LOCK_WAIT_S`. A folder that does not exist or does not
    support locks is not locked; the write then reports its error.
    """
    with contextlib.ExitStack() as held:
        with contextlib.suppress(OSError, RuntimeError):
            descriptor = os.open(path.resolve().parent, os.O_RDONLY | os.O_CLOEXEC)
            held.callback(os.close, descriptor)
            if not _take(descriptor):
                refuse(FileFailed, f"cannot change {what} '{path}': another program is changing files in that folder", "try again")
        yield


def _take(descriptor: int) -> bool:
    """Locks a folder; returns False if another program held it for too long."""
    until = time.monotonic() + LOCK_WAIT_S
    while True:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        except BlockingIOError:
            if time.monotonic() > until:
                return False
            time.sleep(_LOCK_LOOK_S)


def _settle(folder: Path) -> None:
    """Syncs the folder, so that the new name is on disk in addition to the contents."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _why(error: OSError | UnicodeDecodeError) -> str:
    return (error.strerror or str(error)).lower() if isinstance(error, OSError) else f"byte {error.start} is not valid UTF-8"


XML_ERRORS = (ElementTree.ParseError, LookupError, ValueError)
"""Errors that ElementTree raises for a file that is not XML; an encoding that expat leaves to Python causes one of the last two."""

XML_DEPTH_MAX = 200
"""Maximum nesting depth of the elements of a model."""


def is_too_deep(root: ElementTree.Element) -> bool:
    """Returns whether the elements of a file are nested deeper than in any model; writing them would recurse as deeply."""
    left = [(root, 1)]
    while left:
        element, depth = left.pop()
        if depth > XML_DEPTH_MAX:
            return True
        left.extend((inner, depth + 1) for inner in element)
    return False
