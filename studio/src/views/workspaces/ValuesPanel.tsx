// SPDX-License-Identifier: Apache-2.0
import { useEffect, useState } from "react";
import { askUntilAnswered } from "../../control/asking";
import type { ShownValue, SvvAbout } from "../../control/shapes";
import { Name, Tag } from "../../design/parts";
import { Age } from "../../live/Age";
import { LiveValue } from "../../live/LiveValue";
import { useControl, useTopic } from "../../shell/context";
import { isRenewed } from "../devices/families";
import { beyond, limitsText } from "./limits";

/** Current values with their units and limits; a value beyond a limit is marked in words. */
export function ValuesPanel(props: { of: readonly ShownValue[] }) {
  return (
    <dl className="shown-values">
      {props.of.map((value) => (
        <ValueRow key={`${value.name} ${value.label}`} of={value} />
      ))}
    </dl>
  );
}

function ValueRow(props: { of: ShownValue }) {
  const { of } = props;
  const control = useControl();
  const about = useAbout(of.name);
  const now = useTopic(control.topics.statistics);
  const device = Object.keys(now?.devices ?? {}).find((name) => of.name.startsWith(`${name}.`));
  const isOld = device !== undefined && !isRenewed(now?.devices[device]);
  const [wrong, setWrong] = useState<string | null>(null);
  const [missing, setMissing] = useState<string | null>(null);
  const unit = about?.unit ?? "";
  useEffect(
    () =>
      control.values.watch(of.name, (reading, refused) => {
        setWrong(beyond(reading?.value, of, unit));
        setMissing(refused ? refused.map((one) => one.message).join("; ") : null);
      }),
    [control, of, unit],
  );
  const limits = limitsText(of);
  return (
    <div className={`${wrong ? "beyond" : ""} ${isOld ? "old" : ""}`} data-value={of.name}>
      <dt title={of.name}>{of.label || <Name of={of.name} />}</dt>
      <dd>
        <LiveValue name={of.name} type_text={about?.type_text} unit={unit} /> {wrong && <Tag tone="bad">{wrong}</Tag>}
        {isOld && <Age of={[of.name]} />}{" "}
        {limits && <span className="quiet small limits">{`${limits}${unit ? `\u202f${unit}` : ""}`}</span>}
        {missing && <span className="wrong small">{missing}</span>}
      </dd>
    </div>
  );
}

/** Returns the type and unit of a value; null until they are known, or if the system does not have the value. */
export function useAbout(name: string): SvvAbout | null {
  const control = useControl();
  const [about, setAbout] = useState<SvvAbout | null>(null);
  useEffect(() => {
    setAbout(null);
    // The value is shown without them as well; a missing value shows its own reason.
    return askUntilAnswered(control, { ask: (signal) => control.look("svv_about", { name }, signal), take: setAbout });
  }, [control, name]);
  return about;
}
