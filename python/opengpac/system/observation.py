# SPDX-License-Identifier: Apache-2.0
"""Looking at a system: what there is, how it does, how long its blocks take, its page. Nothing here disturbs what runs."""

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
    """Observation of a `System`."""

    name: str
    closed: bool
    session: Session | None
    _studio: Studio | None
    _native: RealTimeSystem
    _alive: Callable[[], RealTimeSystem]

    @property
    def statistics(self) -> Statistics:
        """Firings, overruns, jitter and times of each source; instances; devices; the emergency stop. A notebook shows tables."""
        with refusals:
            return Statistics(self._alive().statistics())

    @property
    def fused(self) -> FusedBlocks:
        """Blocks that are fused, and those that are not, with the reason: see `fuse`. A notebook shows tables."""
        with refusals:
            return FusedBlocks(self._alive().fused())

    @property
    def names(self) -> Names:
        """Names of everything: processors, sources, devices, SVVs, verbs, modules, instances."""
        with refusals:
            return Names(self._alive().names())

    @property
    def verbs(self) -> Listing[VerbEntry]:
        """The verbs that were entered: those that support devices and those that act on devices, simple and composed ones."""
        with refusals:
            return verbs_of(self._alive().verbs())

    @property
    def instances(self) -> Listing[InstanceEntry]:
        """The verb instances that there are, those of devices too, with the command list that each is in."""
        return instances_of(self.statistics["instances"])

    def kept_reports(self) -> list[Report]:
        """The end reports that a remote system has kept for this session's name, oldest first: of instances that ended without a wait.
        Each is given once. Of an embedded system there are none.
        """
        return [] if self.session is None else self.session.kept_reports()

    # ---- values and time ----

    def read(self, *svvs: SVV[Any] | Channel) -> Snapshot:
        """One consistent snapshot of these SVVs, with its time: `q, v = cell.read(position, speed)`. A channel of a physical device is
        read as it was exchanged last.
        """
        for svv in svvs:
            if not isinstance(svv, SVV | Channel) or svv.system is not self:
                refuse(CallError, f"system '{self.name}' cannot read {svv!r}", "give SVVs and channels of this system")
        return snapshot(cast("System", self), svvs)

    def log(self, since: int = 0) -> Log:
        """Conditions, faults, transitions and end reports, recorded in their order; `since` a sequence number."""
        since = whole(since, "the sequence number from which the log is asked for", 0, 2**63 - 1)
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
        """Starts a record in a new MCAP file: every value of SVVs, conditions, transitions, ends, commands, timing.

        `svvs` names them, `["arm.*", "force"]`, all by default, those too that are made later; `cells=True` takes the private cells
        of verb instances too. It ends with `stop()`, as a context manager, or with the system; what could not be written is counted in
        its `lost`, and control never waits for a disk. Under the virtual clock time waits for the recorder, so nothing is lost.
        With `replay=True` the file also has everything that comes from outside, so that `opengpac replay` runs it again (docs/replay.md):
        begun before the first interrupt source is made, else refused (InvalidState).

        `split="500 MB"` ends a file at about that size (at least 1 MB) and goes on in `run-2.mcap`, `run-3.mcap` and so on, without a
        gap: each has the name, type and last value of every SVV at its beginning and is read alone. `keep=10` leaves the ten newest of them
        (at least 2) and deletes the others. Neither goes with `replay=True`. A recording leaves 256 MiB of its disk free, on a
        small one a twentieth: then the oldest files go where `keep=` is given, else it ends.
        Of a remote system `path` is a name in the daemon's folder, `opengpac rts --records FOLDER`.
        """
        from ..recordings.recording import begin

        return begin(self, path, svvs, cells=cells, replay=replay, split=split, keep=keep)

    def block_times(self, source: Source | None = None, *, during: Quantity = "60 s") -> Table:
        """Measures how long each block takes: a probe visits one block a firing, `during` so much real time (an hour at most).

        The table has what was seen so far, so look again after a while. It costs three readings of the clock a firing and changes
        nothing that is computed; under the virtual clock the times are real ones too. `source`: only its blocks.
        """
        if source is not None and not isinstance(source, Source):
            refuse(CallError, f"block times of {source!r} are asked for", "give an interrupt source, or nothing for all")
        with refusals:
            self._alive().probe(duration_ns(during, "the time to look"), None if source is None else source.name)
        return self.statistics.blocks(None if source is None else source.name)

    def top(self) -> Tables:
        """Returns once what `opengpac top` shows: processors and sources with their load, blocks by time, verbs, devices, alarms."""
        from ..top.board import board
        from ..top.look import Look

        with refusals:
            return board(Look.at(self._alive()), None)

    def studio(
        self, port: int = 0, role: str = "operate", *, edit: bool = False, open: bool = False, audit: str | os.PathLike[str] | None = None
    ) -> Studio:
        """The page that shows this system in a browser: `cell.studio().url` is its address, with a token of this run.

        It is served on 127.0.0.1 by threads of the core, at any free port where none is named; Python may be busy. `role` is what the
        page may do: "observe" looks, "operate" starts, halts and enables too; `edit=True` lets it install definitions, the role
        "configure". `open=True` opens it in a browser, where there is one. The log says what the page commanded; `audit` names a file
        that says it too. Asked for again it is the same one; it ends with `stop()`, as a context manager, and with the system.

        Of a remote system it is the page of its daemon, where that serves one. Raises `FileFailed` where the page was not built,
        `InUse` where the port is taken, `InvalidState` where it is served already with another port or role.
        """
        role = "configure" if edit and role == "operate" else role
        if edit and role != "configure":
            refuse(CallError, f"the studio is to edit, and its role is {role!r}", "leave role out, or edit=True")
        from ..studio import server

        there = self._studio
        if there is None or there.closed:
            self._alive()
            file = None if audit is None else str(files.path_of(audit, "audit="))
            there = self._served(server.serve(self, port, role, file) if self.session is None else server.of_daemon(self))
        elif there.role not in (None, role) or port not in (0, urlsplit(there.url).port):
            refuse(
                InvalidState,
                f"the studio of system '{self.name}' is served already, with role '{there.role}' at {there.url.split('#')[0]}",
                "stop() it first",
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
