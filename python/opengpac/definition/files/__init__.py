# SPDX-License-Identifier: Apache-2.0
"""Graphs, verbs and device types as text files: `gpac.load("shapes.toml")`, `shapes.smooth.save("smooth.json")`; `docs/files.md`.

`reading` has `load`, `saving` has `save`, `contents` what a file held.
"""
