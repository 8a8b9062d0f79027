# SPDX-License-Identifier: Apache-2.0
"""Elements of pictures: texts of known width, boxes, and a sheet with a light and a dark theme."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from html import escape

LINE = 16.0
"""Line spacing of text, px."""
MARGIN = 14.0
_TIP = "opengpac-tip"

_LIGHT = {
    ".sheet": "fill:#fff;stroke:#d8dee6", ".box": "fill:#f6f8fa;stroke:#8291a5", ".graph": "fill:#eef3fb;stroke:#4a74b8",
    ".pin": "fill:#e7f2ec;stroke:#4d8a68", ".end": "fill:#e7f2ec;stroke:#4d8a68", ".fail": "fill:#fbecec;stroke:#b85450",
    ".head": "fill:#e3e9f0", ".graph-head": "fill:#d5e2f5", ".wire": "stroke:#3f5873", ".dot": "fill:#3f5873", "text": "fill:#1c2733",
    ".soft": "fill:#5b6b7d",
}  # fmt: skip
_DARK = {
    ".sheet": "fill:#14191f;stroke:#2e3946", ".box": "fill:#1d252e;stroke:#6d7f94", ".graph": "fill:#1a2536;stroke:#6f97d6",
    ".pin": "fill:#18291f;stroke:#6fae8b", ".end": "fill:#18291f;stroke:#6fae8b", ".fail": "fill:#301d1d;stroke:#d67f7b",
    ".head": "fill:#28323e", ".graph-head": "fill:#24354f", ".wire": "stroke:#93abc6", ".dot": "fill:#93abc6", "text": "fill:#e4eaf1",
    ".soft": "fill:#9fb0c3",
}  # fmt: skip
_SHAPES = {
    "text": 'font:12px ui-monospace,Menlo,Consolas,"DejaVu Sans Mono",monospace', ".name": "font-weight:600", ".soft": "font-size:11px",
    ".wire": "fill:none;stroke-width:1.4", ".asynchronous": "stroke-dasharray:5 4",
    ".ratio": "stroke-dasharray:1.5 3.5;stroke-linecap:round",
}  # fmt: skip


def _rules(rules: Mapping[str, str]) -> str:
    """Returns the rules as CSS that applies only to these pictures, because a page may contain other elements of the same classes."""
    return "".join(f".opengpac-picture {what}{{{look}}}" for what, look in rules.items())


def wide(text: str, soft: bool = False) -> float:
    """Returns the width of a text, px. The font is monospaced; East Asian characters are twice as wide."""
    letters = sum(2 if ord(letter) > 0x2E7F else 1 for letter in text)
    return letters * (6.65 if soft else 7.25)


def clip(text: str, most: int) -> str:
    """Returns the text, truncated to at most `most` characters."""
    return text if len(text) <= most else text[: most - 1] + "…"


def text(x: float, y: float, words: str, look: str = "", anchor: str = "start") -> str:
    """Returns a line of text; `y` is the vertical centre."""
    look = f' class="{look}"' if look else ""
    anchor = f' text-anchor="{anchor}"' if anchor != "start" else ""
    return f'<text x="{x:.1f}" y="{y + 4:.1f}"{look}{anchor}>{escape(words)}</text>'


def rect(x: float, y: float, width: float, height: float, look: str, radius: float = 5) -> str:
    """Returns a box."""
    return f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" rx="{radius:g}" class="{look}"/>'


def tooltip(words: str) -> str:
    """Returns the tooltip of the enclosing element."""
    return f"<title>{escape(words)}</title>" if words else ""


def wire(path: str, look: str, words: str, attributes: str = "") -> str:
    """Returns an edge with an arrowhead at its end."""
    return f'<g{attributes}>{tooltip(words)}<path d="{path}" class="wire {look}" marker-end="url(#{_TIP})"/></g>'


def attribute(name: str, value: str) -> str:
    """Returns an escaped attribute of an element."""
    return f' data-{name}="{escape(value, quote=True)}"'


def sheet(width: float, height: float, body: list[str], title: str) -> str:
    """Returns the whole picture."""
    width, height = width + 2 * MARGIN, height + 2 * MARGIN
    drawn = "\n".join(body)
    # A page may contain several pictures: each has its own marker for the ends of its wires.
    mark = f"opengpac-tip-{zlib.crc32(drawn.encode()):08x}"
    tip = f'<marker id="{mark}" viewBox="0 0 8 8" refX="7.5" refY="4" markerWidth="7" markerHeight="7" orient="auto-start-reverse">'
    tip += '<path d="M0 0.5L8 4L0 7.5z" class="dot"/></marker>'
    rules = f"{_rules(_SHAPES)}{_rules(_LIGHT)}@media (prefers-color-scheme:dark){{{_rules(_DARK)}}}"
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" class="opengpac-picture" width="{width:.0f}" height="{height:.0f}" '
            f'viewBox="0 0 {width:.0f} {height:.0f}" role="img" aria-label="{escape(title, quote=True)}">',
            f"<style>{rules}</style><defs>{tip}</defs>",
            rect(0.5, 0.5, width - 1, height - 1, "sheet", 8),
            f'<g transform="translate({MARGIN:g} {MARGIN:g})">',
            drawn.replace(_TIP, mark),
            "</g></svg>",
        ]
    )
