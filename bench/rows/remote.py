# SPDX-License-Identifier: Apache-2.0
"""Calls and starts of a verb from a remote programming system, compared with a bare HTTP request over the same Unix socket to the same
daemon.

The bare request does nothing in the daemon (`POST /v1/heartbeat`), and is made with the standard library's client on a kept
connection. The difference is the package's work, JSON, the command's path into the system, and the audit file. The package reads
answers with its own reader, which is faster than the standard library's. For comparison the same request is therefore also sent as
prepared bytes, of whose answer only the end is read: the time of the socket and the daemon alone.
"""

from __future__ import annotations

import contextlib
import http.client
import socket
import subprocess
import sys
import tempfile
import time as clock
from collections.abc import Iterator
from pathlib import Path

from lines import Line, median, time

import opengpac as gpac
from opengpac import execute, on
from rows.kernel import C

BAR = 1.5


def measure(rounds: int, quick: bool) -> Iterator[Line]:
    """Measures a start alone, and the four calls of a verb's life."""
    times = 50 if quick else 300
    with _daemon() as path, gpac.connect(f"unix://{path}", name="bench", progress=False) as cell:
        soft = cell.processor("rtp0").software("soft", priority=50)
        block = cell.download(str(C / "blocks.c"), "bench_blocks")["at_once"]
        verb = gpac.Verb("at_once", blocks={"b": block}, command_lists={"start": [execute("b")]}, conditions={"completed": on()}).on(soft)
        bare = _Bare(path, cell)
        starts, lives, requests, alone = [], [], [], []
        calls: list[float] = []
        bytes_alone: list[float] = []
        with verb.new_instance() as instance:
            for _ in range(rounds):
                round_of = [_start(instance, bare) for _ in range(times)]
                starts.append(median(start for start, _, _ in round_of))
                requests.append(median(request for _, request, _ in round_of))
                alone.append(median(exchange for _, _, exchange in round_of))
        for _ in range(rounds):
            lives.append(median(_life(verb) for _ in range(times)))
            turn = [_call(verb, bare) for _ in range(times)]
            calls.append(median(call for call, _ in turn))
            bytes_alone.append(median(exchange for _, exchange in turn))
        bare.close()
    for what, ours, beside, others, bar in (
        ("move(…), remote", calls, "bytes of a bare request", bytes_alone, BAR),
        ("start, remote", starts, "bare request", requests, BAR),
        ("start, remote", starts, "bytes of a bare request", alone, None),
        ("create, start, wait, delete, remote", lives, "bare request", requests, None),
    ):
        value = median(own / other for own, other in zip(ours, others, strict=True))
        yield Line(
            "remote verb", what, time(median(ours)), f"{beside} {time(median(others))}", value, f"{value:.2f} ×", bar,
            "" if bar is None else f"≤ {bar} ×",
        )  # fmt: skip


@contextlib.contextmanager
def _daemon() -> Iterator[Path]:
    """Yields the socket of a private daemon in real time."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cell.sock"
        words = ["rts", "--name", "bench", "--socket", str(path), "--clock", "monotonic"]
        process = subprocess.Popen([sys.executable, "-m", "opengpac", *words], stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        try:
            while not process.stdout.readline().startswith("listening on "):
                if process.poll() is not None:
                    raise RuntimeError("the daemon did not start")
            yield path
        finally:
            process.terminate()
            process.communicate()


class _Bare:
    """Connection of the standard library's client to the same socket, in the same session."""

    def __init__(self, path: Path, cell: gpac.System) -> None:
        assert cell.session is not None
        self._connection = http.client.HTTPConnection("localhost")
        self._connection.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._connection.sock.connect(str(path))
        self._headers = cell.session.headers
        lines = ["POST /v1/heartbeat HTTP/1.1", "Host: localhost", "Content-Length: 0", *(f"{k}: {v}" for k, v in self._headers.items())]
        self._bytes = "\r\n".join([*lines, "", ""]).encode()

    def request(self) -> None:
        self._connection.request("POST", "/v1/heartbeat", headers=self._headers)
        self._connection.getresponse().read()

    def exchange(self) -> None:
        """Sends the same request as bytes; the answer is a JSON object."""
        self._connection.sock.sendall(self._bytes)
        answer = b""
        while not answer.endswith(b"}"):
            answer += self._connection.sock.recv(4096)

    def close(self) -> None:
        self._connection.close()


def _start(instance: gpac.VerbInstance[gpac.Report], bare: _Bare) -> tuple[float, float, float]:
    """Returns the times of a start, of a bare request after it, and of its bytes alone, ns."""
    begun = clock.perf_counter_ns()
    instance.start()
    started = clock.perf_counter_ns()
    instance.wait()
    # Warms up: the package does not use the standard library's client, and cold code is slower.
    bare.request()
    asked = clock.perf_counter_ns()
    bare.request()
    answered = clock.perf_counter_ns()
    bare.exchange()
    exchanged = clock.perf_counter_ns()
    return float(started - begun), float(answered - asked), float(exchanged - answered)


def _call(verb: gpac.Verb[..., gpac.Report], bare: _Bare) -> tuple[float, float]:
    """Returns the times of a call of the verb and of a bare request as bytes after it, ns."""
    begun = clock.perf_counter_ns()
    verb()
    called = clock.perf_counter_ns()
    bare.exchange()
    return float(called - begun), float(clock.perf_counter_ns() - called)


def _life(verb: gpac.Verb[..., gpac.Report]) -> float:
    """Returns the time of the four calls, ns."""
    begun = clock.perf_counter_ns()
    instance = verb.new_instance()
    instance.start()
    instance.wait()
    instance.delete()
    return float(clock.perf_counter_ns() - begun)
