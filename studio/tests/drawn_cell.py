# SPDX-License-Identifier: Apache-2.0
"""The system in which verbs of the docs are drawn: an arm, the code modules of the guarded move, and the slide of the press."""

import sys
from pathlib import Path

import opengpac as gpac

EXAMPLES = Path(__file__).parents[2] / "examples"
BLOCKS = EXAMPLES / "blocks"
sys.path.insert(0, str(EXAMPLES / "levels"))
import actions  # noqa: E402

cell = gpac.System("drawing", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
arm = gpac.robots.load("ur5e", rtp, on=fast)
modules = [cell.download(BLOCKS / name) for name in ("glide.c", "tool_line.c")]
code = cell.download(EXAMPLES / "levels" / "closed_loop.c")


class Slide(gpac.LogicalDevice, verb=actions.slide(code)):
    """A slide with a speed and a position."""

    speed: gpac.SVV[float] = gpac.svv(unit="m/s")
    position: gpac.SVV[float] = gpac.svv(unit="m")


# A verb enters the system with its first instance: the page makes the other one of a file.
insert = actions.advance(code, Slide, "insert", 0.02).new_instance(Slide("table", on=fast))
print("the modules are there", flush=True)
