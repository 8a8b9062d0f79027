# SPDX-License-Identifier: Apache-2.0
"""An arm with a file of taught points, one of them in a work frame. Its time is virtual and follows the clock on the wall."""

import tempfile
import time
from pathlib import Path

import opengpac as gpac

STEP_S = 0.02

arm = gpac.robots.load("ur5e", clock="virtual").enable()
points = gpac.Points(Path(tempfile.mkdtemp()) / "points.toml", arm)
points.frames["table"] = gpac.Frame((0.3, 0.1, 0.05), rpy=(0, 0, "20 deg"))
points.tools["gripper"] = gpac.Frame((0, 0, "120 mm"))
points.teach("home")
points.teach("tray", frame="table", note="above the tray")
print(f"points: {points.path}", flush=True)
while True:
    arm.system.advance(STEP_S)
    time.sleep(STEP_S)
