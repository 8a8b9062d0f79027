// SPDX-License-Identifier: Apache-2.0

import { useEffect, useState } from "react";
import { askUntilAnswered } from "../../control/asking";
import { type Refusal, refusalsOf } from "../../control/refusals";
import type { Configuration } from "../../control/shapes";
import { Panel, Refusals } from "../../design/parts";
import { tr } from "../../language/text";
import { useAction, useControl, useTopic, useWatched } from "../../shell/context";
import { NumberField } from "./NumberField";
import type { Scope } from "./scope";

interface About {
  unit: string;
  tunable: boolean;
}

interface TunedDevice {
  device: string;
  parameters: { name: string; unit: string }[];
}

/** The tunable parameters of the devices whose values are on the screen. */
export function Parameters(props: { scope: Scope }) {
  const control = useControl();
  const installed = useTopic(control.topics.installed);
  const traces = useWatched(props.scope.setup).traces;
  const [configuration, setConfiguration] = useState<Configuration | null>(null);
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  // biome-ignore lint/correctness/useExhaustiveDependencies: what is installed may have brought devices
  useEffect(() => {
    return askUntilAnswered(control, {
      ask: (signal) => control.look("configuration", {}, signal),
      take: (found) => {
        setConfiguration(found);
        setRefusals([]);
      },
      failed: (why) => setRefusals(refusalsOf(why)),
    });
  }, [control, installed]);
  const tuned = configuration ? tunedBy(configuration, [...new Set(traces.map((trace) => trace.channel))]) : [];
  if (refusals.length > 0) return <Refusals of={refusals} />;
  if (tuned.length === 0) return null;
  return (
    <Panel title={tr("scope.parameters")} className="parameters">
      <div className="stack">
        {tuned.map((one) => (
          <section key={one.device} aria-label={one.device}>
            <h3>{one.device}</h3>
            {one.parameters.map((parameter) => (
              <Parameter key={parameter.name} device={one.device} {...parameter} />
            ))}
          </section>
        ))}
      </div>
    </Panel>
  );
}

function tunedBy(configuration: Configuration, channels: readonly string[]): TunedDevice[] {
  return Object.entries(configuration.logical_devices)
    .filter(([device]) => channels.some((channel) => channel.startsWith(`${device}.`)))
    .map(([device, type]) => {
      const parameters = Object.entries((configuration.device_types[type]?.parameters ?? {}) as Record<string, About>);
      return { device, parameters: parameters.filter(([, about]) => about.tunable).map(([name, about]) => ({ name, unit: about.unit })) };
    })
    .filter((one) => one.parameters.length > 0);
}

function Parameter(props: { device: string; name: string; unit: string }) {
  const control = useControl();
  const { device, name, unit } = props;
  const [value, setValue] = useState<number | null>(null);
  const [unread, setUnread] = useState<Refusal[]>([]);
  const { run, busy, refusals } = useAction();
  useEffect(() => {
    return askUntilAnswered(control, {
      ask: (signal) => control.look("device_parameter", { name: device, parameter: name }, signal),
      take: (now) => {
        setValue(typeof now === "number" ? now : null);
        setUnread([]);
      },
      failed: (why) => setUnread(refusalsOf(why)),
    });
  }, [control, device, name]);
  if (value === null) return <Refusals of={unread} />;
  return (
    <>
      <NumberField
        label={name}
        unit={unit}
        value={value}
        disabled={busy || !control.may("operate")}
        put={(next) =>
          void run(async () => {
            await control.order("set_device_parameter", { name: device, parameter: name, value: next });
            setValue(next);
          })
        }
      />
      <Refusals of={refusals} />
    </>
  );
}
