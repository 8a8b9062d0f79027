# SPDX-License-Identifier: Apache-2.0
"""Devices that communicate in lines of text: scanners, scales, printers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..errors import CallError, refuse
from ..refusals.argument_types import taking
from ..values.quantities import Quantity, optional_ns
from .driver import Driver, given


@taking
def text(
    address: str,
    *,
    reads: Sequence[str] = (),
    writes: Sequence[str] = (),
    asks: str | None = None,
    fields: Mapping[str, Mapping[str, Any]] | None = None,
    start: str | None = None,
    end: str | None = None,
    length: int | None = None,
    checksum: Mapping[str, str] | None = None,
    answer: Quantity | None = None,
    silent: Quantity | None = None,
    period: Quantity | None = None,
    age_max: Quantity | None = None,
) -> Driver:
    """A device that communicates in lines of text: `text("tcp/192.0.2.8:4001", reads=["ST,GS,{weight} kg"], fields={"weight": {"unit":
    "kg"}})`.

    `address` is `tcp/HOST:PORT` or `serial//dev/ttyUSB0?baud=9600&parity=none&stop=1`. In the patterns of received texts, `reads`, a
    name in braces is a channel; `{}` matches anything, and a literal brace is doubled. The first pattern that matches applies;
    unmatched texts are counted and ignored. The channel `count` is the number of texts received.

    A field is a number, a double, unless `fields` declares otherwise: `{"unit": "kg", "scale": 0.001, "offset": 0.0, "base": 16}`;
    `{"when": "ST"}` is true if the field is this word; `{"text": 32}` is a text of up to 32 characters, a channel of type
    `uint8_t[32]` padded with zeros.

    `writes` are texts to send; each is sent when a value in it changes while a verb commands that value. A number has `"decimals"`,
    and may have a `"safe"` value: the text is then sent with that value when the number is no longer commanded. `asks` is sent in
    each period, to a device that only answers requests; an `answer` may take 0.5 s.

    A text ends with `end` (a line feed, optionally preceded by a carriage return), begins after `start`, or has a fixed `length`. A
    `checksum` may follow it: `{"sum": "xor", "mark": "*"}`; `"sum"` is `"xor"` or `"sum"`, `"written"` as two digits (`"hex"`) or one
    `"byte"`. With `silent="2 s"` the device is lost if it sends nothing for that time. It is served once per `period` (10 ms), on a
    separate thread.
    """
    for name, field in (fields or {}).items():
        if not isinstance(field, Mapping):
            refuse(CallError, f"field '{name}' must be a dictionary, not {field!r}", 'write {"unit": "kg"}, for example')
    return Driver(
        "text",
        given(
            address=address,
            reads=list(reads),
            writes=list(writes),
            asks=asks,
            fields={name: dict(field) for name, field in (fields or {}).items()},
            start=start,
            end=end,
            length=length,
            checksum=None if checksum is None else dict(checksum),
            answer_ns=optional_ns(answer, "the timeout of an answer"),
            silent_ns=optional_ns(silent, "the timeout of silence"),
            period_ns=optional_ns(period, "the period"),
            age_max_ns=optional_ns(age_max, "the maximum age"),
        ),
    )
