// SPDX-License-Identifier: Apache-2.0

import {
  type FitViewOptions,
  getViewportForBounds,
  MiniMap,
  type Rect,
  useReactFlow,
  useStore,
  useStoreApi,
  type Viewport,
} from "@xyflow/react";
import { type CSSProperties, useEffect, useMemo, useRef } from "react";
import { tr } from "../../../language/text";
import { type Box, type Place, sizeOf, TITLE_EDGE, TITLE_LETTER, titleSize } from "./drawing";

/** Minimum number of boxes for which an overview map is shown. */
const MAP_FROM = 12;
export const ZOOM_MIN = 0.1;
export const ZOOM_MAX = 2;
/** Zoom below which the text of a box is illegible, so that only titles are shown, `FAR_PX` high on the screen. */
const FAR = 0.62;
const [BESIDE_ZOOM, BELOW_FIND] = [64, 64];
/** Minimum visible size of a box, px. */
const SEEN = 20;
const FAR_PX = 10;
/** Height of a line, relative to the size of titles; and the fraction of this size that is legible, to which long words are reduced. */
const [LINE, REDUCED] = [1.2, 0.9];
/** Minimum zoom at which the whole drawing is shown, and the step of the search for it. */
const [WHOLE_MIN, STEP] = [0.3, 0.02];
/** Options for fitting the whole drawing into view: not enlarged, and not covered by the zoom buttons. */
export const FIT = { maxZoom: 1, padding: { x: "24px", y: "24px", left: `${BESIDE_ZOOM}px` } } satisfies FitViewOptions;

/** An overview map of the whole drawing, shown if part of it is out of view. */
export function Overview(props: { boxes: Box[]; places: ReadonlyMap<string, Place> }) {
  const { boxes, places } = props;
  const { x, y, width, height } = boundsOf(boxes, places);
  const isAllSeen = useStore(({ transform: [left, top, zoom], width: wide, height: high }) => {
    const [from, above] = [x * zoom + left, y * zoom + top];
    return from >= 0 && above >= 0 && from + width * zoom <= wide && above + height * zoom <= high;
  });
  if (isAllSeen || boxes.length < MAP_FROM) return null;
  return <MiniMap pannable zoomable ariaLabel={tr("flow.overviewMap")} nodeColor="var(--line-strong)" />;
}

/** Returns a style with the size of titles if the drawing is zoomed out too far to be legible; otherwise null. */
export function useFar(): CSSProperties | null {
  // Quantized, so that not each turn of the wheel lays out every title again.
  const steps = useStore(({ transform: [, , zoom] }) => (zoom < FAR ? Math.round(zoom * 20) : null));
  return useMemo(() => (steps === null ? null : ({ "--far-size": `${FAR_PX / (Math.max(steps, 2) / 20)}px` } as CSSProperties)), [steps]);
}

/**
 * Fits the whole drawing into view when `of` changes. If it would be illegible, the view starts at the upper left corner. If a resized
 * window contains no box, the first box is shown.
 */
export function useFitting(of: string, boxes: Box[], places: ReadonlyMap<string, Place>): void {
  const flow = useReactFlow();
  const store = useStoreApi();
  const isReady = useStore((state) => state.panZoom !== null && state.width > 0);
  const [width, height] = [useStore((state) => state.width), useStore((state) => state.height)];
  const fitted = useRef<string | null>(null);
  const sized = useRef({ width: 0, height: 0 });
  useEffect(() => {
    if (!isReady || places.size === 0 || boxes.length === 0) return;
    // The view does not move because of a message: a drawing that was moved out of view stays there.
    if (fitted.current === of && sized.current.width === width && sized.current.height === height) return;
    sized.current = { width, height };
    const { transform } = store.getState();
    let viewport: Viewport = { x: transform[0], y: transform[1], zoom: transform[2] };
    if (fitted.current !== of) {
      fitted.current = of;
      const bounds = boundsOf(boxes, places);
      const whole = getViewportForBounds(bounds, width, height, ZOOM_MIN, FIT.maxZoom, FIT.padding);
      const zoom = legibleFrom(boxes);
      viewport = whole.zoom < zoom ? begunAt(bounds, zoom) : whole;
      void flow.setViewport(viewport);
    }
    const rects = boxes.map((box) => ({ ...(places.get(box.id) ?? { x: 0, y: 0 }), height: sizeOf(box).height }));
    if (!rects.some((rect) => isInSight(rect, viewport, width, height))) {
      const first = rects.reduce((one, other) => (other.x + other.y < one.x + one.y ? other : one));
      void flow.setViewport(begunAt(first, viewport.zoom));
    }
  }, [of, boxes, places, isReady, width, height, flow, store]);
}

/** Returns the view that starts at a position of the drawing and is not covered by the buttons. */
function begunAt(place: Place, zoom: number): Viewport {
  return { x: BESIDE_ZOOM - place.x * zoom, y: BELOW_FIND - place.y * zoom, zoom };
}

/** Returns whether the title of a box is visible. The title may be at the top or in the middle of the box. */
function isInSight(box: { x: number; y: number; height: number }, { x, y, zoom }: Viewport, width: number, height: number): boolean {
  const [left, top] = [box.x * zoom + x, box.y * zoom + y];
  return left > 0 && left < width - SEEN && top > 0 && top + (box.height / 2) * zoom < height - SEEN;
}

/**
 * Returns the minimum zoom at which the titles of all boxes are legible. If the drawing is too large to fit at that zoom, only its
 * beginning is shown.
 */
export function legibleFrom(boxes: Box[]): number {
  for (let zoom = WHOLE_MIN; zoom < FAR; zoom += STEP) if (boxes.every((box) => isLegible(box, zoom))) return zoom;
  return FAR;
}

function isLegible(box: Box, zoom: number): boolean {
  const { width, height } = sizeOf(box);
  const letters = Math.floor(((width - TITLE_EDGE) * zoom) / (FAR_PX * TITLE_LETTER));
  const lines = Math.floor((height * zoom) / (FAR_PX * LINE));
  return box.title.length <= letters * lines && titleSize(box) * zoom >= FAR_PX * REDUCED;
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
