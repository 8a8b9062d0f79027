# SPDX-License-Identifier: Apache-2.0
"""C code of an FMU's block. It sets and gets values in groups of one type, with one FMU call per group."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from ..python.items import Item
from ..python.shim import declared, quoted
from .description import Description, Variable

CORE = Path(__file__).with_name("fmu.h")


@dataclass(frozen=True)
class Port:
    """A variable and the block's item for it."""

    variable: Variable
    item: Item

    @property
    def count(self) -> int:
        """Number of elements."""
        return max(1, self.variable.size)


@dataclass(frozen=True)
class Ports:
    """Ports of a block."""

    inputs: list[Port]
    outputs: list[Port]
    fixed: list[Port]
    tunable: list[Port]


def source(
    name: str, doc: str, fmu: Description, ports: Ports, library: Path, embedded: bool, resources: str, step_ns: int, instances: int
) -> str:
    """Returns the text of a C file with one block. `library` is the FMU's binary, either `embedded` in the file or loaded from its
    location."""
    image = "\n".join(
        [
            ".pushsection .rodata", ".balign 16", ".globl fmu_image", ".hidden fmu_image", "fmu_image:", f'.incbin "{library}"',
            ".globl fmu_image_end", ".hidden fmu_image_end", "fmu_image_end:", ".byte 0", ".popsection",
        ]
    )  # fmt: skip
    listed = [*ports.inputs, *ports.outputs, *ports.fixed, *ports.tunable]
    items = ", ".join([*(declared(port.item) for port in listed), *_STATES])
    every = [*ports.inputs, *ports.fixed, *ports.tunable]
    lines = [
        "#define _GNU_SOURCE",
        "#include <opengpac.h>",
        *(["#define FMU_EMBEDDED", f"__asm__({quoted(image + chr(10))});"] if embedded else [f"#define FMU_PATH {quoted(str(library))}"]),
        f"#define FMU_VERSION {fmu.version}",
        f"#define FMU_NAME {quoted(name)}",
        f"#define FMU_TOKEN {quoted(fmu.token)}",
        # Without resources FMI 3 gets an empty text: FMUs of `fmi-export` read it unconditionally.
        f"#define FMU_RESOURCES {quoted(resources) if resources or fmu.version == 3 else 'NULL'}",
        f"#define FMU_INSTANCES {instances}",
        f"#define FMU_STEP_NS {step_ns}LL",
        CORE.read_text(),
        *_functions(fmu.version, every, ports.outputs),
        f"FUNCTION_BLOCK({name}, {quoted(doc)}, {items})",
        "{",
        "    if (fmu_problem) return FAULT(fmu_problem);",
        "    fmu_instance *one = fmu_of(self->lease);",
        "    bool begins = !self->begun;",
        "    if (!one && (!begins || !(one = fmu_claimed(&self->lease)))) return FAULT(FMU_LEASE_LOST);",
        "    uint32_t problem = 0;",
        "    one->used = __atomic_add_fetch(&fmu_clock, 1, __ATOMIC_RELAXED);",
        "    if (begins) {",
        "        one->at_ns = 0, one->before_ns = invocation->time_ns, one->before = invocation->number;",
        "        one->failed = 0;",
        "        if (one->touched && fmu_reset(one->component) > 1) problem = FMU_NOT_INITIALISED;",
        "        one->touched = 1;",
        *_exchanged("Set", fmu.version, [*ports.fixed, *ports.tunable], "        "),
        "        if (!problem && fmu_entered(one->component) > 1) problem = FMU_NOT_INITIALISED;",
        *_exchanged("Set", fmu.version, ports.inputs, "        "),
        "        if (!problem && fmu_exit(one->component) > 1) problem = FMU_NOT_INITIALISED;",
        "    } else if (one->failed) {",
        "        problem = FMU_STEP_FAILED;",
        "    } else {",
        *_exchanged("Set", fmu.version, [*ports.tunable, *ports.inputs], "        "),
        "        if (!problem) problem = fmu_stepped(one, invocation);",
        "    }",
        *_exchanged("Get", fmu.version, ports.outputs, "    "),
        "    if (problem) one->failed = 1;",
        "    fmu_left(one);",
        "    if (problem) return FAULT(problem);",
        "    self->begun = 1;",
        "    return OK;",
        "}",
    ]
    return "\n".join(lines) + "\n"


_STATES = ('state_keep(int64_t, lease, 0, "which instance of the FMU it has")', 'state(bool, begun, 0, "whether it is initialised")')


def _groups(ports: Iterable[Port]) -> dict[str, list[Port]]:
    made: dict[str, list[Port]] = {}
    for port in ports:
        made.setdefault(port.variable.group, []).append(port)
    return made


def _native(version: int, group: str, port: Port) -> str:
    """Returns the C type that the FMI function uses for the port."""
    if version == 2:
        return {"Real": "double", "Integer": "int", "Boolean": "int"}[group]
    return port.variable.type


def _functions(version: int, given: list[Port], taken: list[Port]) -> list[str]:
    """Returns the declarations of pointers to the FMU's functions, and the code that resolves them."""
    lines, finds = [], []
    for verb, const, ports in (("Set", "const ", given), ("Get", "", taken)):
        for group, members in _groups(ports).items():
            value = f"{const}{_native(version, group, members[0])} *"
            more = ", size_t" if version == 3 else ""
            lines.append(f"static fmu_status (*fmu_{verb}_{group})(void *, const uint32_t *, size_t, {value}{more});")
            finds.append(f'    *(void **)&fmu_{verb}_{group} = fmu_find("fmi{version}{verb}{group}");')
    return [*lines, "static void fmu_functions(void) {", *finds, "}"]


def _exchanged(verb: str, version: int, ports: list[Port], indent: str) -> list[str]:
    """Returns the calls that `Set` values of the block, or `Get` them."""
    lines = []
    for group, members in _groups(ports).items():
        places = [f"self->{port.item.name}{f'[{k}]' if port.variable.size else ''}" for port in members for k in range(port.count)]
        kind = _native(version, group, members[0])
        values = f"const {kind} values[] = {{{', '.join(places)}}};" if verb == "Set" else f"{kind} values[{len(places)}];"
        lines += [
            "if (!problem) {",
            f"    static const uint32_t refs[] = {{{', '.join(str(port.variable.reference) for port in members)}}};",
            f"    {values}",
            f"    if (fmu_{verb}_{group}(one->component, refs, {len(members)}, values{f', {len(places)}' if version == 3 else ''}) > 1) "
            "problem = FMU_VALUE_REFUSED;",
            *(f"    {place} = values[{k}];" for k, place in enumerate(places) if verb == "Get"),
            "}",
        ]
    return [indent + line for line in lines]
