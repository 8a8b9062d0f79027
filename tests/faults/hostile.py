# SPDX-License-Identifier: Apache-2.0
"""Hostile connections in a process of their own: `hostile.py PORT INSTANCE COUNT TOKEN…`, until its input ends.

The process has a lower priority than the daemon: real attackers do not run on the plant's machine.
"""

from __future__ import annotations

import collections
import contextlib
import json
import os
import random
import socket
import sys
import threading
import time
from collections.abc import Callable

from panel import Panel

CHECKED_S = 60.0
over = threading.Event()
said: collections.Counter[str] = collections.Counter()
PAUSE_S = 0.01


def drawing(blocks: int) -> bytes:
    """Returns a definition with a chain of blocks."""
    chain = {f"b{k}": {"block": {"subroutine": "library.gain"}, "constants": {}} for k in range(blocks)}
    cells = {f"c{k}": [f"b{k}.y", f"b{k + 1}.u"] for k in range(blocks - 1)}
    graph = {"name": "g", "blocks": chain, "inputs": {"u": ["b0.u"]}, "outputs": {"y": [f"b{blocks - 1}.y"]}, "cells": cells}
    return json.dumps({"graph": graph}).encode()


LARGE = [drawing(count) for count in (300, 1_000, 3_000, 6_000)]


def idle(port: int, _token: str, _instance: int) -> None:
    """Sends nothing."""
    with socket.create_connection(("127.0.0.1", port)) as wire:
        wire.settimeout(30.0)
        wire.recv(1)


def slow_head(port: int, _token: str, _instance: int) -> None:
    """Sends a head letter by letter."""
    with socket.create_connection(("127.0.0.1", port)) as wire:
        wire.sendall(b"POST /v1/call/emergency_stop HTTP/1.1\r\nhost: localhost\r\nslow: ")
        while not over.is_set():
            wire.sendall(b"a")
            time.sleep(0.05)


def slow_body(port: int, token: str, _instance: int) -> None:
    """Announces a body and does not send it."""
    with socket.create_connection(("127.0.0.1", port)) as wire:
        wire.settimeout(30.0)
        head = f"host: localhost\r\nauthorization: Bearer {token}\r\ncontent-length: 900000\r\n\r\n"
        wire.sendall(f"POST /v1/call/check_definition HTTP/1.1\r\n{head}".encode() + b" " * 1000)
        wire.recv(1)


def garbage(port: int, _token: str, _instance: int) -> None:
    """Sends bytes that are not a request."""
    with socket.create_connection(("127.0.0.1", port)) as wire:
        wire.settimeout(30.0)
        wire.sendall(random.randbytes(4096))
        wire.recv(4096)


def waits(port: int, token: str, instance: int) -> None:
    """Waits for an instance that does not end."""
    panel = Panel(port, token)
    while not over.is_set():
        status, _ = panel.call("wait", instance=instance, slice_ms=1000)
        said[f"wait {status}"] += 1
        if status != 200:
            time.sleep(PAUSE_S)


def histories(port: int, token: str, _instance: int) -> None:
    """Reads a history repeatedly."""
    panel = Panel(port, token)
    while not over.is_set():
        status, _ = panel.call("history", name="y", count=10_000)
        said[f"history {status}"] += 1


def checks(port: int, token: str, _instance: int) -> None:
    """Requests checks of large definitions."""
    panel = Panel(port, token)
    while not over.is_set():
        status, _ = panel.ask("POST", "/v1/call/check_definition", random.choice(LARGE))
        said[f"check {status}"] += 1


def unread(port: int, token: str, _instance: int) -> None:
    """Requests histories and reads no answer."""
    panel = Panel(port, token)
    body = json.dumps({"name": "y", "count": 10_000}).encode()
    request = f"POST /v1/call/history HTTP/1.1\r\n{panel.head}content-length: {len(body)}\r\n\r\n".encode() + body
    while not over.is_set():
        panel.wire.sendall(request)


def scopes(port: int, token: str, _instance: int) -> None:
    """Subscribes to everything and reads nothing."""
    panel = Panel(port, token)
    panel.stream()
    for number in range(16):
        panel.say({"subscribe": "scope", "id": f"s{number}", "names": ["y"], "every_ms": 10})
    while not over.is_set():
        panel.say({"subscribe": "statistics", "id": f"t{random.random()}", "every_ms": 100})
        time.sleep(1.0)


def reads(port: int, token: str, _instance: int) -> None:
    """Reads values as fast as possible."""
    panel = Panel(port, token)
    while not over.is_set():
        status, _ = panel.call("read", names=["y"] * 100)
        said[f"read {status}"] += 1


KINDS: tuple[Callable[[int, str, int], None], ...] = (idle, slow_head, slow_body, garbage, waits, histories, checks, unread, scopes, reads)


def again_and_again(kind: Callable[[int, str, int], None], port: int, token: str, instance: int) -> None:
    """Repeats one kind of connection: opens it again whenever it ends."""
    while not over.is_set():
        try:
            kind(port, token, instance)
        except (OSError, ValueError, IndexError) as error:
            said[f"{kind.__name__} {type(error).__name__}"] += 1
        time.sleep(PAUSE_S)


def main() -> None:
    """Runs the command."""
    with contextlib.suppress(OSError):
        os.nice(10)
    port, instance, count, tokens = int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), sys.argv[4:]
    for number in range(count):
        kind = KINDS[number % len(KINDS)]
        of = (kind, port, tokens[number % len(tokens)], instance)
        threading.Thread(target=again_and_again, args=of, daemon=True).start()
    print("ready", flush=True)
    sys.stdin.read()
    # A check takes long under this load: a run with few stops waits for the first answer.
    until = time.monotonic() + CHECKED_S
    while not any(name.startswith("check ") for name in list(said)) and time.monotonic() < until:
        time.sleep(PAUSE_S)
    over.set()
    print(json.dumps(said), flush=True)
    os._exit(0)


if __name__ == "__main__":
    main()
