# SPDX-License-Identifier: Apache-2.0
"""Symbolic models: creates a function block from a `casadi.Function` through the C code that CasADi generates (`gpac.casadi`)."""

from .block import CasadiBlock, casadi

__all__ = ["CasadiBlock", "casadi"]
