# SPDX-License-Identifier: Apache-2.0
"""Graphs, verbs and device types as text files: `gpac.load("shapes.toml")`, `shapes.smooth.save("smooth.json")`; `docs/files.md`.

`reading` defines `load`, `saving` defines `save`, and `contents` defines the loaded contents.
"""
