# SPDX-License-Identifier: Apache-2.0
"""The studio: the server of its page, its workspaces, and the offered motions."""
