// SPDX-License-Identifier: Apache-2.0

import { lazy, Suspense, useEffect, useMemo, useRef } from "react";
import { Empty } from "../../design/parts";
import { trNodes } from "../../language/nodes";
import { tr } from "../../language/text";
import { useConfiguration } from "../../shell/configuration";
import { useControl, useTopic } from "../../shell/context";
import { useRoute } from "../../shell/route";
import { useArms } from "./arms";
import { DeviceDetail } from "./DeviceDetail";
import { Family } from "./Family";
import { isSignal } from "./Forcing";
import { familiesOf } from "./families";
import { PhysicalDevices } from "./PhysicalDevices";
import { PointsPanel } from "./PointsPanel";
import { ToolPanel } from "./ToolPanel";
import "./devices.css";

// three.js is loaded with the first machine.
const Machine = lazy(() => import("./Machine"));

/** Logical devices with their SVVs, parameters and jogging; physical devices with their channels, drawn if they have a geometry. */
export default function Devices() {
  const control = useControl();
  const now = useTopic(control.topics.statistics);
  const configuration = useConfiguration();
  const { path } = useRoute();
  const arms = useArms();
  const detail = useRef<HTMLDivElement>(null);
  const before = useRef(path[0]);
  const type = configuration?.logical_devices[path[0] ?? ""];
  // The panel of a device opens below the tables, and comes into sight when its name is pressed. An address that leads here shows the
  // tables, where joints are jogged, except for a signal, which has its buttons in the panel.
  useEffect(() => {
    if (type !== undefined && (path[0] !== before.current || isSignal(type))) detail.current?.scrollIntoView({ block: "nearest" });
    before.current = path[0];
  }, [path[0], type]);
  const families = useMemo(() => (configuration ? familiesOf(configuration) : []), [configuration]);
  if (!configuration || !now) return <p className="quiet wait">{tr("devices.waitingForTheDevices")}</p>;
  const names = Object.keys(configuration.logical_devices);
  const physical = Object.keys(configuration.physical_devices);
  if (names.length === 0 && physical.length === 0) {
    return (
      <Empty title={tr("devices.thisSystemHasNoDevicesYet")}>
        {trNodes("devices.aProgramBringsAnArmWith", {
          code: <code>gpac.robots.load("ur5e", rtp)</code>,
          code2: <code>DigitalInput("part", io["part"])</code>,
          code3: <code>rtp.physical_device(name, driver)</code>,
        })}
      </Empty>
    );
  }
  const chosen = path[0] && names.includes(path[0]) ? path[0] : (names[0] ?? null);
  return (
    <div className="devices">
      <div className="stack">
        <Suspense fallback={<p className="quiet wait">{tr("devices.loading")}</p>}>
          {physical.map((name) => (
            <Machine key={name} device={name} lost={now.physical_devices[name]?.lost ?? null} />
          ))}
        </Suspense>
        <div className="physical stack">
          <PhysicalDevices configuration={configuration} now={now} />
        </div>
      </div>
      <div className="stack">
        {families.map((family) => (
          <div className="families" key={`${family.name} ${family.type.name}`}>
            <Family of={family} now={now} chosen={chosen} />
          </div>
        ))}
        {arms?.map((arm) => (
          <div className="families stack" key={arm.name}>
            <ToolPanel of={arm} now={now} />
            {arm.chain && <PointsPanel of={arm} chain={arm.chain} now={now} />}
          </div>
        ))}
        {chosen && (
          <div className="detail" ref={detail}>
            <DeviceDetail key={chosen} name={chosen} configuration={configuration} now={now} />
          </div>
        )}
      </div>
    </div>
  );
}
