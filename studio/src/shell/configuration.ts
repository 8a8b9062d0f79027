// SPDX-License-Identifier: Apache-2.0
import { useEffect, useState } from "react";
import { askUntilAnswered } from "../control/asking";
import type { Configuration } from "../control/shapes";
import { useControl, useTopic } from "./context";

/** Returns processors, sources, devices and their types. Reads them again when devices or sources are added or removed. */
export function useConfiguration(): Configuration | null {
  const control = useControl();
  const now = useTopic(control.topics.statistics);
  const [configuration, setConfiguration] = useState<Configuration | null>(null);
  const there = now ? JSON.stringify([Object.keys(now.sources), Object.keys(now.devices), Object.keys(now.physical_devices)]) : "";
  useEffect(() => {
    if (there === "") return;
    // An error is not shown here: the statistics at the top of the page report it.
    return askUntilAnswered(control, { ask: (signal) => control.look("configuration", {}, signal), take: setConfiguration });
  }, [control, there]);
  return configuration;
}
