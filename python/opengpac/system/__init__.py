# SPDX-License-Identifier: Apache-2.0
"""A real-time system: its processors, sources, state vector variables, clock, alarms and operation."""
