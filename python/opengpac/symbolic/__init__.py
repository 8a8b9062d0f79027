# SPDX-License-Identifier: Apache-2.0
"""Symbolic models: a `casadi.Function` becomes a function block through CasADi's own C code. `gpac.casadi`."""

from .block import CasadiBlock, casadi

__all__ = ["CasadiBlock", "casadi"]
