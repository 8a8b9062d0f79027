// SPDX-License-Identifier: Apache-2.0
// Faces of blocks, from the call `library`.
import { tr } from "../../../language/text";
import type { PortSide } from "../drawing/drawing";
import type { BlockUse } from "./definition";

export interface Item {
  name: string;
  kind: "input" | "output" | "device_read" | "device_write" | "condition" | "parameter" | "state" | "size";
  mode: "synchronous" | "asynchronous" | { ratio: number };
  type_text: string;
  unit: string;
  doc: string;
  has_default: boolean;
}

/** A block as described in the component data base. */
export interface Face {
  name: string;
  doc: string;
  items: Item[];
  /** Struct types by name, with their declarations. */
  types: Record<string, string>;
  file: string;
}

export type Faces = ReadonlyMap<string, Face>;

export function modeText(mode: Item["mode"]): string {
  return typeof mode === "string" ? mode : tr("flow.ratioRatio", { ratio: mode.ratio });
}

/**
 * Returns the items of a use of a block. The items of a graph are its ports, with the properties of the ports to which they are bound,
 * because the paper's graph looks like a subroutine.
 */
export function itemsOf(use: BlockUse, faces: Faces): Item[] {
  if ("subroutine" in use.block) return faces.get(use.block.subroutine)?.items ?? [];
  const graph = use.block.graph;
  const port = (name: string, ports: string[], kind: "input" | "output"): Item => {
    const bound = ports.map((of) => inner(graph, of, faces)).find((item) => item !== undefined);
    const { mode = "synchronous", type_text = "", unit = "", doc = "" } = bound ?? {};
    return { name, kind, mode, type_text, unit, doc, has_default: false };
  };
  const inputs = Object.entries(graph.inputs).map(([name, ports]) => port(name, ports, "input"));
  const outputs = Object.entries(graph.outputs).map(([name, ports]) => port(name, ports, "output"));
  const others = Object.entries(graph.blocks).flatMap(([label, of]) =>
    itemsOf(of, faces)
      .filter((item) => item.kind === "condition" || item.kind === "parameter")
      .map((item) => ({ ...item, name: `${label}.${item.name}` })),
  );
  return [...inputs, ...outputs, ...others];
}

/** Returns the item named by `label.item`. */
export function inner(of: { blocks: Record<string, BlockUse> }, name: string, faces: Faces): Item | undefined {
  const [label, port] = splitPort(name, of.blocks);
  const use = Object.hasOwn(of.blocks, label) ? of.blocks[label] : undefined;
  return use && itemsOf(use, faces).find((item) => item.name === port);
}

/** Splits `label.port`. Labels may contain dots, so the longest existing label is used. */
export function splitPort(name: string, blocks: Record<string, unknown>): [string, string] {
  for (let dot = name.lastIndexOf("."); dot > 0; dot = name.lastIndexOf(".", dot - 1)) {
    const label = name.slice(0, dot);
    if (Object.hasOwn(blocks, label)) return [label, name.slice(dot + 1)];
  }
  const label = name.split(".")[0] ?? "";
  return [label, name.slice(label.length + 1)];
}

export function sideOf(item: Item): PortSide | null {
  if (item.kind === "input" || item.kind === "device_read") return "input";
  if (item.kind === "output" || item.kind === "device_write") return "output";
  return null;
}
