# SPDX-License-Identifier: Apache-2.0
"""A verb applied to arguments: the request, the instance, its wait and its end report."""
