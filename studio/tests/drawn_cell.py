# SPDX-License-Identifier: Apache-2.0
"""The system in which verbs of the docs are drawn: an arm, and the code modules of the guarded move."""

from pathlib import Path

import opengpac as gpac

BLOCKS = Path(__file__).parents[2] / "examples" / "blocks"

cell = gpac.System("drawing", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
arm = gpac.robots.load("ur5e", rtp, on=fast)
modules = [cell.download(BLOCKS / name) for name in ("glide.c", "tool_line.c")]
print("the modules are there", flush=True)
