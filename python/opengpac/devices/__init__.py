# SPDX-License-Identifier: Apache-2.0
"""Devices: physical devices with their channels, logical devices and groups, and taught points."""
