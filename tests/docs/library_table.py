# SPDX-License-Identifier: Apache-2.0
"""The table of docs/library.md, generated from the library itself. Run as a program it writes the table into the page."""

from __future__ import annotations

from pathlib import Path

from opengpac.library.components import Component
from opengpac.library.origins import standard

PAGE = Path(__file__).parent.parent.parent / "docs" / "library.md"
BEGIN, END = "<!-- table -->\n", "<!-- end of table -->\n"


def table() -> str:
    """Returns every component of the standard library, by category."""
    found = sorted((c for c in standard() if isinstance(c, Component)), key=lambda c: (c.category, c.name))
    lines = ["| category | name | description |", "|---|---|---|"]
    for component in found:
        kind = "" if component.kind == "block" else f"*{component.kind}*: "
        lines.append(f"| {component.category} | `{component.name}` | {kind}{component.title.replace('|', chr(92) + '|')} |")
    return "\n".join(lines) + "\n"


def parts() -> tuple[str, str, str]:
    """Returns the text of the page before its table, the table, and the text after it."""
    before, _, rest = PAGE.read_text().partition(BEGIN)
    present, _, after = rest.partition(END)
    return before, present, after


if __name__ == "__main__":
    before, _, after = parts()
    PAGE.write_text(f"{before}{BEGIN}{table()}{END}{after}")
