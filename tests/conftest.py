# SPDX-License-Identifier: Apache-2.0
"""Options of the tests."""

from __future__ import annotations

import signal

import pytest

# A shell starts what runs in its background without Ctrl-C; tests press it.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--renew", action="store_true", help="write expected texts anew, to be read before they are committed")
