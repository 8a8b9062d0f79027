# SPDX-License-Identifier: Apache-2.0
"""Fixtures of the documentation's tests; the design listing is not collected: its test runs it as a program, in a folder with its files."""

collect_ignore = ["design_listing.py"]
