# SPDX-License-Identifier: Apache-2.0
"""Paths that are given, and text files that are written whole or not at all."""

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
    """The path that an argument `what` is given, absolute. Raises CallError where it is none."""
    if not isinstance(given, str | os.PathLike) or not str(given).strip() or not str(given).isprintable():
        refuse(CallError, f"{what} is given {str(given)[:80]!r}", "give the path of a file")
    try:
        return Path(given).expanduser().absolute()
    except RuntimeError as error:
        refuse(CallError, f"{what} is given {str(given)[:80]!r}: {error}", "give the path of a file")


def is_source(path: Path) -> bool:
    """Returns whether its ending says that it is built where it is loaded: C or C++. The core knows which endings do."""
    return path.suffix.removeprefix(".") in _native.source_endings()


def there(path: Path) -> bool:
    """Returns whether there is such a file; of a path that no file could have there is none."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def read(path: Path, what: str) -> str | None:
    """The text of a file; None where there is none."""
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError) as error:
        refuse(FileFailed, f"cannot read {what} '{path}': {_why(error)}", "is it a text file that you may read?")


def write(path: Path, text: str, what: str, *, previous: Path | None = None) -> None:
    """Puts `text` in the place of the file in one step; where that fails the file is as it was. `previous`: keeps the old file there.

    `opengpac check` writes nothing.
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
        refuse(FileFailed, f"cannot write {what} '{path}': {_why(error)}", "the file is as it was; is there room, and may you write there?")


LOCK_WAIT_S = 10.0
"""How long a change of a file waits for another program's."""

_LOCK_LOOK_S = 0.005


@contextlib.contextmanager
def locked(path: Path, what: str) -> Iterator[None]:
    """Keeps other programs that do so from changing the file meanwhile, by a lock on its folder, which leaves nothing behind.

    Raises `FileFailed` where another one holds it for longer than `LOCK_WAIT_S`. A folder that is not there or knows no locks is not
    locked: the write says what is wrong with it.
    """
    with contextlib.ExitStack() as held:
        with contextlib.suppress(OSError, RuntimeError):
            descriptor = os.open(path.resolve().parent, os.O_RDONLY | os.O_CLOEXEC)
            held.callback(os.close, descriptor)
            if not _take(descriptor):
                refuse(FileFailed, f"cannot change {what} '{path}': another program is changing files in that folder", "try again")
        yield


def _take(descriptor: int) -> bool:
    """Takes the lock of a folder; False where another one held it for too long."""
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
    """Writes the new name to the disk too, not only the contents."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _why(error: OSError | UnicodeDecodeError) -> str:
    return (error.strerror or str(error)).lower() if isinstance(error, OSError) else f"byte {error.start} is no text"


XML_ERRORS = (ElementTree.ParseError, LookupError, ValueError)
"""Errors of ElementTree for a file that is no XML; one in an encoding that expat leaves to Python is one of the last two."""

XML_DEPTH_MAX = 200
"""How deep the elements of a model may be nested."""


def is_too_deep(root: ElementTree.Element) -> bool:
    """Returns whether the elements of a file are nested deeper than any model's: as many nested calls would write them."""
    left = [(root, 1)]
    while left:
        element, depth = left.pop()
        if depth > XML_DEPTH_MAX:
            return True
        left.extend((inner, depth + 1) for inner in element)
    return False
