# SPDX-License-Identifier: Apache-2.0
"""Refusals: checks of arguments and assigned names, and how an error shows the user's own line."""
