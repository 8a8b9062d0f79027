# SPDX-License-Identifier: Apache-2.0
"""Emulated devices wait for nobody: not for a client that does not read, nor for a copy of their descriptors in a forked process."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

import opengpac as gpac
from afar import DEADLINE_S, until
from opengpac.drivers.fake import emulated, ends
from opengpac.drivers.fake.servo_frames import READ, Dynamixel2, crc

fake = gpac.drivers.fake
UNREAD = 300_000
"""Number of bytes that no terminal keeps for a program that does not read."""


def ended(act: Callable[[], Any], what: str) -> None:
    """Runs `act` in a thread of its own, and fails with `what` if it does not return."""
    thread = threading.Thread(target=act, daemon=True)
    thread.start()
    thread.join(DEADLINE_S)
    assert not thread.is_alive(), what


@contextlib.contextmanager
def forked_copy() -> Iterator[None]:
    """Keeps a forked process inside, which has a copy of every descriptor of this one."""
    woken, wakes = os.pipe()
    if (child := os.fork()) == 0:
        os.close(wakes)
        os.read(woken, 1)
        os._exit(0)
    try:
        yield
    finally:
        os.close(wakes)
        os.waitpid(child, 0)
        os.close(woken)


def test_a_bus_of_servos_goes_on_and_closes_although_nobody_reads_its_answers() -> None:
    frame = Dynamixel2.HEAD + bytes([1, 7, 0, READ, 0, 0, 200, 0])
    frame += crc(frame).to_bytes(2, "little")
    bus = fake.servos("dynamixel", [1])
    line = os.open(bus.port, os.O_WRONLY | os.O_NOCTTY | os.O_NONBLOCK)

    def asked() -> bool:
        with contextlib.suppress(BlockingIOError):
            for _ in range(50):
                os.write(line, frame)
        return bus.requests * 200 > UNREAD

    try:
        until(asked, "each request is answered")
        ended(bus.close, "the bus closes")
    finally:
        os.close(line)


def test_a_serial_device_sends_and_closes_although_nobody_reads() -> None:
    scale = fake.text(serial=True).start()
    ended(lambda: [scale.say("x" * 999) for _ in range(UNREAD // 1000)], "it sends to nobody")
    ended(scale.close, "the device closes")


def test_a_line_closes_although_a_forked_process_has_its_descriptors() -> None:
    bus, scale = fake.servos("feetech"), fake.text(serial=True).start()
    with forked_copy():
        ended(bus.close, "the bus closes")
        ended(scale.close, "the device closes")


def test_a_network_device_sends_although_a_client_does_not_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ends, "UNREAD_S", 1)
    scale = fake.text().start()
    with socket.create_connection(("127.0.0.1", int(scale.address.rpartition(":")[2]))):
        until(lambda: scale.connected, "the client is accepted")
        ended(lambda: [scale.say("x" * 999_999) for _ in range(10)], "it sends to nobody")
        ended(scale.close, "the device closes")


def test_an_emulated_bus_that_hangs_is_told_and_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    bus = fake.canopen("x")
    monkeypatch.setattr(emulated, "ANSWER_S", 0.1)
    monkeypatch.setattr(emulated, "END_S", 0.1)
    os.kill(bus._process.pid, signal.SIGSTOP)
    with pytest.raises(gpac.DeviceFailed, match=r"did not answer within 0\.1 s; start a new one"):
        bus.lose(1)
    assert bus._process.returncode == -signal.SIGKILL
