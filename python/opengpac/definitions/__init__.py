# SPDX-License-Identifier: Apache-2.0
"""Graphs, verbs and device types as text files: `gpac.load("shapes.toml")`, `shapes.smooth.save("smooth.json")`; `docs/files.md`."""

from .contents import DefinitionFile
from .reading import load
from .saving import save

__all__ = ["DefinitionFile", "load", "save"]
