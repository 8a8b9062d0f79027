# SPDX-License-Identifier: Apache-2.0
"""Learned policies as function blocks: a network from an ONNX file, with the meaning of its inputs and outputs (`gpac.policy`,
`gpac.Term`)."""

from .block import Policy, policy
from .terms import Term

__all__ = ["Policy", "Term", "policy"]
