// SPDX-License-Identifier: Apache-2.0
import { type FitViewOptions, getViewportForBounds, MiniMap, type Rect, useReactFlow, useStore, useStoreApi } from "@xyflow/react";
import { useEffect, useRef } from "react";
import { type Box, type Place, sizeOf } from "./drawing";

/** From so many boxes on a map of the whole helps. */
const MAP_FROM = 12;
export const ZOOM_MIN = 0.1;
export const ZOOM_MAX = 2;
/** How the whole is shown: not larger than it is, beside the buttons for the zoom. */
export const FIT = { maxZoom: 1, padding: { x: "24px", y: "24px", left: "64px" } } satisfies FitViewOptions;

/** A map of the whole, where some of it is not to be seen. */
export function Overview(props: { boxes: Box[]; places: ReadonlyMap<string, Place> }) {
  const { boxes, places } = props;
  const { x, y, width, height } = boundsOf(boxes, places);
  const isAllSeen = useStore(({ transform: [left, top, zoom], width: wide, height: high }) => {
    const [from, above] = [x * zoom + left, y * zoom + top];
    return from >= 0 && above >= 0 && from + width * zoom <= wide && above + height * zoom <= high;
  });
  if (isAllSeen || boxes.length < MAP_FROM) return null;
  return <MiniMap pannable zoomable ariaLabel="Map of the whole" nodeColor="var(--line-strong)" />;
}

/** Shows the whole when `of` changes: another graph. */
export function useFitting(of: string, boxes: Box[], places: ReadonlyMap<string, Place>): void {
  const flow = useReactFlow();
  const store = useStoreApi();
  const isReady = useStore((state) => state.panZoom !== null && state.width > 0);
  const fitted = useRef<string | null>(null);
  useEffect(() => {
    if (!isReady || places.size === 0 || fitted.current === of) return;
    fitted.current = of;
    const { width, height } = store.getState();
    void flow.setViewport(getViewportForBounds(boundsOf(boxes, places), width, height, ZOOM_MIN, FIT.maxZoom, FIT.padding));
  }, [of, boxes, places, isReady, flow, store]);
}

function boundsOf(boxes: Box[], places: ReadonlyMap<string, Place>): Rect {
  let [left, top, right, below] = [Number.POSITIVE_INFINITY, Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY, Number.NEGATIVE_INFINITY];
  for (const box of boxes) {
    const { x, y } = places.get(box.id) ?? { x: 0, y: 0 };
    const { width, height } = sizeOf(box);
    [left, top] = [Math.min(left, x), Math.min(top, y)];
    [right, below] = [Math.max(right, x + width), Math.max(below, y + height)];
  }
  return { x: left, y: top, width: right - left, height: below - top };
}
