# SPDX-License-Identifier: Apache-2.0
"""Data flow graphs, which are immutable values: `insert`, `replace` and `remove` return new graphs."""

from __future__ import annotations

import copy
import os
from collections.abc import Mapping
from inspect import Parameter, Signature
from typing import TYPE_CHECKING, Any

from ..errors import DefinitionError, UnknownName, did_you_mean, refuse
from ..pictures import PictureOwner
from ..refusals.argument_types import all_taking, taking, whole
from ..refusals.source_location import Place, here
from ..values.tables import CallSignature, identifiers
from . import graph_trial
from .blocks import Block, Blocks, BlockUse, FunctionBlock, Item, Occurrence, mapping_of, systems_of, use_of, uses_of
from .entering import check_graph
from .graph_interface import GraphPort, items_of

if TYPE_CHECKING:
    from ..values.quantities import Quantity
    from .block_trial import Trial


def mode_json(mode: Any) -> Any:
    """Returns a port mode in the model's format: `"synchronous"`, `"asynchronous"` or `gpac.ratio(5)`."""
    if (isinstance(mode, str) and mode in ("synchronous", "asynchronous")) or (isinstance(mode, dict) and list(mode) == ["ratio"]):
        return mode
    refuse(
        DefinitionError,
        f"a port mode must be 'synchronous', 'asynchronous' or a ratio, not {mode!r}",
        "write mode='asynchronous' or mode=gpac.ratio(10), for example",
    )


@taking
def ratio(n: int) -> dict[str, int]:
    """Returns the mode of a port that is updated once every n invocations."""
    return {"ratio": whole(n, "the ratio of a port", 1, 1_000_000)}


@all_taking
class Graph(PictureOwner, FunctionBlock):
    """A data flow graph: blocks, and ρ as three mappings. It looks like a subroutine from outside, and is accepted wherever one is.

    Messages use `name`. `blocks`: label → block, graph, or either with constants. `inputs`, `outputs` and `cells` map a port or local
    cell of the graph to ports of its blocks, `"label.port"`; `modes` relaxes the mode of a block's port; `divide={"estimator": 5}`
    runs that block once for every five invocations of the others; `doc` describes the graph in a sentence.

    Raises `DefinitionError`, `UnknownName`, `TypeMismatch`, `UnitMismatch`, `SynchronousCycle` and `CoverError`; several at once as
    `InstallationErrors`.
    >>> import opengpac as gpac
    >>> from opengpac import library as lib
    >>> smooth = gpac.Graph("smooth", blocks={"gain": lib.gain, "filter": lib.lowpass}, inputs={"u": "gain.u"},
    ...                     outputs={"y": "filter.y"}, cells={"scaled": ["gain.y", "filter.u"]})
    >>> smooth.insert("limit", lib.limit, between=("gain.y", "filter.u")).cells
    {'scaled': ['gain.y', 'limit.u'], 'limit': ['limit.y', 'filter.u']}
    """

    _definition_kind = "graphs"
    """Section of a definition file."""

    _settable = frozenset({"layout"})

    def __init__(
        self,
        name: str,
        *,
        blocks: Blocks,
        inputs: Mapping[str, Any] | None = None,
        outputs: Mapping[str, Any] | None = None,
        cells: Mapping[str, Any] | None = None,
        modes: Mapping[str, Any] | None = None,
        divide: Mapping[str, int] | None = None,
        doc: str = "",
    ) -> None:
        self.name = name
        self.doc = doc
        self.blocks = uses_of(blocks)
        self.inputs = self._ports(mapping_of(inputs))
        self.outputs = self._ports(mapping_of(outputs))
        self.cells = mapping_of(cells)
        self.modes = {str(port): mode_json(mode) for port, mode in (modes or {}).items()}
        self.divide = {str(label): n for label, n in (divide or {}).items()}
        self.layout: dict[str, Any] = {}
        self.place = self._defined_at()
        self._check()

    def _defined_at(self) -> Place:
        return here()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the graph to the TOML or JSON file at `path`; its extension selects the format: `docs/files.md`.

        The file's other contents are preserved; `gpac.load` reads it.

        `layout`, the positions of its boxes in an editor, is written unchanged.
        """
        from .files import saving

        saving.save(path, self)

    def _ports(self, mapping: Mapping[str, list[str]]) -> dict[str, GraphPort]:
        return {name: GraphPort(self, name, ports) for name, ports in mapping.items()}

    @property
    def devices(self) -> Mapping[str, Item]:
        """Devices of the blocks by name, `read.channel`."""
        return items_of(self, "devices")

    @property
    def conditions(self) -> Mapping[str, Item]:
        """Conditions of the blocks by name, `force.above`."""
        return items_of(self, "conditions")

    @property
    def parameters(self) -> Mapping[str, Item]:
        """Formal parameters of the blocks by name, `filter.alpha`."""
        return items_of(self, "parameters")

    def run(self, steps: int | None = None, every: Quantity = "1 ms", **values: Any) -> Trial:
        """Runs the graph without a system, like `Block.run`. Takes one value for each input or one per invocation, and constants for
        parameters, `**{"filter.alpha": 0.5}`; `steps` and `every` are as in `Block.run`. A graph that reads its own output, or runs
        at several rates, needs a system.
        >>> import opengpac as gpac
        >>> from opengpac import library as lib
        >>> twice = gpac.Graph("twice", blocks={"a": lib.gain(k=2.0)}, inputs={"u": "a.u"}, outputs={"y": "a.y"})
        >>> twice.run(u=[1.0, 2.0]).y
        array([2., 4.])
        """
        return self._tried(steps, every, values)

    def _tried(self, steps: int | None, every: Quantity, given: Mapping[str, Any]) -> Trial:
        return graph_trial.run(self, steps, every, given)

    @property
    def items(self) -> Mapping[str, Any]:
        """Ports of the graph by name."""
        return {**self.inputs, **self.outputs}

    @CallSignature
    def __signature__(self) -> Signature:
        """Call signature, with the constants of a use, for code completion."""
        return Signature([Parameter(name, Parameter.KEYWORD_ONLY, default=...) for name in identifiers(self.inputs)])

    def __call__(self, **constants: Any) -> BlockUse:
        """Returns this graph with constants for its inputs, or `**{"filter.alpha": 0.1}` for an inner parameter."""
        return BlockUse(self, constants)

    def labelled(self, label: str) -> Occurrence:
        """Returns an occurrence of this graph under a label."""
        return Occurrence(label, BlockUse(self, {}))

    def insert(self, label: str, block: Any, *, between: tuple[Any, Any], input: str | None = None, output: str | None = None) -> Graph:
        """Returns a new graph with `block`, labelled `label`, inserted `between` an output port (or graph input) and the input port that
        it fed.

        `input` and `output` name the ports of the new block if more than one must be bound.
        """
        use = use_of(block, label)
        source, sink = str(between[0]), str(between[1])
        if label in self.blocks:
            refuse(DefinitionError, f"graph '{self.name}' already has a block '{label}'", "choose another label")
        taken, given = f"{label}.{input or _only(use, 'input')}", f"{label}.{output or _only(use, 'output')}"
        new = self._copy()
        for mapping in (new.cells, new.inputs, new.outputs):
            for name, ports in mapping.items():
                if sink in ports and (source in ports or (mapping is new.inputs and source == name)):
                    ports[ports.index(sink)] = taken
                    new.blocks[label] = use
                    new.cells[_free(label, new)] = [given, sink]
                    new._check()
                    return new
        refuse(
            UnknownName,
            f"graph '{self.name}' has no connection from '{source}' to '{sink}'",
            f"choose one of its connections: {self._connections()}",
        )

    def replace(self, label: str, block: Any) -> Graph:
        """Returns a new graph in which `block` replaces the block labelled `label`, with the same bindings."""
        self._known(label)
        new = self._copy()
        new.blocks[label] = use_of(block, label)
        new._check()
        return new

    def remove(self, label: str) -> Graph:
        """Returns a new graph without the block labelled `label`; the source of its only input then feeds the readers of its only
        output."""
        self._known(label)
        new = self._copy()
        prefix = f"{label}."
        out = next((n for n, ports in new.cells.items() if any(p.startswith(prefix) for p in ports) and self._is_output(n, label)), None)
        moved = [p for p in new.cells.pop(out, []) if not p.startswith(prefix)] if out else []
        del new.blocks[label]
        for mapping in (new.inputs, new.cells, new.outputs):
            for ports in mapping.values():
                if any(p.startswith(prefix) for p in ports):
                    ports[:] = [p for p in ports if not p.startswith(prefix)] + moved
                    moved = []
        new._check()
        return new

    def svg(self) -> str:
        """Returns a picture as SVG: blocks with their ports, types, units and modes, and the wires between them. Nested graphs are drawn
        as boxes.

        A notebook shows it automatically. Asynchronous wires are dashed; wires with a ratio are dotted.
        """
        from ..pictures.flow import graph_svg

        return graph_svg(self)

    def source_json(self) -> dict[str, Any]:
        """Returns the graph's reference as a block in the model's format."""
        return {"graph": self.json()}

    def json(self) -> dict[str, Any]:
        """Returns the graph in the model's format."""
        return {
            "name": self.name, "doc": self.doc, "blocks": {label: use.json() for label, use in self.blocks.items()},
            "inputs": self.inputs, "outputs": self.outputs, "cells": self.cells, "modes": self.modes, "divide": self.divide,
            "place": self.place.json(),
        }  # fmt: skip

    def _copy(self) -> Graph:
        new = copy.copy(self)
        inputs, outputs = new._ports(self.inputs), new._ports(self.outputs)
        cells = {n: list(p) for n, p in self.cells.items()}
        vars(new).update(blocks=dict(self.blocks), inputs=inputs, outputs=outputs, cells=cells, place=here())
        return new

    def _known(self, label: str) -> None:
        if label not in self.blocks:
            refuse(UnknownName, f"graph '{self.name}' has no block '{label}'", did_you_mean(label, self.blocks))

    def _instead(self, name: str) -> str:
        if name in self.inputs:
            return f"pass constants where it is used: {self.name}({name}=…)"
        return "use insert, replace or remove, which return a new graph" if name in vars(self) else ""

    def _is_output(self, cell: str, label: str) -> bool:
        block = self.blocks[label].block
        outputs = block.outputs
        return any(port == f"{label}.{name}" for port in self.cells[cell] for name in outputs)

    def _connections(self) -> str:
        named = [f"{n} ({', '.join(ports)})" for m in (self.inputs, self.cells, self.outputs) for n, ports in m.items()]
        return "; ".join(named)

    def _check(self) -> None:
        systems = systems_of(self.blocks.values())
        check_graph(self, next(iter(systems), None))

    def __repr__(self) -> str:
        blocks = ", ".join(f"{label}: {use!r}" for label, use in self.blocks.items())
        return f"graph {self.name} [{blocks}]\n  connections: {self._connections()}"


def _only(use: BlockUse, kind: str) -> str:
    block = use.block
    if isinstance(block, Block):
        ports = {"input": block.inputs, "output": block.outputs}[kind]
        names = [n for n, item in ports.items() if not (item.has_default or n in use.constants)] or [*ports]
    else:
        names = [*(block.inputs if kind == "input" else block.outputs)]
    if len(names) != 1:
        refuse(
            DefinitionError,
            f"block '{block.name}' has {len(names)} {kind} ports that must be bound: {', '.join(names)}",
            f"name them with {kind}=",
        )
    return names[0]


def _free(label: str, graph: Graph) -> str:
    taken = {*graph.cells, *graph.inputs, *graph.outputs}
    return label if label not in taken else next(f"{label}_{n}" for n in range(2, len(taken) + 3) if f"{label}_{n}" not in taken)


__all__ = ["Graph", "Item", "mode_json", "ratio"]
