# SPDX-License-Identifier: Apache-2.0
"""Function blocks in Python: an interface and the location of the code. `block(k=2.0)` is a use with constants,
`block.labelled("filter")` an occurrence whose ports are attributes, and `block.run(u=...)` a trial without a system."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from inspect import Parameter, Signature
from typing import TYPE_CHECKING, Any, TypeAlias, cast

from .. import _native
from ..errors import CallError, DefinitionError, UnknownName, ValueRefused, did_you_mean, refusals, refuse
from ..refusals.argument_types import all_taking
from ..refusals.declared_names import DeclaredNames
from ..refusals.source_location import Place, here
from ..values.encoding import plain
from ..values.tables import CallSignature, Table, TableDisplay
from . import block_trial

if TYPE_CHECKING:
    from ..system.system import System
    from ..values.quantities import Quantity
    from .block_trial import Trial
    from .graphs import Graph


class FunctionBlock(DeclaredNames):
    """A function block: an application subroutine (`Block`) or a data flow graph (`Graph`). Both have the same interface."""

    def _tried(self, steps: int | None, every: Quantity, given: Mapping[str, Any]) -> Trial:
        """Runs a trial as described in `run`, with the input values and constants in one dictionary."""
        raise NotImplementedError


class Item:
    """One item of an interface: `name`, `kind`, `mode`, `type`, `unit`, `range` (`"(0, 10]"`, or empty), `doc`, `has_default`.

    `sized` is True if the item's length is the block's size; `least` and `most` are the limits of a size; `initial` contains the
    bytes of its default or preset; `history` is the number of most recent values that it reads, or 0.
    """

    def __init__(self, item: Mapping[str, Any]) -> None:
        self.name: str = item["name"]
        self.kind: str = item["kind"]
        mode = item["mode"]
        self.mode: str = mode if isinstance(mode, str) else f"ratio {mode['ratio']}"
        self.type: str = item["type_text"]
        self.unit: str = item["unit"]
        self.range: str = item.get("range", "")
        self.doc: str = item["doc"]
        self.has_default: bool = item.get("has_default", False)
        self.sized: bool = item.get("sized", False)
        self.least: int = item.get("least", 0)
        self.most: int = item.get("most", 0)
        self.initial = bytes(item.get("default", []))
        self.history: int = item.get("history", 0)

    def check(self, value: Any, what: str) -> None:
        """Raises `OutOfRange` for a number, or text with a unit, outside the range. `what` names the value in the message."""
        given = plain(value, what)
        with refusals:
            number = _native.number_in(given, self.unit) if isinstance(given, str) else given
            if isinstance(number, bool) or not isinstance(number, int | float):
                refuse(ValueRefused, f"{what} must be a number, not {value!r}")
            _native.check_range(what, f"{self.unit} {self.range}", number)

    def __repr__(self) -> str:
        unit = f", {self.unit}" if self.unit else ""
        mode = "" if self.kind not in ("input", "output") or self.mode == "synchronous" else f" {self.mode}"
        last = f", the last {self.history}" if self.history else ""
        return f"{self.kind.replace('_', ' ')}{mode} {self.name} ({self.type or 'no value'}{unit}{last}): {self.doc}"


@all_taking
class Block(TableDisplay, FunctionBlock):
    """An application subroutine. Its five components are `inputs`, `outputs`, `devices`, `conditions` and `parameters`.

    Obtained from `gpac.library` (`lib.lowpass`) or `cell.download` (`code.lowpass`). Each component is a dictionary, name → item.
    `types` contains the declarations of struct types, `module` is `"library"` or the file of its code, and `system` is the system
    that downloaded it, or None.
    """

    period_ns: int | None = None
    """The only interval at which the block may be activated; None if any interval is allowed."""
    names: Mapping[str, Sequence[str]] = {}
    """Joint names of each port, in the port's order."""
    native: bool = True
    """True if the block runs without an interpreter."""

    def __init__(self, interface: Mapping[str, Any], module: str = "library", system: System | None = None) -> None:
        self.name: str = interface["name"]
        self.doc: str = interface["doc"]
        self.items = {item["name"]: Item(item) for item in interface["items"]}
        self.types: Mapping[str, str] = interface.get("types", {})
        self.module = module
        self.system = system
        self.__doc__ = repr(self)

    @property
    def _own_interval(self) -> str:
        """Returns the wording that precedes `period_ns` in messages."""
        return f"block '{self.name.rpartition('.')[2]}' takes steps of"

    def _instead(self, name: str) -> str:
        return f"pass constants where it is used: {self.name.rpartition('.')[2]}({name}=…)" if name in self.items else ""

    def _of(self, *kinds: str) -> dict[str, Item]:
        return {name: item for name, item in self.items.items() if item.kind in kinds}

    @property
    def inputs(self) -> dict[str, Item]:
        """Input ports by name."""
        return self._of("input")

    @property
    def outputs(self) -> dict[str, Item]:
        """Output ports by name."""
        return self._of("output")

    @property
    def devices(self) -> dict[str, Item]:
        """Device channels by name."""
        return self._of("device_read", "device_write")

    @property
    def conditions(self) -> dict[str, Item]:
        """Conditions by name."""
        return self._of("condition")

    @property
    def parameters(self) -> dict[str, Item]:
        """Formal parameters by name."""
        return self._of("parameter", "size")

    def __call__(self, **constants: Any) -> BlockUse:
        """Returns this block with constants for parameters, presets, sizes or inputs: `lib.lowpass(alpha=0.3)`."""
        for name in constants:
            if name not in self.items:
                refuse(CallError, f"block '{self.name}' has no item '{name}'", did_you_mean(name, self.items))
        return BlockUse(self, constants)

    def labelled(self, label: str) -> Occurrence:
        """Returns an occurrence of this block under a label: `planner = lib.trajectory_planner.labelled("planner")`; `planner.goal` is a
        port."""
        return Occurrence(label, BlockUse(self, {}))

    def run(self, steps: int | None = None, every: Quantity = "1 ms", **values: Any) -> Trial:
        """Runs the block without a system, with constants for its parameters, and for each input either one value or one value per
        invocation.

        `steps` is the number of invocations; by default it is the length of the shortest series of values, or one. `every` is the
        interval between two invocations, for blocks that measure time. Raises `CallError` for a name that the block does not have.

        An error in the block is reported as its `fault`, with all earlier results: faults are contained as in a firing, and an
        invocation may take at most 1 s.
        >>> from opengpac import library as lib
        >>> lib.lowpass.run(alpha=0.5, u=[1.0, 1.0]).y
        array([0.5 , 0.75])
        """
        return self._tried(steps, every, values)

    def _tried(self, steps: int | None, every: Quantity, given: Mapping[str, Any]) -> Trial:
        return block_trial.run(self, steps, every, given)

    def source_json(self) -> dict[str, Any]:
        """Returns the block's reference in the model's format."""
        return {"subroutine": self.name}

    def __repr__(self) -> str:
        lines = [f"block {self.name}: {self.doc}", *(f"  {item!r}" for item in self.items.values())]
        return "\n".join(lines)

    @CallSignature
    def __signature__(self) -> Signature:
        """Call signature, with the constants of a use, for code completion."""
        constant = [item for item in self.items.values() if item.kind in ("parameter", "size", "input", "condition")]
        return Signature([Parameter(item.name, Parameter.KEYWORD_ONLY, default=...) for item in constant])

    def _table(self) -> Table:
        rows = [
            (i.kind.replace("_", " "), i.name, i.type, i.unit, "" if i.kind not in ("input", "output") else i.mode, i.doc)
            for i in self.items.values()
        ]
        return Table(f"{self.name}: {self.doc}", ["kind", "name", "type", "unit", "mode", "description"], rows)


@all_taking
class BlockUse(DeclaredNames):
    """A block or graph with constants, not yet labelled. Created by calling a block: `lib.lowpass(alpha=0.3)`.

    `block` is the block or graph. `constants` maps names of its inputs and parameters to values: numbers, sequences of the item's
    shape, or structs as tuples or dicts. A number is in the item's unit; a string includes a unit, `"20 ms"`. `place` is the source
    line in the program. A name that the block does not have raises `CallError` immediately; types, ranges and units are checked at
    installation.
    """

    def __init__(self, block: Block | Graph, constants: Mapping[str, Any], place: Place | None = None) -> None:
        self.block = block
        self.constants = dict(constants)
        self.place = place or here()

    def labelled(self, label: str) -> Occurrence:
        """Returns an occurrence of this use under a label."""
        return Occurrence(label, self)

    def json(self) -> dict[str, Any]:
        """Returns the block use in the model's format."""
        return {
            "block": self.block.source_json(),
            "constants": {name: plain(value, f"the constant for '{name}'") for name, value in self.constants.items()},
            "place": self.place.json(),
        }

    def _called(self) -> str:
        return f"a use of block '{self.block.name}'"

    def _instead(self, name: str) -> str:
        return self.block._instead(name)

    def __repr__(self) -> str:
        constants = ", ".join(f"{name}={value!r}" for name, value in self.constants.items())
        return f"{self.block.name}({constants})"


class Reference(str):
    """Name of a port, condition or parameter: a string such as `planner.goal`, accepted wherever a name is.

    `sum.u[0]` is an element of an array port.
    """

    __slots__ = ()

    def __getitem__(self, index: Any) -> str:
        return Reference(f"{self!s}[{index}]") if isinstance(index, int) and index >= 0 else super().__getitem__(index)


class Occurrence:
    """A labelled use of a block. Its items are attributes: `planner.goal` is accepted wherever `"planner.goal"` is.

    Created by `block.labelled("planner")`.
    """

    def __init__(self, label: str, use: BlockUse) -> None:
        self._label = label
        self._use = use

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        block = self._use.block
        if name in block.items:
            return Reference(f"{self._label}.{name}")
        inner: Mapping[str, BlockUse] = getattr(block, "blocks", {})
        if name in inner:
            return Occurrence(f"{self._label}.{name}", inner[name])
        refuse(UnknownName, f"block '{self._label}' ({block.name}) has no item '{name}'", did_you_mean(name, [*block.items, *inner]))

    def __dir__(self) -> list[str]:
        block = self._use.block
        return [*block.items, *getattr(block, "blocks", {})]

    def __str__(self) -> str:
        return self._label

    def __repr__(self) -> str:
        return f"{self._label}: {self._use!r}"


AnyBlock: TypeAlias = "Block | BlockUse | Occurrence | Graph"
Blocks: TypeAlias = "Mapping[str, AnyBlock] | Iterable[Occurrence]"
Name: TypeAlias = "str | Occurrence"
Names: TypeAlias = "Sequence[Name] | Name"


def use_of(block: object, label: str) -> BlockUse:
    """Returns the block use for a value of `blocks=`."""
    if isinstance(block, BlockUse):
        return block
    if isinstance(block, Occurrence):
        return block._use
    if isinstance(block, FunctionBlock):
        return BlockUse(cast("Block | Graph", block), {})
    refuse(
        DefinitionError,
        f"block '{label}' must be a function block, not {block!r}",
        "pass a block of gpac.library or of a code module, or a graph",
    )


def uses_of(blocks: Any) -> dict[str, BlockUse]:
    """Converts `blocks=` to a dictionary of uses by label; also accepts a sequence of occurrences."""
    if isinstance(blocks, Mapping):
        return {str(label): use_of(block, str(label)) for label, block in blocks.items()}
    if not isinstance(blocks, Iterable) or isinstance(blocks, str | bytes):
        refuse(DefinitionError, f"blocks= must be a dictionary of labels and blocks, not {blocks!r}", "write blocks={'pid': library.pid}")
    uses: dict[str, BlockUse] = {}
    for block in blocks:
        if not isinstance(block, Occurrence):
            refuse(
                DefinitionError,
                f"an item of blocks= must be a labelled block, not {block!r}",
                "pass a dictionary, or lib.pid.labelled('pid')",
            )
        if str(block) in uses:
            refuse(DefinitionError, f"two blocks are labelled '{block}'", "give each block its own label")
        uses[str(block)] = block._use
    return uses


def names_of(names: Any) -> list[str]:
    """Returns a list of port names, given one name or several."""
    if isinstance(names, str | Occurrence):
        return [str(names)]
    if not isinstance(names, Iterable) or isinstance(names, bytes):
        refuse(
            DefinitionError,
            f"names of ports must be a string or a list of strings, not {names!r}",
            "write 'label.port', or a list of such names",
        )
    given = list(names)
    wrong = next((name for name in given if not isinstance(name, str | Occurrence)), None)
    if wrong is not None:
        refuse(
            DefinitionError,
            f"an item of a list of names must be a string, not {wrong!r}",
            "write 'label.port', or 'label.port[0]' for an element of an array port",
        )
    return [str(name) for name in given]


def mapping_of(mapping: Mapping[Any, Any] | None) -> dict[str, list[str]]:
    """Returns a mapping of names to sets of names: χ, ψ or ρ in the model's format."""
    if mapping is not None and not isinstance(mapping, Mapping):
        refuse(DefinitionError, f"a mapping must be a dictionary, not {mapping!r}", "write {'name': 'label.port'}")
    return {str(name): names_of(targets) for name, targets in (mapping or {}).items()}


def systems_of(uses: Iterable[BlockUse]) -> set[System]:
    """Returns the systems whose code modules contain these blocks."""
    found: set[System] = set()
    for use in uses:
        if isinstance(use.block, Block):
            if use.block.system is not None:
                found.add(use.block.system)
        else:
            found |= systems_of(use.block.blocks.values())
    return found


def modules_of(uses: Iterable[BlockUse]) -> dict[str, str]:
    """Returns the code modules of the component data base that contain these blocks, excluding the standard library: name → file."""
    found: dict[str, str] = {}
    for use in uses:
        if not isinstance(use.block, Block):
            found |= modules_of(use.block.blocks.values())
        elif use.block.system is None and use.block.module != "library":
            found[use.block.name.split(".", 1)[0]] = use.block.module
    return found
