# SPDX-License-Identifier: Apache-2.0
"""The command `opengpac export fmu GRAPH`: exports a graph as an FMI 2 FMU for co-simulation. The FMU contains the real-time system and
its virtual clock, so it computes the same values, and its host needs neither Python nor OpenGPAC."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import shutil
import subprocess
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from .. import __version__, _native
from ..definition.blocks import Block, Item
from ..definition.commands import activate
from ..definition.files.reading import load
from ..definition.graphs import Graph
from ..definition.verbs import Verb
from ..errors import CallError, FileFailed, UnknownName, did_you_mean, refusals, refuse
from ..python.items import WIDTHS
from ..values.quantities import Quantity, duration_ns

CORE = Path(__file__).with_name("exported.h")
_FMI = {"double": "Real", "float": "Real", "bool": "Boolean", "int8_t": "Integer", "int16_t": "Integer", "int32_t": "Integer"} | {
    "uint8_t": "Integer", "uint16_t": "Integer",
}  # fmt: skip


@dataclass(frozen=True)
class Member:
    """An input, output or parameter of the graph: its `role` (i, o or p), element type, number of elements (0: a scalar) and start
    values."""

    name: str
    role: str
    element: str
    size: int
    start: list[float]
    unit: str
    doc: str

    @property
    def key(self) -> str:
        """Name of the member in the verb that runs the graph."""
        return self.name.replace(".", "_")


def export_fmu(graph: Graph, path: str | os.PathLike[str], every: Quantity, *, library: str | os.PathLike[str] | None = None) -> Path:
    """Writes `graph` as an FMU to `path`; it runs at the interval `every`. Returns the path.

    `library` is the path of libopengpac_ps.so, which `make c-package` builds; by default the one in this tree.
    """
    target = Path(path).absolute()
    period_ns = duration_ns(every, "the interval of the graph")
    members = _members(graph)
    needed = _library(library)
    name = "".join(c if c.isalnum() and c.isascii() else "_" for c in graph.name)
    verb = _verb(graph, name, members, period_ns)
    modules = _modules(graph)
    token = hashlib.sha256(
        json.dumps([__version__, verb._text, period_ns, [file.read_bytes().hex() for file in modules.values()]]).encode()
    )
    text = _code(name, "{" + token.hexdigest()[:32] + "}", verb, modules, members, period_ns)
    folder = f"binaries/{'linux64' if platform.machine() == 'x86_64' else platform.machine() + '-linux'}"
    with tempfile.TemporaryDirectory() as temporary, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        source, binary, system = (Path(temporary) / part for part in (f"{name}.c", f"{name}.so", "libopengpac_ps.so"))
        source.write_text(text)
        shutil.copy(needed, system)
        _tool(["strip", "--strip-debug", str(system)])
        # A system has threads and signal handlers: its library must stay loaded after a master unloads the FMU.
        flags = ["-O2", "-shared", "-fPIC", "-fvisibility=hidden", f"-L{temporary}", "-Wl,-rpath,$ORIGIN", "-Wl,-z,nodelete"]
        _tool([os.environ.get("CC") or "cc", *flags, str(source), "-o", str(binary), "-lopengpac_ps", "-lm"])
        archive.writestr("modelDescription.xml", _description(graph, name, "{" + token.hexdigest()[:32] + "}", members, period_ns))
        archive.write(source, f"sources/{name}.c")
        archive.write(binary, f"{folder}/{name}.so")
        archive.write(system, f"{folder}/libopengpac_ps.so")
        for module, file in modules.items():
            built = file if file.suffix == ".so" else Path(temporary) / f"{module}.module.so"
            if built != file:
                with refusals:
                    _native.build([str(file)], str(built))
            archive.write(built, f"resources/{module}.so")
        archive.writestr("resources/verb.json", verb._text)
    return target


def _modules(graph: Graph) -> dict[str, Path]:
    """Returns the code modules of the graph's blocks, excluding the standard library: name → file."""
    found: dict[str, Path] = {}
    for use in graph.blocks.values():
        if isinstance(use.block, Graph):
            found |= _modules(use.block)
        elif isinstance(use.block, Block) and use.block.module != "library":
            file = Path(use.block.module)
            if file.suffix == ".onnx":
                text = f"'{use.block.name}' is a policy, which is compiled when it is loaded"
                refuse(CallError, text, "leave the policy out: an FMU must run without a compiler")
            found[use.block.name.split(".", 1)[0]] = file
    return found


def _library(given: str | os.PathLike[str] | None) -> Path:
    root = Path(__file__).parents[3] / "target"
    tried = (
        [Path(given)] if given is not None else [root / profile / "libopengpac_ps.so" for profile in ("release", "checked", "checked/deps")]
    )
    for file in tried:
        if file.is_file():
            return file
    refuse(FileFailed, f"{tried[0]}, the real-time system for FMUs, does not exist", "build it with make c-package, or pass its path")


def _tool(command: list[str]) -> None:
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        refuse(FileFailed, f"'{command[0]}', which builds the binary of the FMU, is not installed", "install a C compiler and binutils")
    if done.returncode:
        refuse(
            FileFailed, f"{command[0]} rejects the FMU: {done.stderr.strip().splitlines()[-1] if done.stderr.strip() else done.returncode}"
        )


def _members(graph: Graph) -> list[Member]:
    ports = [(n, "i", p.item) for n, p in graph.inputs.items()] + [(n, "o", p.item) for n, p in graph.outputs.items()]
    # The FMU has no parameters for those of the graph's own blocks that have a constant, for those of deeper blocks, or for types that
    # FMI 2 lacks.
    free = [(n, "p", i) for n, i in graph.parameters.items() if n.count(".") == 1 and not _constant(graph, n) and _fits(i)]
    made = [_member(graph, name, role, item) for name, role, item in [*ports, *free]]
    if not any(member.role == "o" for member in made):
        refuse(CallError, f"graph '{graph.name}' has no output, so its FMU would be useless", "add outputs")
    return made


def _constant(graph: Graph, name: str) -> bool:
    label, _, parameter = name.partition(".")
    return parameter in graph.blocks[label].constants


def _fits(item: Item) -> bool:
    element, _, length = item.type.partition("[")
    return element in _FMI and (not length or length.rstrip("]").isdigit())


def _member(graph: Graph, name: str, role: str, item: Item) -> Member:
    if not _fits(item):
        text = f"'{name}' of graph '{graph.name}' has type {item.type}, which FMI 2 does not support"
        refuse(CallError, text, "use numbers of at most 32 bits, a boolean, or a list of them")
    element, _, length = item.type.rstrip("]").partition("[")
    size = int(length or 0)
    start = np.frombuffer(item.initial, WIDTHS[element].rstrip("_")) if role == "p" and item.initial else np.zeros(max(1, size))
    unit = "" if item.unit.startswith("=") or "|" in item.unit else item.unit
    return Member(name, role, element, size, [float(x) for x in start], unit, item.doc)


def _verb(graph: Graph, name: str, members: list[Member], period_ns: int) -> Verb[..., Any]:
    """Returns the verb that runs the graph; its inputs take the latest values."""
    return Verb(
        name,
        blocks={"graph": graph},
        instantiation_parameters={m.name: f"graph.{m.name}" for m in members if m.role != "p"},
        input_parameters={m.key: f"graph.{m.name}" for m in members if m.role == "p"},
        modes={f"graph.{m.name}": "asynchronous" for m in members if m.role == "i"},
        command_lists={"start": [activate("graph", every=period_ns * 1e-9)]},
    )


def _code(name: str, token: str, verb: Verb[..., Any], modules: dict[str, Path], members: list[Member], period_ns: int) -> str:
    source = {"processor": "rtp0", "name": "main", "kind": "timer", "period_ns": period_ns, "priority": 50}
    calls: list[tuple[str, Any]] = [("processor", {"name": "rtp0"}), ("source", source)]
    calls += [("download", {"path": f"$RESOURCES/{module}.so", "name": module}) for module in modules]
    for m in (m for m in members if m.role != "p"):
        calls.append(("svv", {"name": m.name, "type_text": m.element + (f"[{m.size}]" if m.size else ""), "unit": m.unit}))
    calls.append(("define_verb", json.loads(verb._text)))
    bound = {m.name: {"svv": m.name} for m in members if m.role != "p"}
    create = {"verb": name, "placement": {"*": "rtp0.main"}, "arguments": bound}
    firsts = np.cumsum([0, *(max(1, m.size) for m in members)]).tolist()
    variables = [f"{{{_c(m.key)}, {m.role!r}, {m.size}, {firsts[k]}}}" for k, m in enumerate(members)]
    values = [
        f"{{{k}, '{'b' if m.element == 'bool' else 'd' if m.element in ('double', 'float') else 'i'}', {start!r}}}"
        for k, m in enumerate(members)
        for start in m.start
    ]
    lines = [
        "// SPDX-License-Identifier: Apache-2.0",
        "#define _GNU_SOURCE",
        f"#define FMU_NAME {_c(name)}",
        f"#define FMU_TOKEN {_c(token)}",
        f"static const char *const FMU_SETUP[] = {{{', '.join(f'{_c(call)}, {_c(json.dumps(given))}' for call, given in calls)}, 0}};",
        f"static const char FMU_CREATE[] = {_c(json.dumps(create))};",
        f"static const char FMU_READ[] = {_c(json.dumps({'names': [m.name for m in members if m.role == 'o']}))};",
        "typedef struct { const char *name; char role; int size, first; } variable;",
        "typedef struct { int svv; char kind; double start; } value;",
        f"static const variable fmu_svvs[] = {{{', '.join(variables)}}};",
        f"static const value fmu_values[] = {{{', '.join(values)}}};",
        CORE.read_text(),
    ]
    return "\n".join(lines)


def _c(text: str) -> str:
    return json.dumps(text).replace("??", "?\\?")


def _description(graph: Graph, name: str, token: str, members: list[Member], period_ns: int) -> str:
    """Returns the contents of modelDescription.xml."""
    variables, outputs, number = [], [], 0
    for m in members:
        for k in range(max(1, m.size)):
            causality = {"i": "input", "o": "output", "p": "parameter"}[m.role]
            kind = _FMI[m.element]
            variability = "fixed" if m.role == "p" else "discrete"
            unit = f" unit={quoteattr(m.unit)}" if m.unit and kind == "Real" else ""
            first = {"Real": repr(m.start[k]), "Integer": str(int(m.start[k])), "Boolean": "true" if m.start[k] else "false"}[kind]
            start = "" if m.role == "o" else f' start="{first}"'
            initial = {"i": "", "o": ' initial="calculated"', "p": ' initial="exact"'}[m.role]
            label = m.name if not m.size else f"{m.name}[{k + 1}]"
            variables.append(
                f'    <ScalarVariable name={quoteattr(label)} valueReference="{number}" causality="{causality}" variability="{variability}"'
                f"{initial} description={quoteattr(m.doc)}><{kind}{unit}{start}/></ScalarVariable>"
            )
            number += 1
            if m.role == "o":
                outputs.append(number)
    units = sorted({m.unit for m in members if m.unit and _FMI[m.element] == "Real"})
    defined = ["  <UnitDefinitions>", *(f"    <Unit name={quoteattr(unit)}/>" for unit in units), "  </UnitDefinitions>"] if units else []
    unknown = "".join(f'<Unknown index="{index}"/>' for index in outputs)
    return "\n".join(
        [
            '<?xml version="1.0" encoding="UTF-8"?>',
            f'<fmiModelDescription fmiVersion="2.0" modelName={quoteattr(graph.name)} guid="{token}"'
            f" description={quoteattr(graph.doc or graph.name)}"
            f' generationTool="OpenGPAC {__version__}" variableNamingConvention="structured" numberOfEventIndicators="0">',
            f'  <CoSimulation modelIdentifier="{name}" canHandleVariableCommunicationStepSize="true"/>',
            *defined,
            f'  <DefaultExperiment startTime="0" stepSize="{period_ns * 1e-9!r}"/>',
            "  <ModelVariables>",
            *variables,
            "  </ModelVariables>",
            f"  <ModelStructure><Outputs>{unknown}</Outputs><InitialUnknowns>{unknown}</InitialUnknowns></ModelStructure>",
            "</fmiModelDescription>",
        ]
    )


def export_of_file(asked: str, every: str, output: str | None, library: str | None) -> Path:
    """Exports a graph from a definition file, for `opengpac export fmu`: `FILE.toml:NAME`, or the only graph in the file."""
    file, _, name = asked.partition(":")
    defined = load(file)
    graphs = {label: made for label, made in defined.items() if isinstance(made, Graph)}
    if name and name not in graphs:
        refuse(UnknownName, f"'{file}' has no graph '{name}'", did_you_mean(name, graphs))
    if not name and len(graphs) != 1:
        refuse(CallError, f"'{file}' has {len(graphs)} graphs: {', '.join(graphs)}", f"name one: {file}:NAME")
    graph = graphs[name or next(iter(graphs))]
    return export_fmu(graph, output or f"{graph.name}.fmu", every, library=library)
