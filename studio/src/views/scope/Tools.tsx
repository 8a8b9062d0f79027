// SPDX-License-Identifier: Apache-2.0

import { Choice } from "../../design/Choice";
import { Refusals, Tag } from "../../design/parts";
import { tr } from "../../language/text";
import { useAction, useWatched } from "../../shell/context";
import { BesideTools } from "./BesideTools";
import { SPANS_S, toggleCursors } from "./gestures";
import type { Format } from "./messages";
import { SpectrumTools } from "./SpectrumTools";
import type { Scope } from "./scope";
import { EMPTY, type ScaleMode, traceId } from "./setup";
import type { SpectrumSetup } from "./signal/spectrum";
import type { SweepMode } from "./signal/sweep";
import { secondsText } from "./signal/table";

const SWEEPS: { value: SweepMode; text: string; about: string }[] = [
  { value: "roll", text: tr("scope.roll"), about: tr("scope.theNewestValuesWithoutATrigger") },
  { value: "auto", text: tr("scope.auto"), about: tr("scope.fromTriggerToTriggerTheNewest") },
  { value: "normal", text: tr("scope.normal"), about: tr("scope.fromTriggerToTriggerTheLast") },
  { value: "single", text: tr("scope.single"), about: tr("scope.theNextTriggerThenStop") },
];

const SCALES: { value: ScaleMode; text: string }[] = [
  { value: "unit", text: tr("scope.byUnit") },
  { value: "own", text: tr("scope.oneEach") },
  { value: "lanes", text: tr("scope.lanes") },
];

/** Value that selects frequency as the x axis; it cannot be the name of a trace. */
const FREQUENCY = "=frequency";
const SPECTRUM: SpectrumSetup = { window: "hann", amount: "amplitude", to_hz: null };

/** Toolbar above the screen: state of the scope. */
export function Tools(props: { scope: Scope }) {
  const { scope } = props;
  const setup = useWatched(scope.setup);
  const stopped = useWatched(scope.stopped);
  const status = useWatched(scope.status);
  const cursors = useWatched(scope.cursors);
  const window = useWatched(scope.window);
  // The time on the screen, also after a zoom, and for a whole recording.
  const shown_s = window ? Number(((window.to_ns - window.from_ns) / 1e9).toPrecision(4)) : setup.span_s;
  return (
    <div className="scope-tools row" role="toolbar" aria-label={tr("scope.scope")}>
      {!scope.past && (
        <>
          <button type="button" aria-pressed={stopped} onClick={() => scope.stop(!stopped)} title={tr("scope.spaceOnTheScreen")}>
            {stopped ? tr("scope.run") : tr("scope.stop")}
          </button>
          <Choice
            label={tr("scope.sweep")}
            value={setup.sweep}
            title={SWEEPS.find((one) => one.value === setup.sweep)?.about}
            put={(chosen) => scope.change({ ...setup, sweep: chosen as SweepMode })}
          >
            {SWEEPS.map(({ value, text }) => (
              <option key={value} value={value}>
                {text}
              </option>
            ))}
          </Choice>
          {setup.sweep === "single" && (
            <button type="button" className={status.state === "stopped" ? "primary" : ""} onClick={() => scope.arm()}>
              {tr("scope.arm")}
            </button>
          )}
          <State scope={scope} />
        </>
      )}
      <Choice label={tr("scope.time")} value={String(shown_s)} put={(chosen) => scope.showSpan(Number(chosen))}>
        {[...new Set([...SPANS_S, shown_s])]
          .sort((a, b) => a - b)
          .map((span) => (
            <option key={span} value={span}>
              {span < 1 ? `${Number((span * 1e3).toPrecision(6))} ms` : `${span} s`}
            </option>
          ))}
      </Choice>
      <Choice label={tr("scope.scales")} value={setup.scales} put={(chosen) => scope.change({ ...setup, scales: chosen as ScaleMode })}>
        {SCALES.map(({ value, text }) => (
          <option key={value} value={value}>
            {text}
          </option>
        ))}
      </Choice>
      <Choice
        label={tr("scope.xAxis")}
        value={setup.spectrum ? FREQUENCY : (setup.xy ?? "")}
        put={(chosen) => {
          // Cursors exist only on a time axis.
          if (chosen !== "") scope.cursors.set(null);
          const xy = chosen === "" || chosen === FREQUENCY ? null : chosen;
          scope.change({ ...setup, xy, spectrum: chosen === FREQUENCY ? SPECTRUM : null });
        }}
      >
        <option value="">{tr("scope.time2")}</option>
        <option value={FREQUENCY}>{tr("scope.frequency")}</option>
        {setup.traces.map((trace) => (
          <option key={traceId(trace)}>{traceId(trace)}</option>
        ))}
      </Choice>
      {setup.spectrum && <SpectrumTools scope={scope} setup={setup} of={setup.spectrum} />}
      <button
        type="button"
        aria-pressed={setup.steps}
        title={tr("scope.holdsEachValueUntilTheNext")}
        onClick={() => scope.change({ ...setup, steps: !setup.steps })}
      >
        {tr("scope.steps")}
      </button>
      <button
        type="button"
        aria-pressed={cursors !== null}
        disabled={setup.xy !== null || setup.spectrum !== null}
        onClick={() => toggleCursors(scope)}
      >
        {tr("scope.cursors")}
      </button>
      {scope.past ? (
        <BesideTools scope={scope} past={scope.past} />
      ) : (
        <button
          type="button"
          aria-pressed={status.has_reference}
          title={tr("scope.keepsThePresentScreenBehindNew")}
          onClick={() => scope.reference(!status.has_reference)}
        >
          {tr("scope.reference")}
        </button>
      )}
      {stopped && (
        <button type="button" onClick={() => scope.fit()} title={tr("scope.homeOrADoubleClickOn")}>
          {scope.past ? tr("scope.whole") : tr("scope.fit")}
        </button>
      )}
      <Export scope={scope} />
    </div>
  );
}

function State(props: { scope: Scope }) {
  const status = useWatched(props.scope.status);
  const stopped = useWatched(props.scope.stopped);
  const isBlind = useWatched(props.scope.setup).trigger === null;
  return (
    <span role="status" className="state">
      {stopped ? (
        <Tag tone="warn">{tr("scope.stopped")}</Tag>
      ) : status.state === "rolling" ? (
        <Tag tone="good">{tr("scope.rolling")}</Tag>
      ) : status.state === "waiting" ? (
        <Tag tone={isBlind ? "warn" : "accent"}>
          {isBlind
            ? tr("scope.waitingButNoTriggerIsSet")
            : status.triggers === 0
              ? tr("scope.waitingForTrigger")
              : tr("scope.triggeredTriggersWaiting", { triggers: status.triggers })}
        </Tag>
      ) : status.state === "collecting" ? (
        <Tag tone="good">{tr("scope.triggered")}</Tag>
      ) : (
        <Tag tone="warn">{tr("scope.complete")}</Tag>
      )}
    </span>
  );
}

function Export(props: { scope: Scope }) {
  const { scope } = props;
  const action = useAction();
  const save = (format: Format) =>
    action.run(async () => {
      const blob = await scope.export(format);
      const from = secondsText(Math.round(scope.span?.from_ns ?? 0)).replace(/(\.\d{3}).*/, "$1");
      download(blob, `scope-${from}s.${format}`);
    });
  const nothing = useWatched(scope.setup).traces.length === EMPTY.traces.length;
  return (
    <>
      <button
        type="button"
        disabled={action.busy || nothing}
        onClick={() => save("csv")}
        title={tr("scope.allValuesInTheDisplayedInterval")}
      >
        CSV
      </button>
      <button
        type="button"
        disabled={action.busy || nothing}
        onClick={() => save("mcap")}
        title={tr("scope.allValuesInTheDisplayedIntervalFor")}
      >
        MCAP
      </button>
      <button type="button" disabled={action.busy || nothing} onClick={() => save("svg")} title={tr("scope.theScreenAsVectorGraphicsFor")}>
        SVG
      </button>
      <Refusals of={action.refusals} />
    </>
  );
}

function download(blob: Blob, name: string): void {
  const address = URL.createObjectURL(blob);
  const link = document.createElement("a");
  link.href = address;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}
