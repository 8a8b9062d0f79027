// SPDX-License-Identifier: Apache-2.0
import { useEffect, useState } from "react";
import { askUntilAnswered, isUnanswered } from "../../control/asking";
import type { Configuration, Names } from "../../control/shapes";
import type { Source } from "../../control/source";
import { Panel } from "../../design/parts";
import { tr } from "../../language/text";
import { useControl } from "../../shell/context";
import { tour } from "../../shell/tour/tour";

/**
 * Offers the tour if this page may operate, the system has the verbs for the motions, and an arm is simulated, so that no real machine
 * is moved for practice.
 */
export function TourOffer(props: { configuration: Configuration; names: Names }) {
  const { configuration, names } = props;
  const control = useControl();
  const arm = useArm(configuration);
  const isPossible =
    ["jog", "move_absolute"].every((verb) => names.verbs.includes(verb)) && control.past === null && control.may("operate");
  if (arm === null || !isPossible) return null;
  return (
    <Panel
      title={tr("tour.tourInFiveSteps")}
      end={
        <button type="button" className="primary" onClick={() => tour.set({ joints: arm.joints })}>
          {tr("tour.takeTheTour")}
        </button>
      }
    >
      <p>{tr("tour.withTheSimulatedArm", { arm: arm.name })}</p>
    </Panel>
  );
}

/** A simulated machine with a geometry, and the names of its joints. */
interface SimulatedArm {
  name: string;
  joints: string[];
}

/** Returns the first simulated arm of the system; null if there is none. */
function useArm(configuration: Configuration): SimulatedArm | null {
  const control = useControl();
  const [arm, setArm] = useState<SimulatedArm | null>(null);
  useEffect(() => {
    return askUntilAnswered(control, { ask: (signal) => simulatedArm(control, configuration, signal), take: setArm });
  }, [control, configuration]);
  return arm;
}

async function simulatedArm(control: Source, configuration: Configuration, signal: AbortSignal): Promise<SimulatedArm | null> {
  for (const name of Object.keys(configuration.physical_devices)) {
    const joints = Object.keys(configuration.logical_devices).filter(
      (device) => device.startsWith(`${name}.`) && isJoint(configuration, device),
    );
    if (joints.length > 0 && (await hasGeometry(control, name, signal))) return { name, joints };
  }
  return null;
}

async function hasGeometry(control: Source, device: string, signal: AbortSignal): Promise<boolean> {
  try {
    await control.look("geometry", { device }, signal);
    return true;
  } catch (why) {
    // A refusal says that the device has none; without an answer, nothing is known.
    if (signal.aborted || isUnanswered(why)) throw why;
    return false;
  }
}

function isJoint(configuration: Configuration, device: string): boolean {
  return "jog_speed" in (configuration.device_types[configuration.logical_devices[device] ?? ""]?.parameters ?? {});
}
