# SPDX-License-Identifier: Apache-2.0
"""The site of these pages, built by `make docs`: Sphinx with MyST and Furo. README.md is the front page and the order of all pages."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent

project = "OpenGPAC"
root_doc = "README"
extensions = ["myst_parser"]
exclude_patterns = ["pictures"]
myst_heading_anchors = 4
myst_enable_extensions = ["fieldlist"]
html_theme = "furo"
html_title = "OpenGPAC"
html_copy_source = False
html_show_sphinx = False
html_last_updated_fmt = None
pygments_style = "friendly"
pygments_dark_style = "native"
# A fence without a language is plain text.
highlight_language = "none"
nitpicky = True

_KIND = re.compile(r"^## (.+)$", re.MULTILINE)
_PAGE = re.compile(r"^ *- \[([^\]]+)\]\(([\w./-]+)\.md\)", re.MULTILINE)
_OUTSIDE = re.compile(r"(?<!!)\[([^\]]+)\]\(((?:\.\./)+[^)\s]+|[^)\s:]+/|[\w./-]+\.(?!md\b)\w+)\)")


def tables_of_contents(front: str) -> str:
    """Returns one hidden table of contents for each kind of page, from the lists of the front page."""
    made = []
    parts = _KIND.split(front)
    for title, body in zip(parts[1::2], parts[2::2], strict=True):
        if pages := [f"{name} <{page}>" for name, page in _PAGE.findall(body)]:
            made.append("\n".join(["```{toctree}", ":hidden:", f":caption: {title}", "", *pages, "```"]))
    return "\n\n".join(made)


def _read(app: Any, page: str, source: list[str]) -> None:
    if page == root_doc:
        source[0] += "\n" + tables_of_contents(source[0])
    elif page == "reference":
        names = dict.fromkeys(re.findall(r"\]\((reference/[\w-]+)\.md\)", source[0]))
        source[0] += "\n" + "\n".join(["```{toctree}", ":hidden:", "", *names, "```"])
    elif page.startswith("decisions/") and page != "decisions/README":
        # Their index has them; in the navigation of each page, 250 titles would be most of the site.
        source[0] = "---\norphan: true\n---\n" + source[0]
    folder = (HERE / page).parent

    def shown(found: re.Match[str]) -> str:
        # A file of the repository that is no page of the site is named, not linked.
        target = (folder / found[2].split("#")[0]).resolve()
        inside = target.is_relative_to(HERE) and (target.suffix == ".md" or target.is_file())
        return found[0] if inside else found[1] if found[1].startswith("`") else f"{found[1]} (`{found[2].lstrip('./')}`)"

    source[0] = _OUTSIDE.sub(shown, source[0])


def _finish(app: Any, failed: Exception | None) -> None:
    if failed is None and app.builder.name == "html":
        shutil.copy(Path(app.outdir) / "README.html", Path(app.outdir) / "index.html")


def setup(app: Any) -> None:
    app.connect("source-read", _read)
    app.connect("build-finished", _finish)
