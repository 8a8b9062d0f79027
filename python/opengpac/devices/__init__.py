# SPDX-License-Identifier: Apache-2.0
"""Devices: physical ones with their channels, logical ones and groups of them, and taught points."""
