# SPDX-License-Identifier: Apache-2.0
"""Recordings of a run, and their replay."""
