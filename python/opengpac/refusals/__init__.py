# SPDX-License-Identifier: Apache-2.0
"""Refusals: checks of arguments and assigned names, and the display of errors at the user's own line."""
