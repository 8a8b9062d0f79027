# SPDX-License-Identifier: Apache-2.0
"""The design listing is a program, run by its test in a folder that has what it asks for."""

collect_ignore = ["design_listing.py"]
