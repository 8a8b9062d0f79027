// SPDX-License-Identifier: Apache-2.0
// Buttons: the instance of each, its state, and starting it.

import { isLate } from "../../control/late";
import { RefusalError } from "../../control/refusals";
import type { Button, End, InstalledInstance } from "../../control/shapes";
import type { Source } from "../../control/source";
import { tr, trWord } from "../../language/text";

/** Returns the name of a button's instance: an instance of a program, or the one that the button creates. */
export function instanceNameOf(button: Button, workspace: string): string {
  return button.instance ?? button.start?.name ?? `${workspace}.${button.label}`;
}

/** State of a button. */
export interface ButtonState {
  /** Description: "ready", "running: list near", "ended: arrived", "missing". */
  text: string;
  tone: "plain" | "good" | "warn" | "bad";
  /** True if the instance is running, suspended or queued, so that it can be halted but not started. */
  isLive: boolean;
  /** True if the instance does not exist, so that it cannot be started. */
  isMissing: boolean;
}

/** Returns the state of a button, from its instance and the instance's latest end. */
export function stateOf(button: Button, instance: InstalledInstance | null, ends: readonly End[]): ButtonState {
  if (!instance) {
    const isMissing = !button.start;
    return { text: isMissing ? trWord("missing") : trWord("ready"), tone: isMissing ? "bad" : "plain", isLive: false, isMissing };
  }
  const state = { isLive: false, isMissing: false };
  switch (instance.state) {
    case "running":
      return { ...state, text: `${trWord("running")}${instance.list ? `: ${instance.list}` : ""}`, tone: "good", isLive: true };
    case "suspended":
    case "queued":
      return { ...state, text: trWord(instance.state), tone: "warn", isLive: true };
    case "ended": {
      const report = ends.findLast((end) => end.instance === instance.id)?.report;
      if (!report) return { ...state, text: trWord("ended"), tone: "plain" };
      return { ...state, text: tr("workspaces.endedCondition", { condition: report.condition }), tone: report.normal ? "plain" : "bad" };
    }
    default:
      return { ...state, text: trWord("ready"), tone: "plain" };
  }
}

/**
 * Starts the instance of a button. If the button creates its instance, an existing one is deleted first, unless it was created for the
 * previous press and took too long: then that instance is started. Throws `RefusalError`.
 */
export async function start(control: Source, button: Button, workspace: string, instance: InstalledInstance | null): Promise<void> {
  if (!button.start) {
    if (!instance) {
      const message = tr("workspaces.verbInstanceInstanceDoesNotExist", { instance: button.instance });
      throw new RefusalError([{ class: "UnknownName", message, remedy: tr("workspaces.startTheProgramThatCreatesIt") }], 0);
    }
    await control.order("start", { instance: instance.id, values: button.values ?? {} });
    return;
  }
  const { values, ...application } = button.start;
  const pressed = control.pressed();
  const isKept = instance?.state === "created" && control.started.made(instance.id);
  if (instance && !isKept) await control.order("delete", { instance: instance.id });
  const made =
    instance && isKept
      ? instance.id
      : await control.order("create", { ...application, name: instanceNameOf(button, workspace) }, undefined, pressed);
  try {
    await control.order("start", { instance: made, values: values ?? {} }, undefined, pressed);
  } catch (why) {
    if (why instanceof RefusalError && !isLate(control, pressed)) await control.order("delete", { instance: made });
    throw why;
  }
}
