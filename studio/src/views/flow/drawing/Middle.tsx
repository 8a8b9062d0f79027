// SPDX-License-Identifier: Apache-2.0
import { useReactFlow, useStoreApi } from "@xyflow/react";
import { useEffect } from "react";
import { type Drawing, type Place, sizeOf } from "./drawing";

/** How near a box is shown that somebody asked for. */
const ZOOM_LEAST = 1;

/** What was shown is not shown again when the drawing comes back. */
const shown = new WeakSet<object>();

/** Shows a box in the middle as soon as it is drawn, once for each object that it is given. */
export function Middle(props: { of: { box: string | null } | null; drawing: Drawing; places: ReadonlyMap<string, Place> }) {
  const { of, drawing, places } = props;
  const flow = useReactFlow();
  const store = useStoreApi();
  useEffect(() => {
    const box = of && drawing.boxes.find((one) => one.id === of.box);
    const place = box && places.get(box.id);
    if (!of || !box || !place || shown.has(of)) return;
    const { width, height } = sizeOf(box);
    const zoom = Math.max(store.getState().transform[2], ZOOM_LEAST);
    // Behind the frame in which another drawing is shown as a whole.
    const frame = requestAnimationFrame(() => {
      shown.add(of);
      void flow.setCenter(place.x + width / 2, place.y + height / 2, { zoom });
    });
    return () => cancelAnimationFrame(frame);
  }, [of, drawing, places, flow, store]);
  return null;
}
