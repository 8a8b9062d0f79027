# SPDX-License-Identifier: Apache-2.0
"""Blocks in Python: `@block` on a function whose arguments are the block's items. Numba compiles the function."""

from .block import PythonBlock, block
from .words import Condition, Input, Invocation, Output, Parameter, State

__all__ = ["Condition", "Input", "Invocation", "Output", "Parameter", "PythonBlock", "State", "block"]
