// SPDX-License-Identifier: Apache-2.0
import { tr } from "../../../language/text";
import type { Draft } from "./definition";
import type { Way } from "./nested";

/** The path to the open graph, from the outside in; each step opens its graph. */
export function Where(props: { whole: Draft; way: Way; go: (way: Way) => void }) {
  const { whole, way, go } = props;
  if (way.length === 0) return null;
  const steps = [whole.of.name, ...way];
  return (
    <nav aria-label={tr("flow.pathInTheDrawing")}>
      <ol className="row way">
        {steps.map((name, depth) => (
          // biome-ignore lint/suspicious/noArrayIndexKey: a step is known by its depth
          <li key={depth} className="row">
            {depth > 0 && <span aria-hidden="true">›</span>}
            {depth === way.length ? (
              <strong aria-current="location">{name}</strong>
            ) : (
              <button type="button" className="plain" onClick={() => go(way.slice(0, depth))}>
                {name}
              </button>
            )}
          </li>
        ))}
      </ol>
    </nav>
  );
}
