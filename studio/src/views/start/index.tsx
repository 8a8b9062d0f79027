// SPDX-License-Identifier: Apache-2.0

import { useEffect, useState } from "react";
import { askUntilAnswered } from "../../control/asking";
import type { Configuration, Names, Statistics } from "../../control/shapes";
import { Empty, Panel, Tag } from "../../design/parts";
import { trNodes } from "../../language/nodes";
import { presentTexts, tr } from "../../language/text";
import { useConfiguration } from "../../shell/configuration";
import { useControl, useTopic } from "../../shell/context";
import { addressOf } from "../../shell/route";
import { views } from "../../shell/views";
import { TourOffer } from "./TourOffer";
import { triesOf } from "./tries";
import "./start.css";

/** Start page: an introduction, the running verbs, and suggestions. */
export default function Start() {
  const control = useControl();
  const now = useTopic(control.topics.statistics);
  const configuration = useConfiguration();
  const names = useNames(now);
  if (!now || !configuration || !names) return <p className="quiet wait">{tr("start.waitingForTheSystem")}</p>;
  return (
    <div className="first stack">
      <p className="lead">{tr("start.thisPageShowsARunningSystem", { RIGHTS: RIGHTS[rightsOf((role) => control.may(role))] })}</p>
      <Runs now={now} configuration={configuration} />
      <TourOffer configuration={configuration} names={names} />
      <Tries configuration={configuration} names={names} />
      <Panel title={tr("start.views")}>
        <dl className="views">
          {views
            .filter((view) => !view.alone && view.name !== "start")
            .map((view) => (
              <div key={view.name}>
                <dt>
                  <a href={addressOf(view.name)}>{view.title}</a>
                </dt>
                <dd>{view.about}</dd>
              </div>
            ))}
        </dl>
        <p className="quiet">
          {trNodes("start.kbdListsTheKeys", { kbd: <kbd>?</kbd> })}
          {presentTexts().language !== "en" && ` ${tr("start.messagesAndHelpAreInEnglish")}`}
        </p>
      </Panel>
    </div>
  );
}

type Rights = "observe" | "operate" | "configure";

const RIGHTS: Record<Rights, string> = {
  observe: tr("start.youMayViewEverythingHereBut"),
  operate: tr("start.youMayViewEverythingStartAnd"),
  configure: tr("start.youMayViewEverythingStartAndHalt"),
};

function rightsOf(may: (role: Rights) => boolean): Rights {
  return may("configure") ? "configure" : may("operate") ? "operate" : "observe";
}

/** Returns the names in the system; they are read again when devices or instances are added or removed. */
function useNames(now: Statistics | null): Names | null {
  const control = useControl();
  const [names, setNames] = useState<Names | null>(null);
  const there = now ? JSON.stringify([Object.keys(now.devices), now.instances.map((one) => one.name)]) : "";
  useEffect(() => {
    if (there === "") return;
    return askUntilAnswered(control, { ask: (signal) => control.look("names", {}, signal), take: setNames });
  }, [control, there]);
  return names;
}

function Runs(props: { now: Statistics; configuration: Configuration }) {
  const { now, configuration } = props;
  const states = Object.values(now.devices);
  const enabled = states.filter((state) => state !== "disabled" && state !== "fault").length;
  const faults = states.filter((state) => state === "fault").length;
  // Verbs that support devices are listed with the devices.
  const acting = now.instances.filter((one) => one.state === "running" && one.owner === null);
  return (
    <Panel title={tr("start.running")}>
      <ul className="facts">
        <li>
          <a href={addressOf("system")}>{counted(Object.keys(configuration.processors).length, "Processors")}</a>{" "}
          {tr("start.withCount", { count: counted(Object.keys(configuration.sources).length, "Sources") })}
        </li>
        <li>
          <a href={addressOf("devices")}>{counted(states.length, "Devices")}</a>
          {states.length > 0 && tr("start.enabledEnabled", { enabled })}{" "}
          {faults > 0 && <Tag tone="bad">{tr("start.faultsInFault", { faults })}</Tag>}
        </li>
        <li>
          <a href={addressOf("verbs")}>{counted(acting.length, "Instances")}</a> {tr("start.running2")}
          {acting.length > 0 && `: ${acting.map((one) => one.name).join(", ")}`}
        </li>
      </ul>
    </Panel>
  );
}

function counted(count: number, of: "Processors" | "Sources" | "Devices" | "Instances"): string {
  return count === 0 ? tr(`start.no${of}`) : tr(`start.count${of}`, { count });
}

function Tries(props: { configuration: Configuration; names: Names }) {
  const control = useControl();
  const { configuration, names } = props;
  const tries = triesOf({
    verbs: names.verbs,
    svvs: names.svvs,
    configuration,
    mayOperate: control.may("operate"),
    mayConfigure: control.may("configure"),
  });
  if (tries.length === 0)
    return (
      <Empty title={tr("start.nothingIsSetUpInThis")}>
        {trNodes("start.aProgramBringsAnArmWith", { code: <code>gpac.robots.load("ur5e").enable()</code> })}
      </Empty>
    );
  return (
    <Panel title={tr("start.thingsToTry")}>
      <ol className="tries">
        {tries.map((one) => (
          <li key={one.title}>
            <a href={one.address}>
              <strong>{one.title}</strong>
              <span>{one.about}</span>
            </a>
          </li>
        ))}
      </ol>
    </Panel>
  );
}
