# SPDX-License-Identifier: Apache-2.0
"""The scope of a page, counted end to end: received values and values reported as lost add up to those stored."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import NamedTuple

import pytest

import opengpac as gpac
from browser import Browser, Stream
from opengpac import activate

CHANNELS = 16


class Run(NamedTuple):
    """Values of one channel in a frame."""

    channel: int
    lost: int
    stamps: list[tuple[int, int]]
    values: tuple[float, ...]


def runs(frame: bytes) -> list[Run]:
    """Returns the runs of a frame, each value of one component, as docs/control.md specifies."""
    magic, length = struct.unpack_from("<II", frame)
    assert magic == 0x47534331 and frame[8 : 8 + length] == b"s1"
    at = 8 + -(-length // 8) * 8
    count, zero = struct.unpack_from("<II", frame, at)
    assert zero == 0
    at += 8
    found: list[Run] = []
    for _ in range(count):
        channel, values, lost = struct.unpack_from("<IIQ", frame, at)
        stamps = list(struct.iter_unpack("<qQ", frame[at + 16 : at + 16 + 16 * values]))
        at += 16 + 16 * values
        found.append(Run(channel, lost, stamps, struct.unpack_from(f"<{values}d", frame, at)))
        at += 8 * values
    assert at == len(frame)
    return found


def counted(stream: Stream, stored: int) -> tuple[int, int]:
    """Returns the received and the lost values, once their sum for every channel is the number stored."""
    after, got, lost = [0] * CHANNELS, [0] * CHANNELS, [0] * CHANNELS
    while any(came + missed < stored for came, missed in zip(got, lost, strict=True)):
        for run in runs(stream.next()):
            # The first number is ahead by the values lost before it; after that none is missing.
            first = after[run.channel] + run.lost
            assert [number for _, number in run.stamps] == list(range(first, first + len(run.stamps)))
            assert all(time_ns == (number + 1) * 1_000_000 for time_ns, number in run.stamps)
            assert set(run.values) <= {2.5}
            after[run.channel] = first + len(run.stamps)
            got[run.channel] += len(run.stamps)
            lost[run.channel] += run.lost
    assert set(after) == {stored}
    return sum(got), sum(lost)


@pytest.mark.parametrize("seconds", [2, 60])
def test_what_comes_and_what_is_lost_is_what_was_stored(page: Path, seconds: int) -> None:
    with gpac.System("cell", clock="virtual") as cell:
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        wave = gpac.Verb(
            "wave",
            blocks={"wave": gpac.library.signal_generator(shape=0, offset=2.5)},
            instantiation_parameters={"y": "wave.y"},
            command_lists={"start": [activate("wave", every="1 ms")]},
        )
        names = [f"c{k}" for k in range(CHANNELS)]
        instances = [wave.on(fast).new_instance(y=cell.svv(name, float)) for name in names]
        stream = Browser(cell.studio().url).stream()
        stream.say(subscribe="scope", id="s1", names=names, every_ms=10)
        assert [channel["name"] for channel in stream.next()["scope"]["channels"]] == names
        for instance in instances:
            instance.start()
        # The stream is not read meanwhile: the connection can buffer two seconds, but not sixty.
        for _ in range(seconds):
            cell.advance("1 s")
        got, lost = counted(stream, seconds * 1000)
        stream.close()
    assert got + lost == CHANNELS * seconds * 1000
    assert got > 0 and (lost > 0) == (seconds == 60)
