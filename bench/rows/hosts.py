# SPDX-License-Identifier: Apache-2.0
"""Rows of values and groups between hosts, beside bare zenoh: the example `bench` of the crate `hosts`, which is built here (zenoh takes
minutes the first time). It makes network namespaces, which needs root."""

from __future__ import annotations

import os
from collections.abc import Iterator

from lines import Line

from rows.kernel import example, printed_by


def measure(rounds: int) -> Iterator[Line]:
    """The lines, those over loopback first."""
    try:
        yield from printed_by([example("hosts", "bench"), str(rounds)], "hosts")
    except RuntimeError:
        if os.geteuid() == 0:
            raise
        yield Line("hosts", "between network namespaces", note="not taken: they need root")
