# SPDX-License-Identifier: Apache-2.0
"""docs/evidence.md states which tests run on which mappings, and lists every graph."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from mappings.graphs import GRAPHS
from mappings.mapping import MAPPINGS
from mappings.oracles import ORACLES
from mappings.suite import in_real_time, table

PAGE = Path(__file__).parent.parent.parent.parent / "docs" / "evidence.md"


def computed(name: str) -> str:
    """Returns how closely a graph agrees with its independent computation."""
    return "to the bit" if GRAPHS[name].model or ORACLES[name].is_exact else "within 1e-9"


def made() -> dict[str, str]:
    """Returns the generated parts of the page, by the word in their marks."""
    rows = [f"| `{name}` | {(entry.make.__doc__ or '').strip()} | {computed(name)} |" for name, entry in GRAPHS.items()]
    return {
        "suite": f"{table()}\n\nThe following tests run in real time: {', '.join(f'`{name}`' for name in in_real_time())}.",
        "graphs": "\n".join(["| graph | content | agreement with an independent computation |", "|---|---|---|", *rows]),
    }


@pytest.mark.parametrize("word", ["suite", "graphs"])
def test_the_page_says_what_there_is(word: str, request: pytest.FixtureRequest) -> None:
    pattern = re.compile(rf"(?<=<!-- made: {word} -->\n).*?(?=\n<!-- end: {word} -->)", re.DOTALL)
    if request.config.getoption("--renew"):
        PAGE.write_text(pattern.sub(lambda _: made()[word], PAGE.read_text()))
    found = pattern.search(PAGE.read_text())
    assert found and found[0] == made()[word], "renew it: pytest --renew tests/python/mappings/test_page.py"


def test_the_page_names_every_mapping() -> None:
    page = PAGE.read_text()
    assert all(f"| `{name}` |" in page for name in MAPPINGS)
    assert f"{len(GRAPHS)} graphs" in page and f"{sum(entry.model is not None for entry in GRAPHS.values())} of them" in page
