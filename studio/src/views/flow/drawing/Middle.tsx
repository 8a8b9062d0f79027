// SPDX-License-Identifier: Apache-2.0
import { useReactFlow, useStoreApi } from "@xyflow/react";
import { useCallback, useEffect } from "react";
import { type Box, type Drawing, type Place, sizeOf } from "./drawing";

/** Zoom at which a box is shown that somebody asked for. */
const ZOOM_LEAST = 1;

/** The aims that were shown: none is shown again when the drawing comes back. */
const shown = new WeakSet<object>();

/** Shows a box in the middle as soon as it is drawn, once for each object that it is given. */
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

/** Returns a function that shows a box in the middle and calls `done` then; what that returns takes it back until it has happened. */
export function useMiddle(): (box: Box, place: Place, done: () => void) => () => void {
  const flow = useReactFlow();
  const store = useStoreApi();
  return useCallback(
    (box: Box, place: Place, done: () => void) => {
      const { width, height } = sizeOf(box);
      const zoom = Math.max(store.getState().transform[2], ZOOM_LEAST);
      // Behind the frame in which another drawing is shown as a whole.
      const frame = requestAnimationFrame(() => {
        done();
        void flow.setCenter(place.x + width / 2, place.y + height / 2, { zoom });
      });
      return () => cancelAnimationFrame(frame);
    },
    [flow, store],
  );
}
