// SPDX-License-Identifier: Apache-2.0
import { useReactFlow, useStoreApi } from "@xyflow/react";
import { useCallback, useEffect } from "react";
import { type Box, type Drawing, type Place, sizeOf } from "./drawing";

/** Minimum zoom when a box is shown on request. */
const ZOOM_LEAST = 1;

/** Targets that have already been shown; they are not shown again when the drawing reappears. */
const shown = new WeakSet<object>();

/** Centres a box as soon as it is drawn, once for each object passed. */
export function Middle(props: { of: { box: string | null } | null; drawing: Drawing; places: ReadonlyMap<string, Place> }) {
  const { of, drawing, places } = props;
  const show = useMiddle();
  useEffect(() => {
    const box = of && drawing.boxes.find((one) => one.id === of.box);
    const place = box && places.get(box.id);
    if (!of || !box || !place || shown.has(of)) return;
    return show(box, place, () => shown.add(of));
  }, [of, drawing, places, show]);
  return null;
}

/** Returns a function that centres a box and then calls `done`. The function that it returns in turn cancels this while it is pending. */
export function useMiddle(): (box: Box, place: Place, done: () => void) => () => void {
  const flow = useReactFlow();
  const store = useStoreApi();
  return useCallback(
    (box: Box, place: Place, done: () => void) => {
      const { width, height } = sizeOf(box);
      const zoom = Math.max(store.getState().transform[2], ZOOM_LEAST);
      // Runs after the frame in which a new drawing is fitted into view.
      const frame = requestAnimationFrame(() => {
        done();
        void flow.setCenter(place.x + width / 2, place.y + height / 2, { zoom });
      });
      return () => cancelAnimationFrame(frame);
    },
    [flow, store],
  );
}
