// SPDX-License-Identifier: Apache-2.0

import { useId } from "react";
import { count, duration } from "../../design/numbers";
import { tr } from "../../language/text";
import { quantile, upperEdge } from "./sources";

const WIDTH = 360;
const HEIGHT = 84;
const BOTTOM = 14;
/** First and last bin that are always drawn: 128 ns to 33 ms. */
const FIRST = 7;
const LAST = 24;
/** Half the width of an axis label, px. */
const FIGURE = 18;
/** Positions of labels on the axis, ns. */
const MARKS = [1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9];

/** Histogram of times, both axes logarithmic, because rare events matter most. The text below the picture has the same content. */
export function Histogram(props: { title: string; bins: number[]; limit: number | null; limitName: string; greatest: string }) {
  const { bins } = props;
  const heading = useId();
  const used = bins.flatMap((counted, bin) => (counted > 0 ? [bin] : []));
  const first = Math.min(FIRST, used[0] ?? FIRST);
  const last = Math.max(LAST, used.at(-1) ?? LAST);
  const across = WIDTH / (last - first + 1);
  const x = (ns: number) => (Math.log2(ns) - first) * across;
  const most = Math.max(1, ...bins);
  const tall = (counted: number) => (Math.log10(counted + 1) / Math.log10(most + 1)) * (HEIGHT - BOTTOM - 4);
  return (
    <figure className="histogram" aria-labelledby={heading}>
      <figcaption id={heading}>
        <strong>{props.title}</strong> <Words bins={bins} greatest={props.greatest} />
      </figcaption>
      <svg viewBox={`0 0 ${WIDTH} ${HEIGHT}`} width={WIDTH} height={HEIGHT} aria-hidden="true">
        {MARKS.filter((ns) => x(ns) > 0 && x(ns) < WIDTH - FIGURE).map((ns) => (
          <g key={ns}>
            <line className="grid" x1={x(ns)} x2={x(ns)} y1={0} y2={HEIGHT - BOTTOM} />
            <text x={x(ns)} y={HEIGHT - 3} textAnchor="middle">
              {mark(ns)}
            </text>
          </g>
        ))}
        {bins.map((counted, bin) =>
          counted > 0 ? (
            <rect
              // biome-ignore lint/suspicious/noArrayIndexKey: the bin is what it is known by
              key={bin}
              className="bar"
              x={(bin - first) * across + 0.5}
              width={across - 1}
              y={HEIGHT - BOTTOM - tall(counted)}
              height={tall(counted)}
            >
              <title>
                {tr("system.binToBin2Counted", { bin: duration(2 ** bin), bin2: duration(upperEdge(bin)), counted: count(counted) })}
              </title>
            </rect>
          ) : null,
        )}
        <line className="axis" x1={0} x2={WIDTH} y1={HEIGHT - BOTTOM} y2={HEIGHT - BOTTOM} />
        {props.limit !== null && x(props.limit) < WIDTH && (
          <line className="limit" x1={x(props.limit)} x2={x(props.limit)} y1={0} y2={HEIGHT - BOTTOM}>
            <title>{props.limitName}</title>
          </line>
        )}
      </svg>
    </figure>
  );
}

function mark(ns: number): string {
  return ns < 1e6 ? `${ns / 1e3} µs` : ns < 1e9 ? `${ns / 1e6} ms` : `${ns / 1e9} s`;
}

function Words(props: { bins: number[]; greatest: string }) {
  const { bins } = props;
  if (bins.every((counted) => counted === 0)) return <span className="quiet">{tr("system.noValuesYet")}</span>;
  return (
    <span className="quiet">
      {tr("system.halfBelow")} <span className="figures">{duration(quantile(bins, 0.5))}</span>
      {tr("system.999Below")} <span className="figures">{duration(quantile(bins, 0.999))}</span>
      {tr("system.maximum")} <span className="figures">{props.greatest}</span>
    </span>
  );
}
