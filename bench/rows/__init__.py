# SPDX-License-Identifier: Apache-2.0
"""The groups of rows: each module has `measure`, which gives lines."""
