# SPDX-License-Identifier: Apache-2.0
"""The programs of the corpus are checked, not imported."""

collect_ignore = ["programs"]
