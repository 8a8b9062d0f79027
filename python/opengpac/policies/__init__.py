# SPDX-License-Identifier: Apache-2.0
"""Learned policies: a network from an ONNX file, with the meaning of its numbers, as a function block. `gpac.policy`, `gpac.Term`."""

from .block import Policy, policy
from .terms import Term

__all__ = ["Policy", "Term", "policy"]
