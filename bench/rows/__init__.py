# SPDX-License-Identifier: Apache-2.0
"""Groups of rows: each module has a function `measure` that yields lines."""
