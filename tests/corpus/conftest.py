# SPDX-License-Identifier: Apache-2.0
"""Excludes the programs of the corpus from collection: they are checked, not imported."""

collect_ignore = ["programs"]
