# SPDX-License-Identifier: Apache-2.0
"""Encodings of XML files. Expat reads UTF-8, UTF-16 and single-byte encodings; Python decodes all others that a file declares."""

from __future__ import annotations

import codecs
import re
from pathlib import Path
from xml.parsers import expat

from ...errors import DeviceFailed, refuse

_NAMED = re.compile(rb"""\s*<\?xml[^>]*\bencoding\s*=\s*["']([\w.:-]+)["']""")
_BEGINS = [
    (codecs.BOM_UTF8, "utf-8-sig"),
    *((mark, "utf-32") for mark in (codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE)),
    *((mark, "utf-16") for mark in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)),
    (b"<\0", "utf-16-le"),
    (b"\0<", "utf-16-be"),
]
"""Byte order marks and other leading bytes that identify a file's encoding; they take precedence over a declaration."""
_READ_BY_EXPAT = ("utf-8", "utf8", "utf-16", "us-ascii", "iso-8859-1")


def decoded(file: Path, content: bytes) -> tuple[bytes, str | None]:
    """Returns the content of a file and the encoding to pass to expat: UTF-8, or None if expat detects it itself.

    Trailing zero bytes are removed. Raises `DeviceFailed` for an encoding that Python does not support, or that does not match the
    content.
    """
    wide = next((encoding for begin, encoding in _BEGINS if content.startswith(begin)), None)
    if wide is None:
        content = _without_late_declaration(content.rstrip(b"\0"))
        named = _NAMED.match(content)
        wide = named[1].decode().lower() if named else "utf-8"
        if wide in _READ_BY_EXPAT:
            return content, None
    try:
        return content.decode(wide).rstrip("\0").encode(), "utf-8"
    except (LookupError, ValueError) as error:
        refuse(DeviceFailed, f"{file}:1: the file does not have the encoding '{wide}' that it declares: {error}", "save it as UTF-8")


def _without_late_declaration(content: bytes) -> bytes:
    """Blanks out an XML declaration that is not at the beginning of the file, a common defect; line numbers are preserved."""
    start = content.find(b"<?xml")
    end = content.find(b"?>", start) + 2
    if start <= 0 or end < 2:
        return content
    return content[:start] + b"\n" * content.count(b"\n", start, end) + content[end:]


def save_remedy(content: bytes, line: int) -> str:
    """Returns the remedy for a line that is not valid UTF-8; empty if the encoding is not the problem."""
    try:
        content.decode()
    except UnicodeDecodeError as error:
        if line == content.count(b"\n", 0, error.start) + 1:
            return "save it as UTF-8, or declare its encoding in the first line"
    return ""


class _Root(Exception):
    """Raised when the root element has been read, to stop the parser."""

    def __init__(self, tag: str) -> None:
        super().__init__(tag)
        self.tag = tag


def root_tag(file: Path) -> str:
    """Returns the tag of a file's root element; empty if the file cannot be read or does not begin as XML."""

    def found(tag: str, _attributes: dict[str, str]) -> None:
        raise _Root(tag)

    try:
        content, encoding = decoded(file, file.read_bytes())
        parser = expat.ParserCreate(encoding)
        parser.StartElementHandler = found
        parser.Parse(content, True)
    except _Root as root:
        return root.tag
    except (OSError, DeviceFailed, expat.ExpatError):
        pass
    return ""
