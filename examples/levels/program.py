# SPDX-License-Identifier: Apache-2.0
"""Three levels of control in three files: blocks (`closed_loop.c`), simple verbs (`actions.py`), a composed verb (`sequence.py`).

This file configures the hardware and combines the three: `python examples/levels/program.py`.
"""

from __future__ import annotations

from pathlib import Path

import actions
import sequence

import opengpac as gpac


def main() -> gpac.Report:
    """Presses once, under the virtual clock."""
    with gpac.System("press_cell", clock="virtual") as cell:
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        code = cell.download(Path(__file__).with_name("closed_loop.c"))

        class Slide(gpac.LogicalDevice, verb=actions.slide(code)):
            """Slide with a speed and a position."""

            speed: gpac.SVV[float] = gpac.svv(unit="m/s")
            position: gpac.SVV[float] = gpac.svv(unit="m")

        slide = Slide("slide", on=fast).enable()
        approach = actions.advance(code, Slide, "approach", speed=0.5)
        insert = actions.advance(code, Slide, "insert", speed=0.02)
        press = sequence.press(approach, insert)
        print(repr(press))
        report = press(slide, contact=0.1, depth=0.11)
        print(cell.verbs)
        print(f"pressed to {report.reached:.4f} m in {report.time:.3f} s")
        return report


if __name__ == "__main__":
    main()
