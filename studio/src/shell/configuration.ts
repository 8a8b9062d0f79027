// SPDX-License-Identifier: Apache-2.0
import { useEffect, useState } from "react";
import type { Configuration } from "../control/shapes";
import { useControl, useTopic } from "./context";

/** Processors, sources, devices and their types. Asked for again when devices or sources came or went. */
export function useConfiguration(): Configuration | null {
  const control = useControl();
  const now = useTopic(control.topics.statistics);
  const [configuration, setConfiguration] = useState<Configuration | null>(null);
  const there = now ? JSON.stringify([Object.keys(now.sources), Object.keys(now.devices), Object.keys(now.physical_devices)]) : "";
  useEffect(() => {
    if (there === "") return;
    let over = false;
    // What it cannot tell is told by the statistics, which stand at the top of the page.
    control.look("configuration", {}).then(
      (found) => over || setConfiguration(found),
      () => undefined,
    );
    return () => {
      over = true;
    };
  }, [control, there]);
  return configuration;
}
