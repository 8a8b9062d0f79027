// SPDX-License-Identifier: Apache-2.0
// Suggestions of the first page: things to try in this system, each with its address.

import type { Configuration } from "../../control/shapes";
import { tr } from "../../language/text";
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
        title: tr("start.jogAJoint"),
        about: tr("start.enableTheJointsAndHoldOr"),
        address: addressOf("devices", [joint]),
      },
    joint !== undefined &&
      mayOperate &&
      verbs.includes("jog_linear") && {
        title: tr("start.jogTheToolOfAnArm"),
        about: tr("start.alongAndAboutTheAxesOf"),
        address: addressOf("devices", [joint]),
      },
    joint !== undefined &&
      mayOperate &&
      verbs.includes("move_absolute") && {
        title: tr("start.moveToAPosition"),
        about: tr("start.chooseTheJointsEnterAGoal"),
        address: addressOf("verbs", ["move_absolute"]),
      },
    signal !== undefined &&
      mayConfigure && {
        title: tr("start.forceASignal"),
        about: tr("start.giveAnInputOrOutputA"),
        address: addressOf("devices", [signal]),
      },
    joint !== undefined && {
      title: tr("start.viewTheMachine"),
      about: tr("start.in3DWithThePath"),
      address: addressOf("devices"),
    },
    sensed !== undefined && {
      title: tr("start.watchAValue"),
      about: tr("start.sensedOnTheScopeAtIts", { sensed }),
      address: addressOf("scope", [], { names: sensed }),
    },
    Object.keys(configuration.sources).length > 0 && {
      title: tr("start.seeWhatRunsAndWhen"),
      about: tr("start.blocksAndTheirWiresWithLive"),
      address: addressOf("flow"),
    },
    sensed !== undefined &&
      mayOperate && {
        title: tr("start.record"),
        about: tr("start.saveValuesLogAndEndsTo"),
        address: addressOf("recordings"),
      },
  ];
  return found.filter((one): one is Try => Boolean(one));
}
