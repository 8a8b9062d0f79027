// SPDX-License-Identifier: Apache-2.0
// Buttons: which instance each stands for, in which state that is, and starting it.
import { isLate } from "../../control/late";
import { RefusalError } from "../../control/refusals";
import type { Button, End, InstalledInstance } from "../../control/shapes";
import type { Source } from "../../control/source";

/** The name of the instance that a button stands for: of a program's, or of the one that the button makes. */
export function instanceNameOf(button: Button, workspace: string): string {
  return button.instance ?? button.start?.name ?? `${workspace}.${button.label}`;
}

/** State of a button. */
export interface ButtonState {
  /** In words: "ready", "running: list near", "ended: arrived", "not there". */
  text: string;
  tone: "plain" | "good" | "warn" | "bad";
  /** It runs, or is held: it can be halted, and not started. */
  isLive: boolean;
  /** It cannot be started: nothing is there that could be. */
  isMissing: boolean;
}

/** The state of a button: of its instance, and how that ended last. */
export function stateOf(button: Button, instance: InstalledInstance | null, ends: readonly End[]): ButtonState {
  if (!instance) {
    const isMissing = !button.start;
    return { text: isMissing ? "not there" : "ready", tone: isMissing ? "bad" : "plain", isLive: false, isMissing };
  }
  const state = { isLive: false, isMissing: false };
  switch (instance.state) {
    case "running":
      return { ...state, text: `running${instance.list ? `: ${instance.list}` : ""}`, tone: "good", isLive: true };
    case "suspended":
    case "queued":
      return { ...state, text: instance.state, tone: "warn", isLive: true };
    case "ended": {
      const report = ends.findLast((end) => end.instance === instance.id)?.report;
      if (!report) return { ...state, text: "ended", tone: "plain" };
      return { ...state, text: `ended: ${report.condition}`, tone: report.normal ? "plain" : "bad" };
    }
    default:
      return { ...state, text: "ready", tone: "plain" };
  }
}

/**
 * Starts what a button stands for. Of a button that makes its instance an ended one makes room first; one whose making took too long for
 * the press before is started. Errors: `RefusalError`.
 */
export async function start(control: Source, button: Button, workspace: string, instance: InstalledInstance | null): Promise<void> {
  if (!button.start) {
    if (!instance) {
      const message = `there is no verb instance '${button.instance}'`;
      throw new RefusalError([{ class: "UnknownName", message, remedy: "the program that makes it is not running" }], 0);
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
