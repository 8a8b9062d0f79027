# SPDX-License-Identifier: Apache-2.0
"""A real-time system, embedded in this process or remote: its configuration, its SVVs, and its time."""

from __future__ import annotations

import contextlib
import inspect
import json
import logging
import os
import sys
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from .. import checking
from ..definition.entering import Definitions
from ..definition.modules import Module, type_json
from ..devices.logical import LogicalDevice
from ..devices.physical import PhysicalDevice
from ..errors import CallError, InUse, InvalidState, refusals, refuse
from ..refusals.argument_types import all_taking, whole
from ..refusals.declared_names import DeclaredNames
from ..refusals.source_location import here
from ..storage import files
from ..values.encoding import plain
from ..values.numbers import range_of
from ..values.quantities import Quantity, optional_ns
from . import existing, forks, hosts, open_systems, programs, warm_restart
from .clock import SystemTime
from .operation import SystemCommands
from .processes import processes_json
from .processors import Processor
from .realtime import EmbeddedSystem, RealTimeSystem
from .repeated import MadeThings
from .sources import Source, placement_json
from .statistics import FusedBlocks
from .svvs import SVV
from .takeover import TakenOver, taken_over

if TYPE_CHECKING:
    from ..application.instances import VerbInstance
    from ..definition.verbs import Verb
    from ..remote.session import Session
    from ..studio.server import Studio

R = TypeVar("R")
D = TypeVar("D", bound=LogicalDevice)

_logger = logging.getLogger("opengpac")


@all_taking
class System(SystemCommands, SystemTime, DeclaredNames):
    """A real-time system in this process, called `name`. With `clock="virtual"`, time is a number that the program advances, for tests.

    `interconnect="message"` carries connections over an in-memory message link with injectable faults, for tests; `seed` determines
    preemptions and faults under the virtual clock. `restore` is a file that `save` wrote in an earlier run; if it does not exist yet,
    nothing is restored. `adopt=True` searches for processors in separate processes that have lost a system of this name: their verbs
    continue after `take_over()`. `progress=True` shows the progress of waiting calls, `False` never does; by default it is shown at a
    terminal. As a context manager, it halts the actions on exit, then disables the devices.

    Notebook cells may be run again: a system that is created again is rebuilt if no verb is running in it; otherwise the same system
    is returned, and so are its processors, sources, physical devices, SVVs and arms if their arguments are equal. Different arguments
    raise `InUse`, with the differences.

    If the environment contains `OPENGPAC_SYSTEM`, the URL of a daemon, that daemon's system is used, and the program runs on it
    unchanged. `gpac.connect(url)` returns a system that others configured.

    Raises `CallError` for an unknown clock, `DefinitionError` for an unknown interconnect, `FileFailed` for a `restore` that cannot
    be read, and `InvalidState` for every call once it is closed.
    >>> import opengpac as gpac
    >>> with gpac.System("cell", clock="virtual") as cell:
    ...     cell.advance("2 s")
    ...     cell.now
    2.0
    """

    _settable = frozenset({"closed", "progress"})

    def __new__(cls, *given: Any, **named: Any) -> Self:
        asked = _asked(given, named)
        last = open_systems.running(asked.get("name"), asked)
        return last if isinstance(last, cls) else super().__new__(cls)

    def __init__(
        self,
        name: str,
        clock: str = "monotonic",
        *,
        seed: int = 0,
        interconnect: str | Mapping[str, Any] = "memory",
        progress: bool | None = None,
        restore: str | os.PathLike[str] | None = None,
        adopt: bool = False,
    ) -> None:
        if "_given" in self.__dict__:
            return
        if clock not in ("monotonic", "virtual"):
            refuse(
                CallError,
                f"the clock of system '{name}' must be 'monotonic' or 'virtual', not {clock!r}",
                "write clock='virtual', for example",
            )
        if not isinstance(name, str) or not name:
            refuse(CallError, f"the name of a system must be a string, not {name!r}", "write 'cell', for example")
        if "://" in name:
            refuse(CallError, f"the name of a system cannot be a URL: {name!r}", f"connect to that system: gpac.connect({name!r})")
        open_systems.close_last(name)
        seed = whole(seed, f"the seed of system '{name}'", 0, 2**64 - 1)
        given = {"seed": seed, "interconnect": interconnect, "progress": progress, "restore": restore, "adopt": adopt}
        virtual = clock == "virtual" or checking.active()
        url = None if checking.active() else os.environ.get("OPENGPAC_SYSTEM")
        if url:
            from ..remote import opening
            from ..remote.calls import Remote

            session = opening.instead(url, name, virtual, interconnect)
            self._begin(Remote(session), name, virtual, progress, session)
        else:
            link = {"kind": interconnect, "seed": seed} if interconnect == "message" else interconnect
            carrier = {"kind": link} if isinstance(link, str) else dict(link)
            options = {"seed": seed, "interconnect": carrier, "processes": processes_json(), "adopt": adopt}
            with refusals:
                native = EmbeddedSystem(name, "virtual" if virtual else clock, json.dumps(options))
                self._begin(native, name, virtual, progress)
        try:
            if restore is not None:
                self._restored = warm_restart.load(self, files.path_of(restore, "restore="))
        except BaseException:
            self.closed = True
            with refusals:
                self._native.close()
            raise
        self._given = _asked((name, clock), given)
        open_systems.keep(self, name)
        programs.made(self)

    def _begin(self, native: RealTimeSystem, name: str, virtual: bool, progress: bool | None, session: Session | None = None) -> None:
        self._native = native
        self.name = name
        self.virtual = virtual
        self.progress = progress
        self.session = session
        """Session with a remote system: its name, and the holder of command. None if the system is embedded in this process."""
        self.closed = False
        self.processors: dict[str, Processor] = {}
        self.sources: dict[str, Source] = {}
        self.devices: dict[str, LogicalDevice] = {}
        self.physical_devices: dict[str, PhysicalDevice] = {}
        self._svvs: dict[str, SVV[Any]] = {}
        self._definitions = Definitions(native)
        self._by_name = MadeThings()
        self._given: dict[str, Any] = {}
        self._rights_said = virtual
        self._unguarded_said: set[str] = set()
        self._restored: warm_restart.RestartContents | None = None
        self._studio: Studio | None = None
        self._page_role: str | None = None
        """Role of the studio's page while it is served; devices and arms register the verbs that this role needs."""
        self._arms: dict[str, Any] = {}
        """Arms by name, whose tools the studio can move."""
        self._point_files: dict[str, tuple[Path, bool]] = {}
        """Points file of each arm by name, and whether points of other models are accepted."""
        forks.known(self)

    # ---- configuration ----

    def processor(
        self,
        name: str,
        core: int | None = None,
        *,
        supervisor: bool = False,
        process: bool | str = False,
        host: str | None = None,
        lost_after: Quantity | None = None,
        patience: Quantity | None = None,
    ) -> Processor:
        """Creates a real-time processor called `name`, on `core` if set. The first one is the supervisor, unless another one is created
        with `supervisor`.

        `process=True` runs it in a separate process: a crash there is `processor_lost` for the others. `process="cell-a"` runs it in
        the process of that name, with every other processor that names it: a crash there affects all of them, and values between them
        are exchanged as between threads. `host` names a host that has joined the system. Under the virtual clock all processors run
        in one thread, regardless of their placement.

        `lost_after`: a process that hangs for this time is killed, with its outputs safe; by default after 0.1 s if it is stopped
        (SIGSTOP, a debugger), otherwise after 0.5 s without a sign of life. A processor without a process consists of threads of this
        program: in that case, the outputs of devices that a guard can reach become safe, and the program is not killed. `patience`: a
        process considers its supervisor lost if it hears nothing from it for this time (40 s), and verbs that continue without one
        wait this long for the next (10 s).

        Raises PlacementError for a named process and a host together, DefinitionError for an invalid process name (letters, digits,
        `-`, `_`, `.`, at most 64), InUse if it is another processor's own process, InvalidState if the process cannot be started or
        is lost.
        """
        bounds = optional_ns(lost_after, "lost_after"), optional_ns(patience, "patience")
        core = None if core is None else whole(core, f"the core of processor '{name}'", 0, 65_535)
        asked = {"core": core, "supervisor": supervisor, "process": process, "host": host, "lost_after": lost_after, "patience": patience}
        if self._by_name.equal("processor", name, asked):
            return self.processors[name]
        with refusals:
            self._alive().processor(name, core, supervisor, process, host, *bounds)
        made = self.processors.setdefault(name, Processor(self, name, apart=bool(process or host)))
        self._by_name.keep("processor", name, asked, made)
        return made

    def listen(
        self,
        endpoint: str,
        name: str | None = None,
        *,
        authority: str | os.PathLike[str] | None = None,
        certificate: str | os.PathLike[str] | None = None,
        key: str | os.PathLike[str] | None = None,
        token: str | None = None,
        clock_limit: Quantity | None = None,
    ) -> None:
        """Lets other hosts join: `cell.listen("tcp/127.0.0.1:7447")`, then `opengpac join` on the other host, then
        `cell.processor("rtp2", host=…)`.

        On a loopback address, programs of the same user are admitted, or, with a `token`, programs that have it. For other machines,
        the endpoint must be `tls/HOST:PORT`, with PEM files of an `authority`, a `certificate` and its `key`, or with a token that
        both sides have. `endpoint` is the address on which to listen, `name` the name of this host (by default its host name).
        `clock_limit` is the maximum deviation between the clocks of the hosts; the log reports larger ones. It has no effect under
        the virtual clock. Raises InvalidState if the address is in use, or lacks the required security.
        """
        given = hosts.options(
            endpoint,
            name or hosts.host_name(),
            authority=None if authority is None else os.fspath(authority),
            certificate=None if certificate is None else os.fspath(certificate),
            key=None if key is None else os.fspath(key),
            token=token,
            clock_limit=clock_limit,
        )
        with refusals:
            self._alive().listen(**given)

    def take_over(self) -> TakenOver:
        """Takes over verbs in processes that lost their system: they continue under this system from their current state.

        Call this on a system created with `adopt=True`, once everything exists again: processors, sources, devices, verbs, and
        started verbs that keep devices running. Until then, this system does not affect any device in those processes. Blocks with
        the same label and interface continue with their parameters, states and outputs; verbs that were not started again end. If
        there is nothing to take over, as under the virtual clock, the result says so. Raises `InvalidState` if the running verbs must
        not continue.
        """
        with refusals:
            return taken_over(self._alive().take_over())

    def download(self, path: str | os.PathLike[str], name: str | None = None) -> Module:
        """Downloads a code module while the system runs: C or C++ source, a shared object, or a compiled Rust module.

        `path` is the file, `name` the module's name (by default the file's name without its extension and `lib`). The module is first
        tested in a separate process. Raises `ModuleError` with the compiler's first error, or another defect of the file.
        """
        file = str(Path(path).expanduser().absolute())
        with refusals:
            described = self._alive().download(file, name, sys.executable or None)
        if note := described.get("note"):
            warnings.warn(note, RuntimeWarning, stacklevel=2)
        return Module(described, file, self)

    def fuse(self, on: bool = True) -> FusedBlocks:
        """Fuses consecutive blocks with C sources that are always due together, if some of them read values that others store.

        Each group gets one entry, compiled from the sources as downloaded, so that values pass between blocks in registers. The
        observable behaviour is bit-identical: values, numbers, conditions, and faults of each block. Fusing applies to installed
        blocks, and to the same blocks with the same wiring when they are installed later; for others, call this again. All verbs keep
        running in the meantime. `on=False` undoes it.

        Returns the fused blocks, and the others with reasons; also available as `cell.fused`. This takes about a second per group,
        and can be interrupted: finished compilations are kept.
        """
        while True:
            with refusals:
                told = FusedBlocks(self._alive().fuse(on))
            if not told["waiting"]:
                return told

    def place(self, placement: Mapping[Any, Source]) -> None:
        """Places blocks on sources. `placement` maps patterns to sources: `{"move.planner": slow, "joint_servo.*": fast}`."""
        placed = placement_json(placement)
        with refusals:
            self._alive().place(placed)

    def svv(
        self,
        name: str,
        type: Any = None,
        *,
        unit: str = "",
        initial: Any = None,
        history: int = 0,
        within: tuple[float, float] | str | None = None,
    ) -> SVV[Any]:
        """Creates a state vector variable called `name`; `type` is a C declaration, a type of a code module, or `float`, `int`, `bool`;
        the default is `double`.

        `unit` is a text, `"rad"`; `initial` its initial value, 0 by default; `history` the number of most recent values that are
        kept, at most as many as fit in 1 GiB. `within` is the range of values that Python may store, `(0, 1)` or `"[0, inf)"`. In a
        remote system, a name alone returns the existing SVV. An SVV that this program has already created is returned again, with its
        current value, if the arguments are equal; otherwise raises `InUse`.
        """
        if self.session is not None and type is None and initial is None and not (unit or history or within) and self._there("svvs", name):
            return self._svv(name)
        text, types = type_json("double" if type is None else type, f"SVV '{name}'")
        value = None if initial is None else {"value": plain(initial, f"the initial value of SVV '{name}'")}
        kept = whole(history, f"the history of SVV '{name}'", 0, 2**32 - 1)
        ends = range_of(within, f"the range of SVV '{name}'")
        asked = {"type": text, "types": types, "unit": unit, "initial": value, "history": kept, "within": ends}
        there = self._by_name.thing("SVV", name)
        if there is not None and not there._is_there():
            self._by_name.forget("SVV", name)
        if self._by_name.equal("SVV", name, asked):
            return cast("SVV[Any]", there)
        specification = {"type_text": text, "unit": unit, "initial": value, "history": kept, "within": ends, "types": types}
        with refusals:
            self._alive().svv(specification, name, here().json())
        self._svvs.pop(name, None)
        made = self._svv(name)
        _ = made._asked  # From here on it stands for this one.
        self._by_name.keep("SVV", name, asked, made)
        return made

    # ---- existing objects ----

    def instance(self, name: str, verb: Verb[..., R] | None = None) -> VerbInstance[R]:
        """Returns the verb instance called `name`, regardless of the program that created it, in order to watch it, wait for it, halt
        it, or start it again.

        With its `verb` it has the declared reports and exceptions; without, `Report` and `Terminated`.
        """
        return existing.instance(self, name, verb)

    def device(self, name: str, kind: type[D] = LogicalDevice) -> D:
        """Returns the logical device called `name`, regardless of the program that created it, as a device of the class `kind`; by
        default its members are those of its type in the system."""
        return existing.device(self, name, kind)

    def _say_rights(self) -> None:
        """Logs, once and in one line, the real-time privileges that were not granted; everything still works, but with larger latencies."""
        if self._rights_said:
            return
        self._rights_said = True
        statistics = self.statistics
        missing = [m for source in statistics["sources"].values() for m in source["rights_missing"]]
        missing += statistics["supervisor_rights_missing"]
        if missing:
            _logger.warning("system '%s' lacks real-time privileges: %s", self.name, "; ".join(dict.fromkeys(missing)))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the data needed for a warm restart, `gpac.System(name, restore=path)`, to `path`: tunable parameters and members
        declared with `keep=True` of every logical device, and the alarms, which become history.

        Motion is never restored: after a restart, everything is disabled and no verb has been started. The file is written
        atomically; the previous one is kept as `PATH.previous`.
        """
        warm_restart.save(self, files.path_of(path, "save()"))

    @property
    def left_over(self) -> list[str]:
        """Descriptions of the contents of a restart file that could not be restored."""
        return [] if self._restored is None else [*self._restored.left_over]

    def close(self) -> None:
        """Halts the actions, disables the devices, and stops the kernels. Idempotent.

        For a system returned by `gpac.connect`, only ends the session; verbs continue.
        """
        if not self.closed:
            self.closed = True
            open_systems.forget(self)
            if self._studio is not None:
                self._studio.stop()
            with refusals:
                self._native.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        if kind is not None:
            self._abandon()
        try:
            if kind is None:
                programs.left(self)
        finally:
            self.close()

    def _abandon(self) -> None:
        """Ends the use of the system by a program that fails: verbs that it started in a remote system follow their policies."""
        if self.session is not None and not self.session.whole:
            self.session.abandon()

    def __repr__(self) -> str:
        if self.closed:
            return f"system '{self.name}': closed"
        names = self.names
        listed = {what: [found] if isinstance(found, str) else found for what, found in names.items() if found}
        parts = [f"{what.replace('_', ' ')}: {', '.join(_short(n) for n in found)}" for what, found in listed.items()]
        clock = "virtual" if self.virtual else "monotonic"
        return "\n  ".join([f"system '{self.name}' ({clock} clock, {self.now:.6g} s)", *parts])

    def _left_behind(self, instead: forks.NotHere) -> None:
        """Replaces the system in a forked process, which does not inherit the system's threads."""
        self._native = cast("RealTimeSystem", instead)
        self.closed, self._studio = True, None
        # Callers outside this class can only read it.
        object.__setattr__(self, "session", None)
        open_systems.forget(self)

    def _alive(self) -> RealTimeSystem:
        if self.closed and not isinstance(self._native, forks.NotHere):
            refuse(InvalidState, f"system '{self.name}' is closed", f"create it again: gpac.System('{self.name}')")
        return self._native

    def _there(self, kind: str, name: str) -> bool:
        return name in self.names[kind]

    def _svv(self, name: str) -> SVV[Any]:
        """Returns the SVV that currently has this name."""
        known = self._svvs.get(name)
        if known is None or not known._is_there():
            known = self._svvs[name] = SVV(self, name)
        return known

    def _enter_verb(self, verb: Any) -> None:
        self._definitions.enter_verb(verb)

    def _check_verb(self, verb: Any) -> None:
        # A verb of this name may be running: then its new definition is refused on use, not here.
        with contextlib.suppress(InUse):
            self._enter_verb(verb)

    def _running(self) -> list[str]:
        if self.session is not None and self.session.lost:
            return []
        with refusals:
            instances = self._native.statistics().get("instances", [])
        return [i["name"] for i in instances if i.get("state") in ("queued", "running", "suspended")]


def _short(name: Any) -> str:
    return str(name.get("name", name)) if isinstance(name, dict) else str(name)


def _asked(given: tuple[Any, ...], named: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the arguments of a new system by name, including omitted ones; empty if they do not match the signature."""
    try:
        bound = inspect.signature(System.__init__).bind(None, *given, **named)
    except TypeError:
        return {}
    bound.apply_defaults()
    return {name: value for name, value in bound.arguments.items() if name != "self"}
