# SPDX-License-Identifier: Apache-2.0
"""Implements `gpac.connect`: returns a remote system as an object of the same class as an embedded one."""

from __future__ import annotations

import os

from .. import checking
from ..refusals.argument_types import taking
from ..system import open_systems
from ..system.existing import fill
from ..system.system import System
from ..values.quantities import Quantity
from .address import address
from .calls import Remote
from .opening import open_session


@taking
def connect(
    url: str,
    *,
    name: str | None = None,
    token: str | None = None,
    ca: str | os.PathLike[str] | None = None,
    certificate: str | os.PathLike[str] | None = None,
    command: bool = True,
    lost_after: Quantity = "5 s",
    person: str | None = None,
    progress: bool | None = None,
) -> System:
    """Connects to the real-time system at a URL; returns the same `System` as an embedded one.

    `url` is `unix:///path.sock`, `http://127.0.0.1:PORT` or `https://HOST:PORT`, as printed by `opengpac rts`. `name` is the
    session's name: reconnecting with it takes over the verbs and reports that a lost session left behind (`cell.session.returned`,
    `cell.instance(name)`, `cell.kept_reports()`). `token` is required on a port (default `OPENGPAC_TOKEN`), `ca` is a file of trusted
    certificates, `certificate` a file with the client's certificate and key. With `command=False` the session only watches;
    `command=True` is refused with `NotCommanding` while another session has command; `cell.session.request_command` then requests it.
    `person` is shown to others with the session's name, for example "Anna Maier". A session without a heartbeat for `lost_after` (1 s
    to 60 s) is lost.

    `processors`, `sources` and `physical_devices` contain the existing ones. Leaving the `with` block, or `close`, ends the session,
    and running verbs continue; leaving the block by an exception, or exiting without `close`, counts as being cut off: each verb
    started by this session follows its `if_cut_off`. If the system no longer answers, every call raises `ConnectionLost`.

    `progress` is as in `gpac.System`. In a program checked by `opengpac check` the result is an empty embedded system.
    """
    if checking.active():
        address(url)
        return System(name or "remote", clock="virtual")
    session = open_session(url, name, token=token, ca=ca, certificate=certificate, command=command, lost_after=lost_after, person=person)
    system = System.__new__(System)
    system._begin(Remote(session), session.version["system"], session.version["clock"] == "virtual", progress, session)
    open_systems.keep(system, f"{session.url} {session.name}")
    try:
        fill(system)
    except BaseException:
        system.close()
        raise
    return system
