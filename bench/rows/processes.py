# SPDX-License-Identifier: Apache-2.0
"""Rows of the example `crossing`: publications and rows to another thread and to another process, compared with iceoryx2."""

from __future__ import annotations

from collections.abc import Iterator

from lines import Line

from rows import kernel


def measure(rounds: int) -> Iterator[Line]:
    """Yields the lines; iceoryx2 is built for them alone."""
    yield from kernel.printed_by([kernel.example("shared-memory", "crossing", "--features", "peer"), str(rounds)], "processes")
