# SPDX-License-Identifier: Apache-2.0
"""Values of users: numbers, quantities with units, poses, tables, and their encoding for the real-time system."""
