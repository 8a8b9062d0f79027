# SPDX-License-Identifier: Apache-2.0
"""The table of docs/library.md lists the contents of the library, in its words."""

from __future__ import annotations

from library_table import parts, table


def test_the_table_is_that_of_the_library() -> None:
    _, present, _ = parts()
    assert present == table(), "write it anew: .venv/bin/python tests/docs/library_table.py"
