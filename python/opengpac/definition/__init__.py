# SPDX-License-Identifier: Apache-2.0
"""Definitions: blocks, graphs and verbs, the parts they are made of, and the files that hold them."""
