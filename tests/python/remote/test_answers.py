# SPDX-License-Identifier: Apache-2.0
"""HTTP answers as they arrive over a socket: whole, in pieces, with a length known only at the end, and invalid ones."""

from __future__ import annotations

import contextlib
import http.client
import socket
import threading
from collections.abc import Sequence

import pytest

from opengpac.remote import answers
from opengpac.remote.answers import Answer

BODY = b'{"result":null}'
PLAIN = b"HTTP/1.1 200 OK\r\ncontent-type: application/json\r\nContent-Length: 15\r\n\r\n" + BODY


def told(pieces: Sequence[bytes]) -> tuple[Answer, bool]:
    """Returns the result of reading these pieces from a peer that sends nothing further."""
    here, there = socket.socketpair()

    def send() -> None:
        # A reader that refuses the answer has closed the connection.
        with contextlib.suppress(OSError):
            for piece in pieces:
                there.sendall(piece)
            there.shutdown(socket.SHUT_WR)

    sends = threading.Thread(target=send)
    sends.start()
    try:
        return answers.read(here)
    finally:
        here.close()
        sends.join()
        there.close()


def test_an_answer_is_the_same_in_one_piece_and_byte_by_byte() -> None:
    whole = told([PLAIN])
    assert whole == (Answer(200, BODY), True)
    assert told([PLAIN[at : at + 1] for at in range(len(PLAIN))]) == whole


def test_a_large_body_comes_whole() -> None:
    body = bytes(range(256)) * 1_024
    head = b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n" % len(body)
    assert told([head, body[:100_000], body[100_000:]]) == (Answer(200, body), True)


def test_a_body_in_parts_is_put_together() -> None:
    head = b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n"
    parts = b"8;of=two\r\n" + BODY[:8] + b"\r\n7\r\n" + BODY[8:] + b"\r\n0\r\nlast: word\r\n\r\n"
    assert told([head + parts]) == (Answer(200, BODY), True)
    assert told([head, *(parts[at : at + 1] for at in range(len(parts)))]) == (Answer(200, BODY), True)


@pytest.mark.parametrize(
    "text",
    [
        b"HTTP/1.1 200 OK\r\n\r\n" + BODY,
        PLAIN.replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n"),
        PLAIN.replace(b"HTTP/1.1", b"HTTP/1.0"),
        PLAIN + b"and more that nobody asked for",
    ],
)
def test_a_connection_that_cannot_be_used_again_is_known(text: bytes) -> None:
    assert told([text]) == (Answer(200, BODY), False)


def test_what_comes_on_the_way_to_an_answer_is_passed_over() -> None:
    assert told([b"HTTP/1.1 100 Continue\r\n\r\n" + PLAIN]) == (Answer(200, BODY), True)


def test_an_answer_without_a_body_is_whole() -> None:
    assert told([b"HTTP/1.1 204 No Content\r\n\r\n"]) == (Answer(204, b""), True)


@pytest.mark.parametrize(("again", "seconds"), [(b"3", 3.0), (b"0", 0.01), (b"9999", 10.0), (b"Wed, 21 Oct", 1.0)])
def test_when_to_ask_again_is_told(again: bytes, seconds: float) -> None:
    answer, _ = told([b"HTTP/1.1 429 Too Many Requests\r\nRetry-After: " + again + b"\r\nContent-Length: 0\r\n\r\n"])
    assert answer == Answer(429, b"", seconds)


@pytest.mark.parametrize(
    ("text", "error"),
    [
        (b"", http.client.RemoteDisconnected),
        (b"SSH-2.0-server\r\n\r\n", http.client.BadStatusLine),
        (b"HTTP/1.1 two hundred\r\n\r\n", http.client.BadStatusLine),
        (b"HTTP/1.1 200 OK\r\nContent-Length: 15\r\n", http.client.BadStatusLine),
        (b"HTTP/1.1 200 OK\r\nContent-Length: -15\r\n\r\n" + BODY, http.client.BadStatusLine),
        (b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\nfew\r\n" + BODY, http.client.BadStatusLine),
        (b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n-5\r\n" + BODY, http.client.BadStatusLine),
        (PLAIN[:-1], http.client.IncompleteRead),
        (b"HTTP/1.1 200 OK\r\n" + b"a: b\r\n" * 20_000, http.client.LineTooLong),
    ],
)
def test_what_is_no_answer_is_refused(text: bytes, error: type[Exception]) -> None:
    with pytest.raises(error):
        told([text])
