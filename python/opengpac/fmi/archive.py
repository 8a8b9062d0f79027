# SPDX-License-Identifier: Apache-2.0
"""Reads entries of an FMU's zip archive with size limits. Any defect of the archive raises a `ModuleError` that names the file."""

from __future__ import annotations

import contextlib
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path

from ..errors import ModuleError, refuse

DESCRIPTION_BYTES_MAX = 64 << 20
UNPACKED_BYTES_MAX = 512 << 20
"""Maximum unpacked size of the binary and the resources of an FMU."""


class Archive:
    """An open FMU: the `names` of its entries, and their contents."""

    def __init__(self, path: Path, archive: zipfile.ZipFile) -> None:
        self._path = path
        self._archive = archive
        self.names = archive.namelist()

    def read(self, entry: str, most: int = UNPACKED_BYTES_MAX) -> bytes:
        """Returns the contents of an entry of at most `most` bytes."""
        self.check_size([entry], most)
        return self._archive.read(entry)

    def check_size(self, entries: list[str], most: int = UNPACKED_BYTES_MAX) -> None:
        """Refuses entries whose total size exceeds `most` bytes, before unpacking any of them."""
        size = sum(self._archive.getinfo(entry).file_size for entry in entries)
        if size > most:
            what = f"'{entries[0]}'" if len(entries) == 1 else f"{len(entries)} entries"
            text = f"{what} of '{self._path.name}' would be {size / 1e6:.0f} MB unpacked, more than {most / 1e6:.0f} MB"
            refuse(ModuleError, text, "remove files that the model does not read at run time")


@contextlib.contextmanager
def opened(path: Path) -> Iterator[Archive]:
    """Opens the archive at `path`, for use in a `with` statement."""
    try:
        with zipfile.ZipFile(path) as archive:
            yield Archive(path, archive)
    except OSError as why:
        refuse(ModuleError, f"cannot read '{path}': {(why.strerror or str(why)).lower()}")
    except NotImplementedError as why:
        refuse(ModuleError, f"'{path.name}' uses an unsupported compression method: {why}", "compress it with deflate")
    except RuntimeError:
        # The only other exception that `zipfile` raises when reading.
        refuse(ModuleError, f"'{path.name}' is encrypted", "export it without a password")
    except (zipfile.BadZipFile, zlib.error, EOFError, UnicodeDecodeError, ValueError) as why:
        text = "it is not a zip archive" if "not a zip file" in str(why) else f"its archive is damaged ({why})"
        refuse(ModuleError, f"'{path.name}' is not an FMU: {text}")
