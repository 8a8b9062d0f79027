# SPDX-License-Identifier: Apache-2.0
"""Application of a verb to arguments: the request, the instance, the wait and the end report."""
