// SPDX-License-Identifier: Apache-2.0

import { useState } from "react";
import { Choice } from "../../design/Choice";
import { tr } from "../../language/text";
import type { Scope } from "./scope";
import { freeLook, PLOTS_MAX, type Setup, type TraceSetup, traceId } from "./setup";

/** Menu of a trace: hide it, fix its scale, derive other traces from it, remove it. */
export function TraceMenu(props: { scope: Scope; trace: TraceSetup; setup: Setup }) {
  const { scope, trace, setup } = props;
  const [open, setOpen] = useState(false);
  const id = traceId(trace);
  const change = (next: Partial<TraceSetup>) =>
    scope.change((before) => ({ ...before, traces: before.traces.map((one) => (traceId(one) === id ? { ...one, ...next } : one)) }));
  const add = (derive: TraceSetup["derive"]) => {
    const made: TraceSetup = {
      channel: trace.channel,
      component: trace.component,
      look: freeLook(setup.traces),
      ...(derive && { derive }),
    };
    if (!setup.traces.some((one) => traceId(one) === traceId(made))) scope.change({ ...setup, traces: [...setup.traces, made] });
    setOpen(false);
  };
  const others = setup.traces.filter((one) => !one.derive && one.component !== null && traceId(one) !== id);
  return (
    <div className="trace-menu">
      <button type="button" className="plain" aria-expanded={open} onClick={() => setOpen(!open)}>
        {tr("scope.more")}
        <span className="unseen"> {tr("scope.forId", { id })}</span>
      </button>
      <button
        type="button"
        className="plain"
        onClick={() =>
          scope.change({ ...setup, traces: setup.traces.filter((one) => traceId(one) !== id), xy: setup.xy === id ? null : setup.xy })
        }
      >
        <span aria-hidden="true">×</span>
        <span className="unseen">{tr("scope.removeId", { id })}</span>
      </button>
      {open && (
        <div className="more row">
          <button type="button" aria-pressed={trace.hidden === true} onClick={() => change({ hidden: !trace.hidden })}>
            {trace.hidden ? tr("scope.show") : tr("scope.hide")}
          </button>
          <Choice
            label={tr("scope.plot")}
            value={String(trace.plot ?? 0)}
            title={tr("scope.plotsAreStackedAndShareOne")}
            put={(plot) => change({ plot: Number(plot) })}
          >
            {Array.from({ length: Math.min(PLOTS_MAX, Math.max(...setup.traces.map((one) => one.plot ?? 0)) + 2) }, (_, plot) => (
              // biome-ignore lint/suspicious/noArrayIndexKey: the number is what it is
              <option key={plot} value={plot}>
                {plot + 1}
              </option>
            ))}
          </Choice>
          <RangeFields trace={trace} change={change} />
          {!trace.derive && trace.component !== null && (
            <button type="button" onClick={() => add({ kind: "derivative" })}>
              {tr("scope.derivative")}
            </button>
          )}
          {!trace.derive && others.length > 0 && (
            <Choice
              label={tr("scope.subtract")}
              value=""
              put={(chosen) => {
                const other = others.find((one) => traceId(one) === chosen);
                if (other) add({ kind: "difference", less: { channel: other.channel, component: other.component ?? "" } });
              }}
            >
              <option value="">{tr("scope.chooseATrace")}</option>
              {others.map((one) => (
                <option key={traceId(one)}>{traceId(one)}</option>
              ))}
            </Choice>
          )}
        </div>
      )}
    </div>
  );
}

function RangeFields(props: { trace: TraceSetup; change: (next: Partial<TraceSetup>) => void }) {
  const { trace, change } = props;
  const [low, setLow] = useState(trace.range ? String(trace.range[0]) : "");
  const [high, setHigh] = useState(trace.range ? String(trace.range[1]) : "");
  const lo = Number(low);
  const hi = Number(high);
  const whole = low.trim() !== "" && high.trim() !== "" && Number.isFinite(lo) && Number.isFinite(hi) && lo < hi;
  return (
    <form
      className="row"
      onSubmit={(event) => {
        event.preventDefault();
        if (whole) change({ range: [lo, hi] });
      }}
    >
      <label className="field">
        <span className="name">{tr("scope.scaleFrom")}</span>
        <input
          className="figure-field"
          inputMode="decimal"
          value={low}
          placeholder={tr("scope.auto")}
          onChange={(event) => setLow(event.target.value)}
        />
      </label>
      <label className="field">
        <span className="name">{tr("scope.to")}</span>
        <input
          className="figure-field"
          inputMode="decimal"
          value={high}
          placeholder={tr("scope.auto")}
          onChange={(event) => setHigh(event.target.value)}
        />
      </label>
      <button type="submit" disabled={!whole}>
        {tr("scope.fix")}
      </button>
      {trace.range && (
        <button type="button" onClick={() => change({ range: undefined } as unknown as Partial<TraceSetup>)}>
          {tr("scope.automatic")}
        </button>
      )}
    </form>
  );
}
