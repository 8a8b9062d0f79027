// SPDX-License-Identifier: Apache-2.0
// Suggestions of the first page: things to try in this system, each with its address.
import type { Configuration } from "../../control/shapes";
import { addressOf } from "../../shell/route";

/** A suggestion on the start page. */
export interface Try {
  title: string;
  about: string;
  address: string;
}

/** Names in the system that determine which suggestions are possible. */
export interface SystemNames {
  verbs: readonly string[];
  svvs: readonly string[];
  configuration: Configuration;
  mayOperate: boolean;
  mayConfigure: boolean;
}

/** Returns the suggestions that are possible in this system, easiest first. */
export function triesOf(known: SystemNames): Try[] {
  const { verbs, svvs, configuration, mayOperate, mayConfigure } = known;
  const joint = Object.entries(configuration.logical_devices).find(
    ([, type]) => "jog_speed" in (configuration.device_types[type]?.parameters ?? {}),
  )?.[0];
  const sensed = svvs.find((name) => name === `${joint}.sensed`) ?? svvs.find((name) => name !== "studio.heartbeat");
  const signal = Object.entries(configuration.logical_devices).find(([, type]) => /^(digital|analog)_(input|output)$/.test(type))?.[0];
  const found: (Try | false | undefined)[] = [
    joint !== undefined &&
      mayOperate &&
      verbs.includes("jog") && {
        title: "Jog a joint",
        about: "Enable the joints, and hold + or − beside one; it moves while the button is held.",
        address: addressOf("devices", [joint]),
      },
    joint !== undefined &&
      mayOperate &&
      verbs.includes("jog_linear") && {
        title: "Jog the tool of an arm",
        about: "Along and about the axes of its base or of the tool: while a button is held, or by steps of a length that you choose.",
        address: addressOf("devices", [joint]),
      },
    joint !== undefined &&
      mayOperate &&
      verbs.includes("move_absolute") && {
        title: "Move to a position",
        about: "Choose the joints, enter a goal or use the present position, and press Start.",
        address: addressOf("verbs", ["move_absolute"]),
      },
    signal !== undefined &&
      mayConfigure && {
        title: "Force a signal",
        about: "Give an input or output a value of your choice, until you release it.",
        address: addressOf("devices", [signal]),
      },
    joint !== undefined && {
      title: "View the machine",
      about: "In 3-D, with the path of its tool and all values of each joint.",
      address: addressOf("devices"),
    },
    sensed !== undefined && {
      title: "Watch a value",
      about: `${sensed} on the scope, at its full rate.`,
      address: addressOf("scope", [], { names: sensed }),
    },
    Object.keys(configuration.sources).length > 0 && {
      title: "See what runs, and when",
      about: "Blocks and their wires with live values; load and jitter of each interrupt source.",
      address: addressOf("flow"),
    },
    mayConfigure && {
      title: "Record",
      about: "Save values, log and ends to a file that opens in the same views.",
      address: addressOf("recordings"),
    },
  ];
  return found.filter((one): one is Try => Boolean(one));
}
