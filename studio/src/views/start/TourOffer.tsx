// SPDX-License-Identifier: Apache-2.0
import { useEffect, useState } from "react";
import type { Configuration, Names } from "../../control/shapes";
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
  const arm = useSimulatedArm(configuration);
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

/** Returns the name of a simulated machine with a geometry, and the names of its joints; null if there is none. */
function useSimulatedArm(configuration: Configuration): { name: string; joints: string[] } | null {
  const control = useControl();
  const [arm, setArm] = useState<{ name: string; joints: string[] } | null>(null);
  useEffect(() => {
    let over = false;
    const find = async () => {
      for (const name of Object.keys(configuration.physical_devices)) {
        const geometry = await control.look("geometry", { device: name }).catch(() => null);
        const joints = Object.keys(configuration.logical_devices).filter(
          (device) => device.startsWith(`${name}.`) && isJoint(configuration, device),
        );
        if (over) return;
        if (geometry && joints.length > 0) return setArm({ name, joints });
      }
    };
    void find();
    return () => {
      over = true;
    };
  }, [control, configuration]);
  return arm;
}

function isJoint(configuration: Configuration, device: string): boolean {
  return "jog_speed" in (configuration.device_types[configuration.logical_devices[device] ?? ""]?.parameters ?? {});
}
