# SPDX-License-Identifier: Apache-2.0
"""`opengpac stubs PROGRAM.py`: writes a stub next to a program, so that a type checker knows the signatures of verbs created from
dictionaries."""

from .program import stub

__all__ = ["stub"]
