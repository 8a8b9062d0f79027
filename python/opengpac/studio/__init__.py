# SPDX-License-Identifier: Apache-2.0
"""The studio: the server for its page, its workspaces, and the motions that it offers."""
