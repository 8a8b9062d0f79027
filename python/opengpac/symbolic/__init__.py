# SPDX-License-Identifier: Apache-2.0
"""Symbolic models: makes a function block of a `casadi.Function` through CasADi's own C code. `gpac.casadi`."""

from .block import CasadiBlock, casadi

__all__ = ["CasadiBlock", "casadi"]
