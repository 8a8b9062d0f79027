// SPDX-License-Identifier: Apache-2.0
import type { Show, ShownTrace } from "../messages";
import type { Range } from "../signal/ranges";
import type { PlacedScale } from "./draw";

/** Returns the scale with its position in the picture: in the plot of its trace, or, for lanes, in lane `i` of `of`. */
export function placed(range: Range, i: number, of: number, trace: ShownTrace, show: Show): PlacedScale {
  if (show.scales !== "lanes") {
    const band = show.plots.find(({ plot }) => plot === (trace.setup.plot ?? 0));
    return { ...range, top: band?.top ?? 0, bottom: band ? band.top + band.height : show.height };
  }
  const height = show.height / of;
  const air = Math.min(2 * show.ratio, height / 8);
  return { ...range, top: i * height + air, bottom: (i + 1) * height - air };
}
