// SPDX-License-Identifier: Apache-2.0

import { Choice } from "../../design/Choice";
import { tr } from "../../language/text";
import { NumberField } from "./NumberField";
import type { Scope } from "./scope";
import type { Setup } from "./setup";
import { AMOUNTS, type Amount, type SpectrumSetup, WINDOW_FUNCTIONS, type WindowFunction } from "./signal/spectrum";

const WORDS: Record<WindowFunction | Amount, string> = {
  rectangular: tr("scope.rectangular"),
  hann: "Hann",
  hamming: "Hamming",
  blackman: "Blackman",
  flattop: tr("scope.flatTop"),
  amplitude: tr("scope.amplitude"),
  decibel: tr("scope.amplitudeDB"),
  density: tr("scope.powerDensity"),
};

/** Settings of the spectra: their computation and their display. */
export function SpectrumTools(props: { scope: Scope; setup: Setup; of: SpectrumSetup }) {
  const { scope, setup, of } = props;
  const change = (next: Partial<SpectrumSetup>) => scope.change({ ...setup, spectrum: { ...of, ...next } });
  return (
    <>
      <Choice
        label={tr("scope.window")}
        value={of.window}
        title={tr("scope.hannSeparatesFrequenciesFlatTopMeasures")}
        put={(window) => change({ window: window as WindowFunction })}
      >
        {WINDOW_FUNCTIONS.map((name) => (
          <option key={name} value={name}>
            {WORDS[name]}
          </option>
        ))}
      </Choice>
      <Choice label={tr("scope.shows")} value={of.amount} put={(amount) => change({ amount: amount as Amount })}>
        {AMOUNTS.map((name) => (
          <option key={name} value={name}>
            {WORDS[name]}
          </option>
        ))}
      </Choice>
      <NumberField
        label={tr("scope.from")}
        unit="Hz"
        value={of.from_hz ?? 0}
        minimum={0}
        maximum={of.to_hz ?? Number.POSITIVE_INFINITY}
        put={(from_hz) => change({ from_hz })}
      />
      <NumberField
        label={tr("scope.upTo")}
        unit="Hz"
        value={of.to_hz ?? 0}
        minimum={0}
        put={(to_hz) => change({ to_hz: to_hz > 0 ? to_hz : null, ...(to_hz > 0 && to_hz <= (of.from_hz ?? 0) ? { from_hz: 0 } : {}) })}
      >
        <span className="quiet small">{of.to_hz === null ? tr("scope.0All") : ""}</span>
      </NumberField>
      {((of.from_hz ?? 0) > 0 || of.to_hz !== null) && (
        <button type="button" onClick={() => change({ from_hz: 0, to_hz: null })} title={tr("scope.homeOrADoubleClickOn")}>
          {tr("scope.allFrequencies")}
        </button>
      )}
    </>
  );
}
