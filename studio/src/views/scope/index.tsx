// SPDX-License-Identifier: Apache-2.0

import { useEffect, useState } from "react";
import { type Refusal, refusalsOf } from "../../control/refusals";
import { count } from "../../design/numbers";
import { Empty, Refusals } from "../../design/parts";
import { trNodes } from "../../language/nodes";
import { tr } from "../../language/text";
import { useControl, useWatched } from "../../shell/context";
import { go, useRoute } from "../../shell/route";
import { Counts } from "./Counts";
import { FormulaField } from "./FormulaField";
import { Parameters } from "./Parameters";
import { Picker } from "./Picker";
import { Screen } from "./Screen";
import { Setups } from "./Setups";
import { type Scope, scopeOf } from "./scope";
import { fromLink, traceId } from "./setup";
import { Table } from "./Table";
import { Tools } from "./Tools";
import { Trigger } from "./Trigger";
import { useStill } from "./useStill";
import "./scope.css";

/** Scope view: shows any value at its full rate. */
export default function View() {
  const source = useControl();
  const scope = scopeOf(source.origin);
  useStill(scope, source !== source.origin);
  const [chosen, setChosen] = useState<string | null>(null);
  const trouble = useLink(scope);
  const none = useWatched(scope.setup).traces.length === 0;
  return (
    <div className="scope">
      <Tools scope={scope} />
      <aside className="scope-side" aria-label={tr("scope.valuesAndTrigger")}>
        <Picker scope={scope} />
        <FormulaField scope={scope} />
        {!scope.past && <Trigger scope={scope} />}
        <Setups scope={scope} />
      </aside>
      <div className="scope-middle">
        <Refusals of={trouble} />
        <div className="screen-frame">
          <Screen scope={scope} chosen={chosen} />
          {none && (
            <div className="nothing">
              <Empty title={tr("scope.noTracesYet")}>{trNodes("scope.findAValueInTheList", { kbd: <kbd>/</kbd> })}</Empty>
            </div>
          )}
        </div>
        {scope.past ? <Span scope={scope} /> : <Counts scope={scope} />}
        <div className="scope-below">
          <Table scope={scope} chosen={chosen} choose={(id) => setChosen((before) => (before === id ? null : id))} />
          {!scope.past && <Parameters scope={scope} />}
        </div>
      </div>
    </div>
  );
}

/** Line below the screen of a recording: the number of values in the visible span. */
function Span(props: { scope: Scope }) {
  const rows = useWatched(props.scope.rows);
  const trouble = useWatched(props.scope.trouble);
  const { traces } = useWatched(props.scope.setup);
  // Derived traces are not values of the recording.
  const stored = new Set(traces.filter((trace) => !trace.derive).map(traceId));
  const values = rows.reduce((sum, row) => sum + (row.reference || !stored.has(row.id) ? 0 : (row.measures?.count ?? 0)), 0);
  return (
    <div className="counts small">
      <span>
        <span className="figures" data-testid="values">
          {count(values)}
        </span>{" "}
        {tr("scope.valuesInViewMeasurementsUseAll")}
      </span>
      {trouble && <span className="bad">{trouble}</span>}
    </div>
  );
}

// The setup in a link is applied once and removed from the address, because later changes make it differ from the link.
function useLink(scope: Scope): Refusal[] {
  const { query } = useRoute();
  const [trouble, setTrouble] = useState<Refusal[]>([]);
  useEffect(() => {
    try {
      const said = fromLink(query);
      if (!said) return;
      scope.change(said);
      setTrouble([]);
    } catch (why) {
      setTrouble(refusalsOf(why));
    }
    go("scope");
  }, [scope, query]);
  return trouble;
}
