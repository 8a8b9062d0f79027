# SPDX-License-Identifier: Apache-2.0
"""Recordings of a run, read back and run again."""
