# SPDX-License-Identifier: Apache-2.0
"""Frames of serial servos as seen by the servos: decodes requests and encodes answers."""

from __future__ import annotations

from dataclasses import dataclass

BROADCAST = 0xFE
PING, READ, WRITE, REBOOT, SYNC_READ, SYNC_WRITE = 1, 2, 3, 8, 0x82, 0x83


@dataclass(frozen=True)
class Request:
    """Request to a servo: its ID, the instruction and the body; `address` and `length` are decoded from the body if the instruction has
    them."""

    id: int
    word: int
    body: bytes
    width: int
    """Size in bytes of an address or a length in `body`."""

    @property
    def address(self) -> int:
        """Address of the register."""
        return int.from_bytes(self.body[: self.width], "little")

    @property
    def length(self) -> int:
        """Length of the register in bytes."""
        return int.from_bytes(self.body[self.width : 2 * self.width], "little")

    @property
    def rest(self) -> bytes:
        """Bytes after address and length: the IDs of a sync read, or the rows of a sync write."""
        return self.body[2 * self.width :]


class Sts:
    """Feetech STS frames: `ff ff id length word … sum`."""

    def take(self, stream: bytearray) -> Request | None:
        """Removes and returns the next complete request from a stream, and discards any bytes before it; returns None if no request is
        complete yet."""
        while (head := stream.find(b"\xff\xff")) >= 0:
            del stream[:head]
            if len(stream) < 4 or len(stream) < 4 + stream[3]:
                return None
            frame = bytes(stream[: 4 + stream[3]])
            if stream[3] >= 2 and ~sum(frame[2:-1]) & 0xFF == frame[-1]:
                del stream[: len(frame)]
                return Request(frame[2], frame[4], frame[5:-1], 1)
            del stream[:1]
        return None

    def answer(self, id: int, error: int, body: bytes) -> bytes:
        """Encodes an answer as a frame."""
        inner = bytes([id, len(body) + 2, error]) + body
        return b"\xff\xff" + inner + bytes([~sum(inner) & 0xFF])


class Dynamixel2:
    """Dynamixel 2.0 frames: `ff ff fd 00 id length word … crc`, with `fd` stuffed after header patterns."""

    HEAD = b"\xff\xff\xfd\x00"

    def take(self, stream: bytearray) -> Request | None:
        """Removes and returns the next complete request, like `Sts.take`."""
        while (head := stream.find(self.HEAD)) >= 0:
            del stream[:head]
            if len(stream) < 7:
                return None
            end = 7 + int.from_bytes(stream[5:7], "little")
            if len(stream) < end:
                return None
            frame = bytes(stream[:end])
            if end >= 10 and crc(frame[:-2]) == int.from_bytes(frame[-2:], "little"):
                del stream[:end]
                body = frame[7:-2].replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")
                return Request(frame[4], body[0], body[1:], 2)
            del stream[:4]
        return None

    def answer(self, id: int, error: int, body: bytes) -> bytes:
        """Encodes an answer as a frame."""
        inner = (b"\x55" + bytes([error]) + body).replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")
        frame = self.HEAD + bytes([id]) + (len(inner) + 2).to_bytes(2, "little") + inner
        return frame + crc(frame).to_bytes(2, "little")


def crc(frame: bytes) -> int:
    """Returns the CRC-16 of Dynamixel 2.0, computed bit by bit: x^16 + x^15 + x^2 + 1."""
    value = 0
    for byte in frame:
        value ^= byte << 8
        for _ in range(8):
            value = (value << 1 ^ (0x8005 if value & 0x8000 else 0)) & 0xFFFF
    return value
