// SPDX-License-Identifier: Apache-2.0
// Converts the form of a panel: lines of text, with a message for each error.

import type { Button, PanelKind, Region, ShownValue, Value } from "../../control/shapes";
import { tr } from "../../language/text";

export interface WrittenPanel {
  title: string;
  names: string;
  seconds: string;
  values: string;
  device: string;
  verb: string;
  buttons: string;
}

function linesOf(text: string): string[] {
  return text
    .split("\n")
    .map((line) => line.trim())
    .filter(Boolean);
}

export function valuesText(values: readonly ShownValue[]): string {
  const line = (of: ShownValue) => [of.name, of.label ?? "", of.minimum ?? "", of.maximum ?? ""].join(" | ").replace(/(\s*\|\s*)+$/, "");
  return values.map(line).join("\n");
}

/** Formats buttons as lines. For a button that creates its instance, the label is followed by JSON. */
export function buttonsText(buttons: readonly Button[]): string {
  const line = (of: Button) => {
    if (of.start) return `${of.label}: ${JSON.stringify(of.start)}`;
    const values = of.values && Object.keys(of.values).length > 0 ? ` ${JSON.stringify(of.values)}` : "";
    return `${of.label}: ${of.instance ?? ""}${values}`;
  };
  return buttons.map(line).join("\n");
}

/** Returns the panel that was entered, or a sentence that explains why it is invalid. The share of the previous panel is kept. */
export function panelOf(kind: PanelKind, written: WrittenPanel, before: Region | null): Region | string {
  const head = {
    ...(before?.share ? { share: before.share } : {}),
    panel: kind,
    ...(written.title.trim() && { title: written.title.trim() }),
  };
  switch (kind) {
    case "plot": {
      const names = linesOf(written.names);
      const seconds = Number(written.seconds);
      if (names.length === 0) return tr("workspaces.nameAtLeastOneSVVTo");
      if (!(seconds >= 0.1 && seconds <= 600)) return tr("workspaces.secondsIsNotANumberOf", { seconds: written.seconds });
      return { ...head, names, seconds };
    }
    case "values": {
      const values = linesOf(written.values).map(shownOf);
      const wrong = values.find((one) => typeof one === "string");
      if (wrong !== undefined) return wrong as string;
      return values.length === 0 ? tr("workspaces.nameAtLeastOneSVVToShow") : { ...head, values: values as ShownValue[] };
    }
    case "buttons": {
      const buttons = linesOf(written.buttons).map(buttonOf);
      const wrong = buttons.find((one) => typeof one === "string");
      if (wrong !== undefined) return wrong as string;
      return buttons.length === 0 ? tr("workspaces.writeAtLeastOneButton") : { ...head, buttons: buttons as Button[] };
    }
    case "scene":
      return written.device.trim() ? { ...head, device: written.device.trim() } : tr("workspaces.nameThePhysicalDeviceToDraw");
    case "verb":
      return written.verb.trim() ? { ...head, verb: written.verb.trim() } : tr("workspaces.nameTheVerbWhoseStateDiagram");
    default:
      return head;
  }
}

function shownOf(line: string): ShownValue | string {
  const [name = "", label = "", low = "", high = "", ...more] = line.split("|").map((part) => part.trim());
  if (name === "" || more.length > 0) return tr("workspaces.lineHasTheWrongFormWrite", { line });
  const found: ShownValue = { name, ...(label && { label }) };
  for (const [word, text] of [
    ["minimum", low],
    ["maximum", high],
  ] as const) {
    if (text === "") continue;
    const limit = Number(text);
    if (!Number.isFinite(limit)) return tr("workspaces.theWordOfNameMustBe", { word, name, text });
    found[word] = limit;
  }
  return found;
}

function buttonOf(line: string): Button | string {
  const [, label = "", rest = ""] = /^([^:]+):\s*(.*)$/.exec(line) ?? [];
  const at = rest.indexOf("{");
  const name = (at < 0 ? rest : rest.slice(0, at)).trim();
  let given: Record<string, Value> | null = null;
  if (at >= 0) {
    try {
      given = JSON.parse(rest.slice(at)) as Record<string, Value>;
    } catch {
      return tr("workspaces.theTextAfterIsNotJSON", { part: label || line });
    }
  }
  if (label.trim() === "" || (name === "" && given === null)) return tr("workspaces.lineHasTheWrongFormWriteLabel", { line });
  if (name !== "") return { label: label.trim(), instance: name, ...(given && { values: given }) };
  return { label: label.trim(), start: given as unknown as NonNullable<Button["start"]> };
}
