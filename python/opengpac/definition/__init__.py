# SPDX-License-Identifier: Apache-2.0
"""Definitions: blocks, graphs and verbs, their parts, and the files that contain them."""
