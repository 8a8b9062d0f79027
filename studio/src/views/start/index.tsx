// SPDX-License-Identifier: Apache-2.0
import { useEffect, useState } from "react";
import type { Configuration, Names, Statistics } from "../../control/shapes";
import { Empty, Panel, Tag } from "../../design/parts";
import { useConfiguration } from "../../shell/configuration";
import { useControl, useTopic } from "../../shell/context";
import { addressOf } from "../../shell/route";
import { views } from "../../shell/views";
import { triesOf } from "./tries";
import "./start.css";

/** Start page: an introduction, the running verbs, and suggestions. */
export default function Start() {
  const control = useControl();
  const now = useTopic(control.topics.statistics);
  const configuration = useConfiguration();
  const names = useNames(now);
  if (!now || !configuration || !names) return <p className="quiet wait">Waiting for the system…</p>;
  return (
    <div className="first stack">
      <p className="lead">
        This page shows a running system of OpenGPAC, an open real-time controller. {RIGHTS[rightsOf((role) => control.may(role))]}
      </p>
      <Runs now={now} configuration={configuration} />
      <Tries configuration={configuration} names={names} />
      <Panel title="Views">
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
          <kbd>?</kbd> lists the keys.
        </p>
      </Panel>
    </div>
  );
}

type Rights = "observe" | "operate" | "configure";

const RIGHTS: Record<Rights, string> = {
  observe: "You may view everything here, but not send commands.",
  operate: "You may view everything, start and halt installed verbs, and enable devices.",
  configure: "You may view everything, start and halt installed verbs, enable devices, and draw and install new programs.",
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
    let over = false;
    control.look("names", {}).then(
      (found) => over || setNames(found),
      () => undefined,
    );
    return () => {
      over = true;
    };
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
    <Panel title="Running">
      <ul className="facts">
        <li>
          <a href={addressOf("system")}>{counted(Object.keys(configuration.processors).length, "processor")}</a> with{" "}
          {counted(Object.keys(configuration.sources).length, "interrupt source")}
        </li>
        <li>
          <a href={addressOf("devices")}>{counted(states.length, "device")}</a>
          {states.length > 0 && `, ${enabled} enabled`} {faults > 0 && <Tag tone="bad">{faults} in fault</Tag>}
        </li>
        <li>
          <a href={addressOf("verbs")}>{counted(acting.length, "verb instance")}</a> running
          {acting.length > 0 && `: ${acting.map((one) => one.name).join(", ")}`}
        </li>
      </ul>
    </Panel>
  );
}

function counted(count: number, of: string): string {
  return count === 1 ? `1 ${of}` : `${count === 0 ? "no" : count} ${of}s`;
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
      <Empty title="Nothing is set up in this system yet">
        A program brings an arm with <code>gpac.robots.load("ur5e").enable()</code>; things to try then appear here.
      </Empty>
    );
  return (
    <Panel title="Things to try">
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
