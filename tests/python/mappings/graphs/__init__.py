# SPDX-License-Identifier: Apache-2.0
"""The graphs that must give the same values on every mapping, by name."""

from __future__ import annotations

from mappings.graph import Entry
from mappings.graphs import arrays, chains, filters, in_python, joins, lists, nested, rates, signals, types

_FOLDERS = (chains, joins, rates, arrays, types, nested, filters, signals, lists, in_python)

GRAPHS: dict[str, Entry] = {name: entry for folder in _FOLDERS for name, entry in vars(folder).items() if isinstance(entry, Entry)}
