# SPDX-License-Identifier: Apache-2.0
"""Messages to a user whose host is not admitted, or whose system cannot listen."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from joining import LISTENER, Joining, free_endpoint

OUTSIDE = "tcp/192.0.2.1:7447"
"""Address reserved for documentation: it reaches no host."""


def refused(joining: Joining) -> str:
    """Returns the output of a host that is refused."""
    status, said = joining.ended()
    assert status == 1 and "Traceback" not in said, said
    return said


@pytest.mark.usefixtures("listening")
def test_a_system_of_another_name(joins: Callable[..., Joining], endpoint: str) -> None:
    said = refused(joins(system="lime"))
    assert f"no system 'lime' answered at '{endpoint}' within 15 s; check that it is running there under this name" in said


def test_a_port_where_nobody_listens(joins: Callable[..., Joining], endpoint: str) -> None:
    assert f"cannot connect to '{endpoint}'" in refused(joins())


@pytest.mark.usefixtures("listening")
def test_the_name_of_the_host_that_listens(joins: Callable[..., Joining]) -> None:
    assert f"the host that listens is also named '{LISTENER}'; give this one another name" in refused(joins(LISTENER))


@pytest.mark.parametrize(
    ("at", "words"),
    [
        (OUTSIDE, "can be reached from other hosts, so it needs TLS; use tls/HOST:PORT with certificates or a token"),
        ("tls/127.0.0.1:7447", "needs certificates: give authority, certificate and key, or a token"),
        ("127.0.0.1:7447", "is not an endpoint; write tcp/HOST:PORT or tls/HOST:PORT"),
    ],
)
def test_an_endpoint_that_does_not_do(joins: Callable[..., Joining], at: str, words: str) -> None:
    assert f"'{at}' {words}" in refused(joins(at=at))
    with gpac.System("line", progress=False) as cell, pytest.raises(gpac.InvalidState) as caught:
        cell.listen(at, LISTENER)
    assert f"'{at}' {words}" in str(caught.value) and Path(__file__).name in str(caught.value)


def test_a_name_that_does_not_do(joins: Callable[..., Joining]) -> None:
    assert "'cell b' cannot name a host; use letters, digits" in refused(joins("cell b"))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"token": "short"}, "the token is too weak; use 16 characters or more, without white space"),
        ({"token": "with white space in it"}, "the token is too weak"),
        ({"token": "a-token-of-the-tests"}, "a token alone is not enough to listen; give this host's certificate and its key too"),
        ({"authority": "ca.pem", "certificate": "none.pem", "key": "server.key"}, "none.pem' cannot be used: No such file"),
        ({"authority": "ca.pem", "certificate": "server.pem", "key": "open.key"}, "others may read it; chmod 600 it"),
    ],
)
def test_secrets_that_do_not_do(certificates: Path, changes: dict[str, Any], words: str) -> None:
    (certificates / "open.key").write_bytes((certificates / "server.key").read_bytes())
    (certificates / "open.key").chmod(0o644)
    given = {what: value if what == "token" else certificates / value for what, value in changes.items()}
    with gpac.System("line", progress=False) as cell:
        with pytest.raises(gpac.InvalidState) as caught:
            cell.listen(free_endpoint("tls"), LISTENER, **given)
        cell.listen(free_endpoint(), LISTENER)
    assert words in str(caught.value)


def test_a_token_in_a_file_that_is_too_weak(joins: Callable[..., Joining], tmp_path: Path, certificates: Path) -> None:
    (tmp_path / "token").write_text("short\n")
    options = ["--token-file", str(tmp_path / "token"), "--ca", str(certificates / "ca.pem")]
    assert "the token is too weak" in refused(joins("cell-b", *options, at=free_endpoint("tls")))


def test_a_file_of_a_token_that_is_not_there(joins: Callable[..., Joining], tmp_path: Path) -> None:
    said = refused(joins("cell-b", "--token-file", str(tmp_path / "token"), at=free_endpoint("tls")))
    assert str(tmp_path / "token") in said


def test_a_processor_of_a_host_that_does_not_join(listening: gpac.System) -> None:
    with pytest.raises(gpac.InvalidState, match="host 'cell-c' did not join system 'line' within 15 s; start `opengpac join"):
        listening.processor("far", host="cell-c")


def test_a_processor_of_a_host_without_listening() -> None:
    with gpac.System("line", progress=False) as cell, pytest.raises(gpac.InvalidState, match="does not listen for hosts"):
        cell.processor("far", host="cell-b")


def test_who_listens_already(listening: gpac.System) -> None:
    with pytest.raises(gpac.InvalidState, match="is already listening"):
        listening.listen(free_endpoint(), LISTENER)
