# SPDX-License-Identifier: Apache-2.0
"""Files that the package reads and writes, and its caches."""
