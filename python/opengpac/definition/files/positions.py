# SPDX-License-Identifier: Apache-2.0
"""Locates each part of a TOML or JSON text by line. The text is well formed, because it has been parsed before."""

from __future__ import annotations

import re
from collections.abc import Iterator

Path = tuple[str | int, ...]
"""Location in a tree: keys and indices from the root."""

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_SCALAR = re.compile(r"[^\s,\]}#]+(?: [^\s,\]}#=]+)?")
_ESCAPED = {'"""': re.compile(r'"""(?:[^\\]|\\.)*?"{3,5}', re.S), '"': re.compile(r'"(?:[^"\\]|\\.)*"', re.S)}
_LITERAL = {"'''": re.compile(r"'''.*?'{3,5}", re.S), "'": re.compile(r"'[^']*'")}
_ESCAPE = re.compile(r"\\(?:u([0-9a-fA-F]{4})|U([0-9a-fA-F]{8})|(.))")
_SHORT = {"n": "\n", "t": "\t", "r": "\r", "b": "\b", "f": "\f"}


def lines_of(text: str, toml: bool) -> dict[Path, int]:
    """Returns the line, from 1, of each key, table and element by its path."""
    scanner = _Scanner(text, toml)
    scanner.document() if toml else scanner.value(())
    return scanner.lines


def line_at(lines: dict[Path, int], path: Path) -> int:
    """Returns the line of the part at that path, or of the nearest enclosing part."""
    while path and path not in lines:
        path = path[:-1]
    return lines.get(path, 1)


class _Scanner:
    def __init__(self, text: str, toml: bool) -> None:
        self.text, self.toml, self.at = text, toml, 0
        self.lines: dict[Path, int] = {(): 1}
        self._line, self._counted = 1, 0
        self._elements: dict[Path, int] = {}

    def line(self) -> int:
        self._line += self.text.count("\n", self._counted, self.at)
        self._counted = self.at
        return self._line

    def mark(self, path: Path) -> None:
        self.lines.setdefault(path, self.line())

    def skip(self) -> None:
        """Skips whitespace, line ends and comments."""
        while self.at < len(self.text):
            if self.text[self.at] in " \t\r\n\ufeff":
                self.at += 1
            elif self.toml and self.text[self.at] == "#":
                end = self.text.find("\n", self.at)
                self.at = end if end >= 0 else len(self.text)
            else:
                return

    def taken(self, mark: str) -> bool:
        self.skip()
        found = self.text.startswith(mark, self.at)
        self.at += len(mark) if found else 0
        return found

    def document(self) -> None:
        table: Path = ()
        while True:
            self.skip()
            if self.at >= len(self.text):
                return
            if self.taken("[["):
                table = self.header()
                number = self._elements[table] = self._elements.get(table, -1) + 1
                table = (*table, number)
                self.mark(table)
                self.at += 2
            elif self.taken("["):
                table = self.header()
                self.mark(table)
                self.at += 1
            else:
                self.pair(table)

    def header(self) -> Path:
        """Returns the path of a header; for an array of tables, the path of its last element."""
        path: Path = ()
        self.skip()
        for key in self.key():
            path = (*path, self._elements[path]) if path in self._elements else path
            path = (*path, key)
            self.mark(path)
        self.skip()
        return path

    def pair(self, table: Path) -> None:
        path = table
        self.skip()
        for key in self.key():
            path = (*path, key)
            self.mark(path)
        self.skip()
        self.at += 1
        self.value(path)

    def key(self) -> Iterator[str]:
        while True:
            self.skip()
            bare = _BARE.match(self.text, self.at)
            if bare and self.toml:
                self.at = bare.end()
                yield bare[0]
            else:
                yield self.string()
            if not (self.toml and self.taken(".")):
                return

    def value(self, path: Path) -> None:
        self.skip()
        self.mark(path)
        if self.taken("["):
            for index in range(len(self.text)):
                if self.taken("]"):
                    return
                self.value((*path, index))
                self.taken(",")
        elif self.taken("{"):
            while not self.taken("}"):
                self.pair(path)
                self.taken(",")
        elif self.text[self.at] in "\"'":
            self.string()
        else:
            scalar = _SCALAR.match(self.text, self.at)
            self.at = scalar.end() if scalar else self.at + 1

    def string(self) -> str:
        for opening, pattern in (*_ESCAPED.items(), *_LITERAL.items()):
            if (self.toml or opening == '"') and self.text.startswith(opening, self.at):
                found = pattern.match(self.text, self.at)
                if found:
                    self.at = found.end()
                    inner = found[0][len(opening) : -len(opening)]
                    return _ESCAPE.sub(_unescaped, inner) if opening[0] == '"' else inner
        self.at += 1
        return ""


def _unescaped(escape: re.Match[str]) -> str:
    code = escape[1] or escape[2]
    return chr(int(code, 16)) if code else _SHORT.get(escape[3], escape[3])
