# SPDX-License-Identifier: Apache-2.0
"""User-supplied values: numbers, quantities with units, poses, tables, and their encoding for the real-time system."""
