# SPDX-License-Identifier: Apache-2.0
"""The command `opengpac`: run, check, stubs, build, new block, blocks, drivers, devices, robots, rts, token, studio, join, docs, doctor,
top, record, plot, replay."""

from __future__ import annotations

import argparse
import functools
import importlib
import os
import re
import select
import signal
import sys
import traceback
from collections.abc import Callable, Sequence, Sized
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import _native
from ..errors import Error, InstallationErrors, refusals, several
from ..refusals import tracebacks
from ..refusals.source_location import Place, here
from ..system import programs

if TYPE_CHECKING:
    from ..checking import Findings

_TEMPLATE = """// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

FUNCTION_BLOCK({name}, "Gain: y = k u.",
    in   (double, u,      "input"),
    out  (double, y,      "k times the input"),
    param(double, k, 1.0, "factor"))
{{
    self->y = self->k * self->u;
    return OK;
}}
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command; returns 0 on success, 1 after a refusal or a failure."""
    words = sys.argv[1:] if arguments is None else list(arguments)
    given = _parser(words[0] if words else "").parse_args(words)
    called = here()
    try:
        done = given.run(given)
        sys.stdout.flush()
        return done
    except BrokenPipeError:
        if not _is_cut():
            raise
        # The reader has closed the pipe: `opengpac blocks | head`.
        return 128 + signal.SIGPIPE
    except Error as error:
        if tracebacks.is_full():
            traceback.print_exception(error)
        print(f"{type(error).__name__}: {_about(error, given, called)}", file=sys.stderr)
    except FileNotFoundError as error:
        print(f"file '{error.filename}' does not exist", file=sys.stderr)
    return 1


def _is_cut() -> bool:
    """Returns whether the reader has closed standard output; if so, discards all further output."""
    poll = select.poll()
    poll.register(sys.stdout.fileno(), select.POLLOUT)
    cut = any(event & select.POLLERR for _, event in poll.poll(0))
    if cut:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return cut


def _about(error: Error, given: argparse.Namespace, called: Place) -> str:
    """Formats a command's error with a location in one of the user's files, never in `opengpac` itself."""
    for inner in getattr(error, "errors", [error]):
        if inner.place is not None and (inner.place.file == called.file or inner.place.file.startswith("<frozen")):
            inner.place = None
    text = str(several(error.errors) if isinstance(error, InstallationErrors) else error)
    asked = next((getattr(given, name) for name in ("program", "recording", "record", "files") if getattr(given, name, None)), None)
    file = asked[0] if isinstance(asked, list) else asked
    return f"{text} at {file}" if file and error.place is None and str(file) not in text else text


def _parser(command: str = "") -> argparse.ArgumentParser:
    """Returns the parser of a command, and of those in the same module; of all commands if there is no such command."""
    parser = argparse.ArgumentParser(prog="opengpac", description="OpenGPAC, a general purpose automation controller")
    parser.add_argument("--version", action="version", version=f"opengpac {_native.version()}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    is_known = any(command in names for names in _COMMANDS)
    for names, add_to in _COMMANDS.items():
        if command in names or not is_known:
            add_to(commands)
    return parser


def _add_of_programs(commands: Any) -> None:
    run = commands.add_parser("run", help="run a program")
    programs.add_to(run)
    run.set_defaults(run=_run)
    check = commands.add_parser("check", help="check a program or a file of definitions as for installation, without running it")
    check.add_argument("-v", "--verbose", action="store_true", help="also list inferred values and delays")
    programs.add_to(check)
    check.set_defaults(run=_check)
    stubs = commands.add_parser("stubs", help="write PROGRAM.pyi for editors and pyright: types of verbs that are made from dictionaries")
    stubs.add_argument("program")
    stubs.add_argument("-o", "--output", help="path of the stub (default: beside the program)")
    stubs.set_defaults(run=_stubs)
    build = commands.add_parser("build", help="compile C or C++ files into a code module")
    build.add_argument("files", nargs="+")
    build.add_argument("-o", "--output", help="path of the module (default: beside the first file)")
    build.set_defaults(run=_build)
    export = commands.add_parser("export", help="write a graph for another tool").add_subparsers(required=True, metavar="WHAT")
    unit = export.add_parser("fmu", help="export a graph of a file of definitions as an FMU (FMI 2, co-simulation)")
    unit.add_argument("graph", help="FILE.toml, or FILE.toml:NAME if the file has several graphs")
    unit.add_argument("--every", required=True, help='interval at which the graph runs: "1 ms"')
    unit.add_argument("-o", "--output", help="path of the FMU (default: NAME.fmu)")
    unit.add_argument("--library", help="path of libopengpac_ps.so, built by make c-package")
    unit.set_defaults(run=_export_fmu)
    new = commands.add_parser("new", help="create a file from a template").add_subparsers(required=True, metavar="WHAT")
    block = new.add_parser("block", help="create a function block in C")
    block.add_argument("name")
    block.set_defaults(run=_new_block)
    machine = new.add_parser("driver", help="create a driver of a machine")
    machine.add_argument("name")
    machine.add_argument("--in", dest="language", choices=["c", "python", "rust"], default="c", help="language of the driver (default: c)")
    machine.set_defaults(run=_new_driver)


def _add_blocks(commands: Any) -> None:
    blocks = commands.add_parser("blocks", help="list, search or show blocks and other components")
    blocks.add_argument("action", nargs="?", choices=["list", "search", "show"], default="list")
    blocks.add_argument("words", nargs="*", metavar="WORD")
    blocks.set_defaults(run=_blocks)


def _add_of(module: str, commands: Any) -> None:
    importlib.import_module(module, __name__).add_to(commands)


_COMMANDS: dict[tuple[str, ...], Callable[[Any], None]] = {
    ("run", "check", "stubs", "build", "export", "new"): _add_of_programs,
    ("driver",): functools.partial(_add_of, "..drivers.conformance"),
    ("blocks",): _add_blocks,
    ("drivers", "devices"): functools.partial(_add_of, ".drivers"),
    ("robots",): functools.partial(_add_of, ".robots"),
    ("rts", "token"): functools.partial(_add_of, ".daemon"),
    ("studio",): functools.partial(_add_of, "..studio.server"),
    ("join",): functools.partial(_add_of, "..system.hosts"),
    ("docs",): functools.partial(_add_of, ".docs"),
    ("doctor",): functools.partial(_add_of, "..doctor"),
    ("top",): functools.partial(_add_of, "..top"),
    ("record", "plot"): functools.partial(_add_of, ".plots"),
    ("replay",): functools.partial(_add_of, "..recordings.replay"),
}
"""Functions that add commands to the parser, by the commands' names. Each imports its module when it is called: importing all of them
takes two thirds of the start-up time."""


def _run(given: argparse.Namespace) -> int:
    programs.run(given)
    return 0


def _check(given: argparse.Namespace) -> int:
    if Path(given.program).suffix in (".toml", ".json"):
        return _check_file(given.program)
    from ..checking import check
    from ..refusals.carets import shown

    programs.beside(given.program)
    findings = check(given.program, given.arguments)
    if given.verbose:
        for remark in findings.remarks:
            print(remark)
    # Two uses of one wrong name count as one mistake if both are shown at the same place.
    errors = list(dict.fromkeys([*_broken(findings, True), *(shown(error) for error in findings.errors)]))
    print("\n".join(errors), file=sys.stderr, end="\n" if errors else "")
    for text in dict.fromkeys(_broken(findings, False)):
        print(f"{text}\n  help: run the program to see whether it fails there: a check uses 0 for values that are known only at run time")
    print(f"{_count(findings.planned, 'verb application')} planned, {_count(errors, 'error')}")
    if findings.broken:
        print(f"check incomplete: {_left_out(findings)} and dependent statements were skipped")
    return 1 if errors or findings.broken else 0


def _broken(findings: Findings, certain: bool) -> list[str]:
    """Returns the messages of ordinary Python exceptions: if `certain`, those that a run would raise too, otherwise the rest."""
    from ..refusals.carets import shown

    return [shown(error, error.kind) for error in findings.broken if error.certain == certain]


def _left_out(findings: Findings) -> str:
    """Returns the lines that were not executed."""
    return " and ".join(dict.fromkeys(error.left_out() for error in findings.broken))


def _stubs(given: argparse.Namespace) -> int:
    from ..checking import check
    from ..refusals.carets import shown
    from ..storage import files
    from .stubs import stub

    program = Path(given.program)
    programs.beside(given.program)
    findings = check(given.program, [])
    for text in [*_broken(findings, True), *_broken(findings, False), *(shown(error) for error in findings.errors)]:
        print(text, file=sys.stderr)
    output = Path(given.output) if given.output else program.with_suffix(".pyi")
    files.write(output, stub(program, findings.names), "the stub")
    if findings.broken:
        print(f"check incomplete: {_left_out(findings)} and dependent statements were skipped")
    print(output)
    return 1 if findings.errors or findings.broken else 0


def _check_file(path: str) -> int:
    """Performs every check of a definition file that needs no hardware. Builds and loads the code modules that it names."""
    from ..definition.files.reading import read_file
    from ..refusals.carets import shown
    from ..system.system import System

    with System("check", clock="virtual") as cell:
        made, errors = read_file(path, system=cell, stand_in=True)
    texts = list(dict.fromkeys(shown(error) for error in errors))
    print("\n".join(texts), file=sys.stderr, end="\n" if texts else "")
    print(f"{_count(made, 'definition')} checked, {_count(texts, 'error')}")
    return 1 if texts else 0


def _count(things: Sized, word: str) -> str:
    return f"{len(things)} {word}{'' if len(things) == 1 else 's'}"


def _export_fmu(given: argparse.Namespace) -> int:
    from ..fmi.export import export_of_file

    print(export_of_file(given.graph, given.every, given.output, given.library))
    return 0


def _build(given: argparse.Namespace) -> int:
    missing = next((file for file in given.files if not Path(file).exists()), None)
    if missing is not None:
        raise FileNotFoundError(2, "no such file", missing)
    with refusals:
        print(_native.build([str(Path(file).absolute()) for file in given.files], given.output))
    return 0


def _new_block(given: argparse.Namespace) -> int:
    file = _begun(given.name, "a block", _TEMPLATE)
    if file is not None:
        print(f"{file}: edit it, then cell.download('{file}') in a program, or opengpac build {file}")
    return 0 if file else 1


def _new_driver(given: argparse.Namespace) -> int:
    if given.language == "rust":
        return _new_crate(given.name)
    if given.language == "python":
        return _new_driver_in_python(given.name)
    from ..drivers import beginning

    file = _begun(given.name, "a driver", beginning.C)
    if file is not None:
        print(f"{file}: edit it, then opengpac driver check {file}, and gpac.drivers.load('{file}') in a program")
    return 0 if file else 1


def _new_driver_in_python(name: str) -> int:
    from ..drivers import beginning

    file = _free(name, "a driver", Path(f"{name}.py"))
    if file is None:
        return 1
    file.write_text(beginning.PYTHON.format(name=name, Name="".join(word.capitalize() for word in name.split("_"))))
    print(f"{file}: edit it, then opengpac driver check {file}, and gpac.drivers.python('{file}') in a program")
    return 0


def _new_crate(name: str) -> int:
    from ..drivers import beginning

    folder = _free(name, "a driver", Path(name))
    if folder is None:
        return 1
    for file, text in beginning.crate(name).items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_text(text)
    library = folder / "target" / "release" / f"lib{name}.so"
    print(f"{folder}/src/lib.rs: edit it, cargo build --release in {folder}, then opengpac driver check {library}, and load it")
    return 0


def _begun(name: str, what: str, text: str) -> Path | None:
    """Creates the C file of a new block or driver. If the name is refused, prints the reason and returns None."""
    file = _free(name, what, Path(f"{name}.c"))
    if file is not None:
        file.write_text(text.format(name=name))
    return file


def _free(name: str, what: str, path: Path) -> Path | None:
    """Returns the path if the name is valid and the file does not exist yet. Otherwise prints the reason and returns None."""
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        print(f"'{name}' is not a valid name for {what}; use lower-case letters, digits and _", file=sys.stderr)
        return None
    if path.exists():
        print(f"file '{path}' already exists; choose another name", file=sys.stderr)
        return None
    return path


def _blocks(given: argparse.Namespace) -> int:
    from .. import library

    if given.action == "show":
        if not given.words:
            print("name a block: opengpac blocks show pid", file=sys.stderr)
            return 1
        for name in given.words:
            print(library.show(name))
        return 0
    found = library.search(*given.words) if given.action == "search" else library.list()
    category = None
    for component in found:
        if given.action == "list" and component.category != category:
            category = component.category
            print(f"{category}:")
        indent = "  " if given.action == "list" else ""
        print(f"{indent}{component.name:<{24 - len(indent)}} {component.kind:<11} {component.title}")
    for problem in library.problems():
        print(f"not loaded: {problem}", file=sys.stderr)
    if not found:
        print(f"no block matches {' and '.join(given.words)}; list all blocks with opengpac blocks", file=sys.stderr)
    return 0 if found else 1
