// SPDX-License-Identifier: Apache-2.0

import { useEffect, useState } from "react";
import type { Reading } from "../control/shapes";
import { tr } from "../language/text";
import { useControl, useTopic } from "../shell/context";
import { isStored } from "./stored";

/** Age of the latest of these values, "12 s old", or a note that there is none. Used for values that are no longer updated. */
export function Age(props: { of: string[] }) {
  const control = useControl();
  const now = useTopic(control.topics.statistics);
  const [newest, setNewest] = useState<number | null>(null);
  const names = props.of.join(" ");
  useEffect(() => {
    const times = new Map<string, number>();
    const take = (name: string) => (reading: Reading | null) => {
      if (reading && isStored(reading)) times.set(name, reading.time_ns);
      setNewest(times.size === 0 ? null : Math.max(...times.values()));
    };
    const ends = names
      .split(" ")
      .filter(Boolean)
      .map((name) => control.values.watch(name, take(name)));
    return () => {
      for (const end of ends) end();
    };
  }, [control, names]);
  return (
    <span className="age quiet small">
      {newest === null ? tr("live.neverMeasured") : now ? tr("live.nowSOld", { now_s: ageText(now.now_s - newest * 1e-9) }) : ""}
    </span>
  );
}

/** Formats an age in a suitable unit, never below 0: "0.4 s", "12 s", "3 min", "2 h". */
export function ageText(age_s: number): string {
  const age = Math.max(0, age_s);
  if (age < 10) return `${age.toFixed(1)} s`;
  if (age < 120) return `${Math.round(age)} s`;
  if (age < 7200) return `${Math.round(age / 60)} min`;
  return `${Math.round(age / 3600)} h`;
}
