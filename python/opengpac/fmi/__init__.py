# SPDX-License-Identifier: Apache-2.0
"""FMUs, units of a co-simulation by FMI 2 or 3, as function blocks. `gpac.fmu`."""

from .block import FmuBlock, fmu

__all__ = ["FmuBlock", "fmu"]
