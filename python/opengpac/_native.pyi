# SPDX-License-Identifier: Apache-2.0
"""The compiled real-time core, seen from Python: conversions only. Everything public is in `opengpac` itself.

Text arguments that end in `_json` have the JSON forms of the Rust model (`definition.rs`, `configuration.rs`); what a call
refuses comes as `Refused`, whose `args[0]` is the JSON of a list of refusals (`class`, `message`, `ends`, `remedy`, `place`).
Times are ns, int. Names of sources are `rtp.source`.
"""

from collections.abc import Callable

class Refused(Exception):
    """One or more refusals, their JSON in `args[0]`; nothing has changed."""

def version() -> str: ...
def library_json() -> str:
    """The blocks of the standard library: list of interfaces (each with `name` = `library.block`, `doc`, `items`, `types`)."""

def header_text() -> str:
    """The text of `opengpac.h`."""

def build(sources: list[str], output: str | None) -> str:
    """Compiles C or C++ sources into a code module; returns its path. Refused (ModuleError) shows the first error."""

def replay(path: str, asked_json: str) -> str:
    """Runs a record again: what is asked for and what is found as JSON. Refused (CallError) is what cannot be read."""

def trial(module: str, block: str, values_json: str, inputs_json: str, times: int, period_ns: int) -> str:
    """Runs a block with no system, an invocation every `period_ns`: `values` constants, `inputs` name → list of values (one an invocation) or one constant.

    Returns JSON: name → list of values of each output; `conditions`: list of [invocation, name, value]; `fault` or null.
    `module` is "library" or the path of a loaded module.
    """

def type_json(type_text: str, types_json: str) -> str:
    """Normalised type as a tree: {"scalar": "double"} | {"array": [tree, n]} | {"struct": [[name, tree, offset], …], "size": n}, with "text", "size", "align"."""

def long_form(kind: str, definition_json: str) -> str:
    """A definition (JSON) of kind "graph", "verb" or "device_type" with its short forms written out, as `define_verb` keeps it."""

def nearest(word: str, candidates: list[str]) -> str | None:
    """The candidate that `word` most likely meant, if one is near."""

def number_in(text: str, unit: str) -> float:
    """The number that a quantity, `"90 deg"`, is in a unit, `"rad"`. Refused: ValueRefused, UnitMismatch."""

def join_system(system: str, options_json: str) -> str | None:
    """Lends this host to a system until that is gone; the reason where it could not. options: {"endpoint", "name", ["authority"], ["certificate"], ["key"], ["token"], ["clock_limit_ns"]}."""

def run_processor() -> str | None:
    """The life of a process that a system started for a processor; returns at its end, with the reason where it could not serve."""

def run_guard() -> str | None:
    """The guard process: returns when nothing is left to guard and nobody is connected, or with the reason why it could not serve.
    `processes.command("run_guard")` starts it."""

def run_plant() -> str | None:
    """A plant process: returns when it is put away. `processes.command("run_plant")` starts it."""

def try_model(path: str, library: str | None) -> str | None:
    """Loads a MuJoCo model in a process of its own; what is wrong with it, None where nothing is."""

def plant_state(name: str) -> str | None:
    """How the plant process of that name is, for who watches it; None where there is none.

    {"is_safe", "obeyed_ns": monotonic, "steps", "failed": text or null, "readings": bytes, "pid"}.
    """

def serve(
    system: System, options_json: str, tell: Callable[[str], object], ready: Callable[[list[str], str | None], object]
) -> None:
    """Serves a system over the control interface until a signal's exception comes; `tell` hears what its journal comes to, line by
    line, then `ready` gets the addresses, and where the studio's page is.

    options: {"socket", "listen", "tls_cert", "tls_key", "client_ca", "tokens", "audit", "journal": text, "journal_strict",
    "insecure_loopback": bool, "hosts", "origins": [text], "page": folder, "run_token": role, "no_socket": bool}, each may be left out. Nothing listens where something is refused.
    """

def socket_path(name: str) -> str:
    """Where the Unix socket of a system lies where nothing else is said."""

def token_new(path: str, name: str, role: str, expires: int | None = None, certificate: str | None = None) -> str:
    """Enters a new token into the file and returns it; with the PEM file of a client certificate, enters that and returns "".

    `expires`: s since 1970. OSError: the file; ValueError: the role.
    """

def token_list(path: str) -> str:
    """[{"name", "role", "sha256", "certificate", "created", "expires", "revoked"}]; no token itself."""

def token_revoke(path: str, name: str) -> bool:
    """Revokes what has that name; false where there is none."""

class Server:
    """A system of this process, served over the control interface by threads of its own: whatever Python does, they answer."""

    def __init__(self, system: System, options_json: str) -> None:
        """options: as those of `serve`, and {"no_socket": bool, "run_token": role, "page": folder}."""

    def addresses(self) -> list[str]:
        """Where it listens."""

    def studio(self) -> str | None:
        """Where the page is, with the token of this run behind `#`; None where no page is served."""

    def stop(self) -> None:
        """Stops answering. Twice is once."""

class System:
    """One real-time system, embedded in this process."""

    def __init__(self, name: str, clock: str, options_json: str) -> None:
        """clock: "monotonic" or "virtual". options: {"seed": int, "interconnect": {"kind": "memory"} | {"kind": "message", "seed": int, "delay_ns": [lo, hi], "drop": p, "repeat": p, "reorder": p, "corrupt": p}, "processes": {"command": [text], "guard": [text], "python": text}, "adopt": bool}."""

    # configuration -----------------------------------------------------------------------------------------------------
    def listen(self, options_json: str) -> None:
        """Lets other hosts join; options as in `join_system`. Refused: InvalidState."""

    def take_over(self) -> str:
        """What runs in processes that lost their system goes on. {"processors": [{"name", "processors": [name], "is_adopted", "carried": [label], "anew": [{"block", "why"}], "ended": [label], "gap_ns": int | None}]}. Refused: InvalidState."""

    def processor(
        self, name: str, core: int | None, supervisor: bool, process: bool | str, host: str | None,
        lost_after_ns: int | None = None, patience_ns: int | None = None,
    ) -> None:
        """process: False, True (one of its own) or the name of one that several processors share. Refused: PlacementError, DefinitionError, InUse, InvalidState."""
    def source(self, processor: str, name: str, kind: str, period_ns: int, priority: int, virtual_cost_ns: int) -> None:
        """kind: "timer", "trigger" or "software"."""

    def request(self, source: str) -> None: ...
    def raise_source(self, device: str, channel: str, source: str, place_json: str) -> None:
        """Each time the channel goes from zero to something else, the trigger or software source is requested."""

    def physical_device(self, processor: str, name: str, kind: str, options_json: str, source: str, place_json: str) -> str:
        """Opens a driver ("mujoco", "loopback", …). Returns {"channels": [{name, write, type_text, unit}], "parts": [driver's own description]}."""

    def reopen_physical_device(self, name: str) -> None:
        """Opens a lost physical device again, with everything that is bound to it; nothing where it is not lost."""

    def delete_physical_device(self, name: str) -> None:
        """Closes a physical device that nothing is bound to."""

    def download(self, path: str, name: str | None) -> str:
        """C source, shared object or compiled Rust module. Returns {"name", "blocks": [interface], "types": {name: declaration}}."""

    def place(self, placement_json: str) -> None:
        """{pattern: source}."""

    def define_verb(self, verb_json: str) -> None:
        """Checks and enters a verb. An equal definition is nothing; a different one of the name redefines it (InUse while an instance runs or is suspended)."""

    def check_graph(self, graph_json: str) -> None: ...
    def check_definition(self, drawing_json: str) -> str:
        """{"graph": …} or {"verb": …} -> the refusals (JSON) of that definition, types and units too, each with "where"; nothing is entered."""

    def compatible(self, drawing_json: str, source_json: str, sink_json: str) -> str:
        """Why the ports {block, port} of a definition cannot be wired, or null; `to` null: [{block, port, reason}] for every port."""

    def compose(self, composition_json: str) -> str:
        """The verb (JSON) that a composition of verbs is: {name, doc, parts: {label: verb}, transitions: [{from: [part or list], condition | null, to, place}],
        initial, rename, preset, share, together, place}. Nothing is entered; Refused lists every conflict."""

    def define_device_type(self, type_json: str) -> None: ...
    def svv(self, name: str, specification_json: str, place_json: str) -> None:
        """specification: {type_text, unit, initial, history, types}."""

    def delete_svv(self, name: str) -> None: ...
    def device(self, name: str, device_json: str) -> None:
        """Makes logical device: {device_type, parameters: {…overrides}, arguments: {drive: {"part": {device, part}}}, source: "rtp.fast" | null, every: {label: ns}, place}.
        SVVs are named `name.member`. Its own verb instance is created with it."""

    def enable(self, device: str) -> int:
        """Starts its verb instance; returns that instance's id (0 without a verb). It is enabled when `ready` came: see `device_state`."""

    def disable(self, device: str) -> None:
        """Ends the verbs that use it with `device_disabled`, then its own. Returns when done (under the virtual clock time advances)."""

    def exchange_verb(self, device: str, verb: str, place_json: str) -> None:
        """Replaces the verb that keeps it going by another one, within one firing where it is enabled; nothing changes where it refuses."""

    def delete_device(self, device: str) -> None: ...
    def device_state(self, device: str) -> str:
        """disabled, enabling, standstill, moving, stopping, fault."""

    def wait_enabled(self, device: str, timeout_ns: int | None) -> bool: ...
    def set_device_parameter(self, device: str, parameter: str, value_json: str) -> None: ...
    def device_parameter(self, device: str, parameter: str) -> str: ...

    # verb instances ----------------------------------------------------------------------------------------------------
    def check(self, application_json: str) -> str:
        """Plans an application without making anything. Returns the plan (JSON); Refused lists every error."""

    def create(self, application_json: str) -> int: ...
    def instance_json(self, instance: int) -> str:
        """{name, verb, state, blocks: [{label, block, source}], conditions: [..], lists: [..], list, remarks}."""

    def start(self, instance: int, values_json: str, options_json: str) -> None:
        """values: input parameter → value. options: {"time_limit_ns", "overruns", "age_max_ns"}."""

    def suspend(self, instance: int) -> None: ...
    def resume(self, instance: int) -> None: ...
    def halt(self, instance: int) -> None:
        """Returns when it has ended (a transition on `halted` may lie between; a second halt is immediate)."""

    def wait(self, instance: int, timeout_ns: int | None, slice_ns: int) -> str | None:
        """The end report of the latest start (JSON), or None when the timeout passed. Releases the interpreter; lets signals
        through (KeyboardInterrupt). `slice_ns` > 0: returns None after that much even without a timeout, so that the caller
        can show progress. Virtual clock: advances time. The timeout counts on the system's clock.
        Report: {instance, verb, condition, normal, command_list, block, time_s, started_s, value, message, outputs: {name: value}, others: [{condition, block, time_s}], start}."""

    def report(self, instance: int) -> str | None: ...
    def state(self, instance: int) -> str: ...
    def delete(self, instance: int) -> None: ...
    def set(self, instance: int, values_json: str, every_json: str) -> None:
        """Tunable input parameters of a running instance, and tunable intervals: label -> ns."""

    def ended_fd(self) -> int:
        """A descriptor that becomes readable whenever some instance has ended (monotonic clock), for event loops. Drain with os.read(fd, 8)."""

    # SVVs --------------------------------------------------------------------------------------------------------------
    def read(self, names: list[str]) -> tuple[int, list[tuple[bytes, int, int]]]:
        """One consistent snapshot: its time and for each SVV (bytes, number, time)."""

    def write(self, name: str, value_json: str) -> None: ...
    def history(self, name: str, count: int) -> list[tuple[int, int, bytes]]:
        """Up to `count` last values, oldest first: (number, time, bytes)."""

    def svv_json(self, name: str) -> str:
        """{name, type_text, types, type, unit, history, device, writers: [..]}."""

    # time and the whole system -----------------------------------------------------------------------------------------
    def now(self) -> int: ...
    def advance(self, duration_ns: int) -> None:
        """Virtual clock: runs the firings in (now, now + duration]."""

    def step(self) -> bool:
        """Virtual clock: runs the next firing, whenever that is; False if nothing is ever going to happen."""

    def emergency_stop(self, reason: str) -> None: ...
    def emergency_stop_input(self, device: str, channel: str, at_zero: bool) -> None: ...
    def reset(self) -> None: ...
    def pause(self, devices: list[str] | None) -> list[str]:
        """Pauses the actions on these logical devices, or all; the names of the instances that it suspended, when they are."""

    def resume_program(self, devices: list[str] | None) -> list[str]:
        """Takes a pause back; the names of the instances that go on or begin."""

    def mode(self) -> str: ...
    def set_mode(self, mode_json: str) -> None:
        """"automatic" or "manual"."""

    def enabling_switch(self, device: str, channel: str) -> None: ...
    def define_alarm(self, code: str, text_json: str) -> None:
        """{text, remedy, severity: low | medium | high | critical}."""

    def raise_alarm(self, code: str, source: str, text: str) -> None: ...
    def clear_alarm(self, code: str, source: str | None) -> bool: ...
    def acknowledge_alarms(self, number: int | None) -> int: ...
    def alarms_json(self) -> str:
        """{current: [alarm], history: [alarm], texts: {code: {text, remedy, severity}}}; an alarm: {number, code, source, block, text, remedy, severity, active, acknowledged, count, time_ns, wall_ns, returned_ns, acknowledged_ns}."""

    def restore_alarms(self, history_json: str) -> None:
        """[alarm]: the history of an earlier life."""

    def statistics_json(self) -> str:
        """{sources: {name: {firings, overruns, faults, jitter_*, duration_*, stopped, rights_missing, probed, blocks: [{instance, label, block, samples, last_ns, mean_ns, max_ns}]}}, instances: [..], devices: {..}, emergency: null | reason, paused: bool | [device], mode}."""

    def probe(self, source: str | None, for_ns: int) -> None:
        """The probe visits the blocks of a source, or of all, one a firing, for so long of real time (an hour at most): then
        `statistics_json` tells their times."""

    def verbs_json(self) -> str:
        """[{name, doc, class: "supports devices" | "acts on devices", supports: [device types], simple, lists, parts: {label: {verb, initial}}}]."""

    def names_json(self) -> str:
        """{processors, sources, devices, svvs, logical_devices, verbs, modules, instances}: what there is."""

    def configuration_json(self) -> str:
        """What there is, in full: {processors: {name: {core, supervisor}}, sources: {name: {processor, kind: "trigger" | "software" | {"timer": {period_ns}}, priority}},
        physical_devices: {name: {source, channels, parts, …}}, logical_devices: {name: device type}, device_types: {name: definition}}."""

    def installed_json(self) -> str:
        """Every instance as it is installed: {instances: [{id, name, verb, state, list, owner, starts, device, blocks, cells, lists,
        conditions, transitions, initial, ending}]}; docs/control.md has the form."""

    def verb_form_json(self, name: str) -> str:
        """What a form that starts a verb needs: {name, doc, arguments, inputs, defined}."""

    def geometry_json(self, device: str) -> str:
        """The bodies of a physical device for drawing: {bodies, meshes}. It loads the model once more."""

    def log_json(self, since: int) -> str:
        """Recorded commands, conditions, faults, transitions, ends: [{sequence, time_s, kind, about, text, who}]; `who` of commands."""


    def record(self, path: str, options_json: str) -> int:
        """Begins to record into a new file: {svvs: [names with * and ?], cells: bool}. The number of the recording."""

    def recording_json(self, number: int) -> str:
        """{path, running, counts: {channel: n}, lost: {channel: n}, bytes, failure}."""

    def stop_recording(self, number: int) -> str:
        """Ends it, as recording_json. Releases the interpreter; lets signals through."""

    def close(self) -> None:
        """Halts the actions, disables the devices, stops the kernels. Safe to call twice."""


class Recording:
    """A recording in memory."""

    def series_json(self) -> str:
        """{name: {kind, type, type_text, unit, count}}."""

    def series(self, name: str) -> tuple[bytes, bytes, bytes]:
        """Numbers (u64), times in ns (i64) and values of one of them."""

    def records_json(self, topic: str) -> str:
        """[[time in ns, message]] of another channel."""

    def topics(self) -> list[str]:
        """Names of the other channels."""

    def about_json(self) -> str:
        """{complete, metadata: {name: {..}}, lost: {channel: n}}."""

def open_recording(path: str) -> Recording: ...
