# SPDX-License-Identifier: Apache-2.0
"""Observation of a system: its contents, its state, the durations of its blocks, and its page. It does not disturb running verbs."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, cast
from urllib.parse import urlsplit

from ..application.reports import Report
from ..devices.physical import Channel
from ..errors import CallError, InvalidState, refusals, refuse
from ..refusals.argument_types import all_taking, whole
from ..storage import files
from ..studio import offered_motions
from ..values.quantities import Quantity, duration_ns
from ..values.tables import Table, TableDisplay, Tables
from .listing import InstanceEntry, Listing, VerbEntry, instances_of, verbs_of
from .sources import Source
from .statistics import FusedBlocks, Log, Names, Statistics
from .svvs import SVV, Snapshot, snapshot

if TYPE_CHECKING:
    from ..recordings.recording import Recording
    from ..remote.session import Session
    from ..studio.server import Studio
    from .realtime import RealTimeSystem
    from .system import System


@all_taking
class SystemObservation(TableDisplay):
    """Methods of `System` for observation."""

    name: str
    closed: bool
    session: Session | None
    _studio: Studio | None
    _native: RealTimeSystem
    _alive: Callable[[], RealTimeSystem]

    @property
    def statistics(self) -> Statistics:
        """Returns firings, overruns, jitter and times of each source; instances; devices; and the emergency stop. A notebook shows them
        as tables."""
        with refusals:
            return Statistics(self._alive().statistics())

    @property
    def fused(self) -> FusedBlocks:
        """Returns the blocks that are fused, and those that are not, with the reasons: see `fuse`. A notebook shows them as tables."""
        with refusals:
            return FusedBlocks(self._alive().fused())

    @property
    def names(self) -> Names:
        """Returns the names of all objects: processors, sources, devices, SVVs, verbs, modules, instances."""
        with refusals:
            return Names(self._alive().names())

    @property
    def verbs(self) -> Listing[VerbEntry]:
        """Returns the registered verbs, simple and composed: those that support devices, and those that act on devices."""
        with refusals:
            return verbs_of(self._alive().verbs())

    @property
    def instances(self) -> Listing[InstanceEntry]:
        """Returns the existing verb instances, including those of devices, with the current command list of each."""
        return instances_of(self.statistics["instances"])

    def kept_reports(self) -> list[Report]:
        """Returns the end reports that a remote system has kept for this session's name, oldest first. They belong to instances that
        ended while no call was waiting for them. Each report is returned once. An embedded system keeps none."""
        return [] if self.session is None else self.session.kept_reports()

    # ---- values and time ----

    def read(self, *svvs: SVV[Any] | Channel) -> Snapshot:
        """Returns one consistent snapshot of these SVVs, with its time: `q, v = cell.read(position, speed)`. For a channel of a physical
        device, returns the value from the latest exchange."""
        for svv in svvs:
            if not isinstance(svv, SVV | Channel) or svv.system is not self:
                refuse(CallError, f"system '{self.name}' cannot read {svv!r}", "pass SVVs and channels of this system")
        return snapshot(cast("System", self), svvs)

    def log(self, since: int = 0) -> Log:
        """Returns conditions, faults, transitions and end reports in the order in which they occurred, starting at the sequence number
        `since`."""
        since = whole(since, "the first sequence number of the log", 0, 2**63 - 1)
        with refusals:
            return Log(self._alive().log(since))

    def record(
        self,
        path: str | os.PathLike[str],
        svvs: Sequence[str] | None = None,
        *,
        cells: bool = False,
        replay: bool = False,
        split: int | str | None = None,
        keep: int | None = None,
    ) -> Recording:
        """Starts a recording in a new MCAP file at `path`: every value of SVVs, conditions, transitions, ends, commands, timing.

        `svvs` selects SVVs, `["arm.*", "force"]`; by default all, including those created later. `cells=True` includes the private
        cells of verb instances. The recording ends with `stop()`, at the end of a `with` block, or with the system; lost data are
        counted in its `lost`, and control never waits for a disk. Under the virtual clock time waits for the recorder, so nothing is
        lost. With `replay=True` the file also contains all external inputs, so that `opengpac replay` can run it again
        (docs/replay.md): it must start before the first interrupt source is created, otherwise it is refused (`InvalidState`).

        `split="500 MB"` closes a file at about that size (at least 1 MB) and continues in `run-2.mcap`, `run-3.mcap` and so on,
        without a gap: each starts with the name, type and latest value of every SVV, and can be read on its own. `keep=10` retains
        the ten latest files (at least 2) and deletes the others. Neither can be combined with `replay=True`. A recording leaves 256
        MiB of its disk free, or a twentieth of a small disk: below that, the oldest files are deleted if `keep=` is set, otherwise it
        ends. For a remote system `path` is a name in the daemon's folder, `opengpac rts --records FOLDER`.
        """
        from ..recordings.recording import begin

        return begin(self, path, svvs, cells=cells, replay=replay, split=split, keep=keep)

    def block_times(self, source: Source | None = None, *, during: Quantity = "60 s") -> Table:
        """Measures the duration of each block. A probe measures one block per firing, and runs for `during` of real time (at most an
        hour).

        The table contains the results so far, so call this again later for more. The probe costs three clock readings per firing and
        does not change any computed values; times are real even under the virtual clock. `source` limits it to the blocks of one
        source.
        """
        if source is not None and not isinstance(source, Source):
            refuse(
                CallError,
                f"block times can be measured for interrupt sources, not for {source!r}",
                "pass an interrupt source, or nothing for all of them",
            )
        with refusals:
            self._alive().probe(duration_ns(during, "the time to look"), None if source is None else source.name)
        return self.statistics.blocks(None if source is None else source.name)

    def top(self) -> Tables:
        """Returns a snapshot of `opengpac top`: processors and sources with their load, blocks by time, verbs, devices, alarms."""
        from ..top.board import board
        from ..top.look import Look

        with refusals:
            return board(Look.at(self._alive()), None)

    def studio(
        self, port: int = 0, role: str = "operate", *, edit: bool = False, open: bool = False, audit: str | os.PathLike[str] | None = None
    ) -> Studio:
        """Serves the page that shows this system in a browser: `cell.studio().url` is its address, with a token of this run.

        Threads of the core serve it on 127.0.0.1, at `port`, by default any free one, even while Python is busy. `role` defines the
        permissions of the page: "observe" watches, "operate" also starts, halts, enables and records; `edit=True` lets it install
        definitions, the role "configure". `open=True` opens it in a browser, if there is one. The log records the page's commands;
        `audit` names a file that records them too. Further calls return the same page; it ends with `stop()`, at the end of a `with`
        block, and with the system.

        For a remote system it is the page of its daemon, if the daemon serves one. Raises `FileFailed` if the page was not built,
        `InUse` if the port is in use, `InvalidState` if it is already served with another port or role.
        """
        role = "configure" if edit and role == "operate" else role
        if edit and role != "configure":
            refuse(CallError, f"a studio that edits cannot have the role {role!r}", "omit role= or edit=True")
        from ..studio import server

        there = self._studio
        if there is None or there.closed:
            self._alive()
            file = None if audit is None else str(files.path_of(audit, "audit="))
            there = self._served(server.serve(self, port, role, file) if self.session is None else server.of_daemon(self))
        elif there.role not in (None, role) or port not in (0, urlsplit(there.url).port):
            refuse(
                InvalidState,
                f"the studio of system '{self.name}' is already served, with role '{there.role}' at {there.url.split('#')[0]}",
                "call stop() on it first",
            )
        if open:
            there.open()
        return there

    def _served(self, page: Studio) -> Studio:
        self._studio = page
        if page.role is not None:
            offered_motions.offer(self, page.role)
        return page

    def _table(self) -> Tables | None:
        if self.closed:
            return None
        return Tables([self.names._table(), *self.statistics._table().tables], f"system {self.name}")
