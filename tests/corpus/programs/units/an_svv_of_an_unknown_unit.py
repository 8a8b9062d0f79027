# SPDX-License-Identifier: Apache-2.0
"""An SVV has a unit that nobody knows."""

import opengpac as gpac

cell = gpac.System("cell", clock="virtual")
torque = cell.svv("torque", unit="Nm")
