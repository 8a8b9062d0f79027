# SPDX-License-Identifier: Apache-2.0
"""The compiled real-time core, seen from Python: conversions only. Everything public is in `opengpac` itself.

Text arguments that end in `_json` have the JSON forms of the Rust model (`definition.rs`, `configuration.rs`); what a call
refuses comes as `Refused`, whose `args[0]` is the JSON of a list of refusals (`class`, `message`, `ends`, `remedy`, `place`).
Times are ns, int. Names of sources are `rtp.source`.
"""

from collections.abc import Callable, Sequence
from typing import Self

class Refused(Exception):
    """One or more refusals, their JSON in `args[0]`; nothing has changed."""

def version() -> str: ...
def library_json() -> str:
    """The blocks of the standard library: list of interfaces (each with `name` = `library.block`, `doc`, `items`, `types`)."""

def header_text() -> str:
    """The text of `opengpac.h`."""

def driver_header_text() -> str:
    """The text of `opengpac_driver.h`."""

def load_drivers(file: str) -> str:
    """The drivers in a shared object as JSON: {"drivers": [{"name", "doc", "options": [{"name", "kind", "unit", "default", "doc"}]}]}, or {"problem"}."""

def check_driver(kind: str, options_json: str) -> str | None:
    """Checks options against the declaration of a driver; what is wrong with them, None where nothing is."""

def check_conformance(
    kind: str, options_json: str, command: list[str], exchanges: int, counting: str | None, sanitizer: str | None, told: Callable[[str, str], bool]
) -> str:
    """Checks a driver: {"driver", "passed", "checks": [{"check", "sentence", "verdict", "why"}], "text"}. `command` is a process that
    calls `run_driver_check`, `counting` a shared object of `counting_text()`. `told(check, verdict)` hears each outcome as it comes, and
    ends the checks by returning False."""

def sanitizer_in(folder: str) -> str | None:
    """The real-time sanitizer for that process, made in a folder from that of Rust or clang; None: no compiler here has it."""

def counting_text() -> str:
    """The source in C of what counts allocations in the process that a driver is checked in."""

def run_driver_check() -> str | None:
    """A process that a driver is checked in; returns why it could not."""

def run_driver_trial() -> str | None:
    """A process that loads the file of drivers that its command line ends with; returns what is wrong with it."""

def build(sources: list[str], output: str | None) -> str:
    """Compiles C or C++ sources into a code module; returns its path. Refused (ModuleError) shows the first error."""

def replay(path: str, asked_json: str) -> str:
    """Runs a record again: what is asked for and what is found as JSON. Refused (CallError) is what cannot be read, or is not trusted."""

def replay_modules(path: str) -> str:
    """The code modules that a record brings, as JSON: name, len, sha256. Nothing of them runs."""

def trial(module: str, block: str, values_json: str, inputs_json: str, times: int, period_ns: int, is_interpreted: bool) -> str:
    """Runs a block with no system, an invocation every `period_ns`: `values` constants, `inputs` name → list of values (one an invocation) or one constant.

    Returns JSON: name → list of values of each output; `conditions`: list of [invocation, name, value]; `fault` or null.
    `module` is "library" or the path of a loaded module.
    """

def type_json(type_text: str, types_json: str) -> str:
    """Normalised type as a tree: {"scalar": "double"} | {"array": [tree, n]} | {"struct": [[name, tree, offset], …], "size": n}, with "text", "size", "align"."""

def long_form(kind: str, definition_json: str) -> str:
    """A definition (JSON) of kind "graph", "verb" or "device_type" with its short forms written out, as `define_verb` keeps it."""

def duration_ns(text: str, what: str) -> int:
    """Whole nanoseconds of `"20 ms"`, or of the period of `"1 kHz"`; `what` names it in a message."""

def check_name(what: str, name: str) -> None:
    """Refuses a text that is no name: empty or blank, longer than 256 characters, or with characters that cannot be shown; `what` it names."""

def did_you_mean(word: str, candidates: list[str]) -> str:
    """`did you mean 'x'?` with the candidate that is near, else what there is (at most eight), else nothing."""

def nearest(word: str, candidates: list[str]) -> str | None:
    """The candidate that `word` most likely meant, if one is near."""

def source_endings() -> list[str]:
    """The endings of files that are built where they are loaded, without the dot: `c`, `cpp`."""

def pose_of(numbers: Sequence[float]) -> list[float] | None:
    """Seven numbers (x y z in m, quaternion w x y z) with a quaternion exactly of length 1; None where its length is not near 1."""

def pose_of_rpy(position: Sequence[float], rpy: Sequence[float]) -> list[float]:
    """The seven numbers of a position and roll, pitch and yaw, rad."""

def pose_rpy(pose: Sequence[float]) -> list[float]:
    """Roll, pitch and yaw, rad, of seven numbers that `pose_of` or `pose_of_rpy` gave; so with the poses of the calls below."""

def pose_then(outer: Sequence[float], inner: Sequence[float]) -> list[float]:
    """What is `inner` in the frame `outer`, seen from where that is seen from."""

def pose_point(frame: Sequence[float], point: Sequence[float]) -> list[float]:
    """A point of a frame, m, seen from where the frame is seen from."""

def pose_inverse(pose: Sequence[float]) -> list[float]:
    """What a frame is seen from, seen from it."""

def pose_between(a: Sequence[float], b: Sequence[float]) -> tuple[float, float]:
    """The distance, m, and the angle, rad, 0 to pi."""

def is_word_of_c(name: str) -> bool:
    """True where a name in C code that is made of a definition would mean something else: a keyword, a macro, a word of a declaration."""

def whole_network(content: bytes, path: str) -> bytes | None:
    """The file of a network with the weights inside that lie in files beside `path`; None where it has them already. Refused: ModuleError."""

def check_range(what: str, declared: str, number: float) -> None:
    """Refuses a number outside the range behind a unit, `"kg [0, 1000]"`. `what` it is, for the refusal."""

def check_angle(what: str, angle: float) -> None:
    """Refuses an angle of an orientation, in rad, of more than one turn: degrees were probably meant."""

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

def run_replay() -> str | None:
    """A process that runs a recording again for a system: returns when it is over. `processes.command("run_replay")` starts it."""

def run_ethercat_segment() -> str | None:
    """An emulated segment of EtherCAT: returns when its input ends, or with the reason why it could not answer.
    `processes.command("run_ethercat_segment")` starts it; `gpac.drivers.fake.ethercat` talks to it."""

def run_canopen_bus() -> str | None:
    """An emulated bus of CANopen: returns when its input ends, or with the reason why it could not answer.
    `processes.command("run_canopen_bus")` starts it; `gpac.drivers.fake.canopen` talks to it."""

def try_driver(kind: str, options_json: str) -> str | None:
    """Tries the files that the options of a driver name, in a process of its own; what is wrong with them, None where nothing is."""

def drivers_json() -> str:
    """What each driver declares, a JSON list by name."""

def scan(kind: str, options_json: str) -> str:
    """Devices that a driver finds, a JSON list of {"what", "options"}; nothing moves."""

def plant_state(name: str) -> str | None:
    """How the plant process of that name is, for who watches it; None where there is none.

    {"is_safe", "obeyed_ns": monotonic, "steps", "failed": text or null, "readings": bytes, "pid"}.
    """

def serve(
    system: System,
    options_json: str,
    tell: Callable[[str], object],
    ready: Callable[[list[str], str | None], object],
    rereads: Callable[[], bool],
) -> None:
    """Serves a system over the control interface until a signal's exception comes; `tell` hears what its journal comes to, line by
    line, then `ready` gets the addresses, and where the studio's page is. Where `rereads` says true, the audit file is opened again and
    the files of tokens and TLS are read again, which `tell` hears of.

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
        """Stops answering. Idempotent."""

class System:
    """A real-time system embedded in this process. `calls.py` has its calls as methods: `realtime.Embedded`.

    options: {"seed": n, "interconnect": {"kind": "memory" | "message", …}, "processes": {…}, "adopt": bool}.
    """

    def __new__(cls, name: str, clock: str, options_json: str) -> Self: ...
    def call(self, name: str, arguments_json: str = "", /) -> str:
        """Makes a call, to its end; returns the JSON text of its answer. Releases the interpreter; lets signals through
        (KeyboardInterrupt). Virtual clock: waits advance time. What commands is entered into the log."""

    def begin(self, name: str, arguments_json: str, slice_ns: int, /) -> str | None:
        """As `call`, for this much real time; None where it is not over then. For calls that may be made again."""

    def performing(self, arguments_json: str, made: list[int], slice_ns: int, /) -> str | None:
        """The call `perform` for this long: the end report; None where the verb goes on, whose instance is in `made` then."""

    def ended_fd(self) -> int:
        """A descriptor that becomes readable whenever some instance has ended (monotonic clock), for event loops. Drain with os.read(fd, 8)."""

    def read(self, names: list[str], /) -> tuple[int, list[tuple[bytes, int, int]]]:
        """One consistent snapshot: its time and for each SVV (bytes, number, time)."""

    def turn(self, stores: list[tuple[str, list[float]]], duration_ns: int, names: list[str], /) -> bytes:
        """Virtual clock: stores numbers, runs what is due within the duration, and reads: the bytes of all SVVs, one after the other."""

    def history(self, name: str, count: int, /) -> list[tuple[int, int, bytes]]:
        """Up to `count` last values, oldest first: (number, time, bytes)."""

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
