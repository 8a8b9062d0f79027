# SPDX-License-Identifier: Apache-2.0
"""Distribution of tests to workers: each begins with a run of neighbours, which share fixtures; an idle worker takes tests from others."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Sequence


class Stretches:
    """Runs of tests by index, for `workers` workers that take one after the other."""

    def __init__(self, tests: Sequence[int], workers: int) -> None:
        ends = [len(tests) * n // workers for n in range(workers + 1)]
        self._left = [deque(tests[begin:end]) for begin, end in itertools.pairwise(ends)]

    def neighbour(self, worker: int) -> int | None:
        """Takes the next test of a worker's own run; returns `None` at its end."""
        own = self._left[worker]
        return own.popleft() if own else None

    def take(self, worker: int) -> int | None:
        """Takes the next test of a worker: from its own run, or from the second half of the longest one. Returns `None` when all are
        taken."""
        if not self._left[worker]:
            longest = max(self._left, key=len)
            self._left[worker].extend(reversed([longest.pop() for _ in range((len(longest) + 1) // 2)]))
        return self.neighbour(worker)

    def put_back(self, worker: int, test: int) -> None:
        """Puts a test back at the front of a worker's run."""
        self._left[worker].appendleft(test)
