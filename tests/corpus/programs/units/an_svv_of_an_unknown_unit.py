# SPDX-License-Identifier: Apache-2.0
"""An SVV has an unknown unit."""

import opengpac as gpac

cell = gpac.System("cell", clock="virtual")
torque = cell.svv("torque", unit="Nm")
