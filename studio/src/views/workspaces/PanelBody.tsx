// SPDX-License-Identifier: Apache-2.0

import { lazy, Suspense } from "react";
import type { Region } from "../../control/shapes";
import { tr } from "../../language/text";
import { AcknowledgeAll, AlarmTable } from "../../shell/AlarmTable";
import { useControl, useTopic, useWatched } from "../../shell/context";
import { ButtonsPanel } from "./ButtonsPanel";
import { PlotPanel } from "./PlotPanel";
import { ValuesPanel } from "./ValuesPanel";
import { VerbPanel } from "./VerbPanel";

// three.js is loaded with the first machine.
const Machine = lazy(() => import("../devices/Machine"));

/** Content of a panel, regardless of its frame. */
export function PanelBody(props: { of: Region; workspace: string }) {
  const { of } = props;
  switch (of.panel) {
    case "plot":
      return <PlotPanel names={of.names ?? []} seconds={of.seconds ?? 10} />;
    case "scene":
      return <Scene device={of.device ?? ""} />;
    case "values":
      return <ValuesPanel of={of.values ?? []} />;
    case "verb":
      return <VerbPanel verb={of.verb ?? ""} />;
    case "buttons":
      return <ButtonsPanel of={of.buttons ?? []} workspace={props.workspace} />;
    default:
      return <AlarmsPanel />;
  }
}

function Scene(props: { device: string }) {
  const now = useTopic(useControl().topics.statistics);
  return (
    <Suspense fallback={<p className="quiet wait">{tr("workspaces.loading")}</p>}>
      <div className="scene">
        <Machine device={props.device} lost={now?.physical_devices[props.device]?.lost ?? null} />
      </div>
    </Suspense>
  );
}

function AlarmsPanel() {
  const control = useControl();
  const alarms = useWatched(control.alarms.latest)?.current ?? [];
  if (alarms.length === 0) return <p className="quiet">{tr("workspaces.noAlarms")}</p>;
  return (
    <>
      <AlarmTable of={alarms} from={control} />
      <AcknowledgeAll of={alarms} from={control} />
    </>
  );
}
