# SPDX-License-Identifier: Apache-2.0
"""FMUs (FMI 2 or 3, co-simulation) as function blocks: `gpac.fmu`."""

from .block import FmuBlock, fmu

__all__ = ["FmuBlock", "fmu"]
