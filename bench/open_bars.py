# SPDX-License-Identifier: Apache-2.0
"""Bars that are not met yet, each with its reason: a run may miss them. A bar that is met again loses its line."""

from __future__ import annotations

from lines import Line

WAKES = "3 to 4 switches of thread a call, 7 at a firing: 67 to 241 µs by the package, 35 to 168 by the core, by machine (decision 146)"
COMMANDS = "each command is an operation of its own: 5.6 to 7.9 µs, as one graph 1.3 (decision 149)"
LANES = "the source, the supervisor and a second thread of the server are woken in each call; written down and handed over (decision 217)"
BYTES = "memory decides: 152 bytes a block, the loop has 104: 1.46 times as many (decision 149)"
ENTRY = "1.13 to 1.26 for a gain, where PID holds: its entry is not explained yet (decision 149)"
LAW = "no acceleration along the path at the boundary of two pieces: joints 1.16, tool 1.49, median 1.06 and 1.23 (decision 303)"
OPEN = {
    ("dispatch", "gain in Rust, chain, "): ENTRY,
    ("dispatch", "PID in C, independent, 100,000"): BYTES,
    ("dispatch", "64 gains in Rust side by side"): "1.33 to 1.35 ns: five stores to four cache lines a block (decision 210)",
    ("dispatch", "100 gains in C, a chain, fused"): "1.12 to 1.27, once 1.69; in a loop of its own 1.13: not the stores (decision 211)",
    ("install", "1 block into a running system"): "woken for the table, woken for the firing; 28 µs where woken once (decision 150)",
    ("verb", "execute on"): WAKES,
    ("verb", "ends at its first firing"): WAKES,
    ("remote verb", "move(…), remote"): LANES,
    ("remote verb", "start, remote"): LANES,
    ("transition", "100 blocks out and in, each by a command"): COMMANDS,
    ("python blocks", "the first block of a process"): "a PID 1.4 s, 2.1 s where Python keeps no byte code; a tiny block 0.97 s",
    ("queue", "five moves of the joints, blended, to TOPP3"): LAW,
    ("queue", "five lines of the tool, blended, to TOPP3"): LAW,
    ("policy", "large"): "0.60 to 0.62 of onnxruntime: 760 kB of weights come at 84 GB/s, the bar takes 103 (decision 203)",
}
"""Reason by row and beginning of the line."""


def reason(line: Line) -> str:
    """Returns the reason why the bar of a line is open; empty if it is not."""
    return next((why for (row, begin), why in OPEN.items() if line.row == row and line.what.startswith(begin)), "")
