// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { found, score } from "../../design/fuzzy";
import { colourOf, patternOf } from "./looks";
import { channelsOf, checked, EMPTY, fromLink, plotsOf, type Setup, toLink, traceId, withChannel, withFormula } from "./setup";

const NAMES = ["ur5e.shoulder_pan.sensed", "ur5e.shoulder_pan.reference", "ur5e.shoulder_lift.sensed", "ur5e.elbow.sensed", "override"];

test("a few letters find a value", () => {
  expect(found("panse", NAMES, 5)[0]).toBe("ur5e.shoulder_pan.sensed");
  expect(found("else", NAMES, 5)[0]).toBe("ur5e.elbow.sensed");
  expect(found("spr", NAMES, 5)[0]).toBe("ur5e.shoulder_pan.reference");
  expect(found("ov", NAMES, 5)[0]).toBe("override");
  expect(found("xyz", NAMES, 5)).toEqual([]);
  expect(found("", NAMES, 3)).toHaveLength(3);
});

test("letters must stand in their order, and a long name is found in time", () => {
  expect(score("ba", "ab")).toBeNull();
  expect(score("a".repeat(20), "a_".repeat(200))).not.toBeNull();
});

test("a link says the setup, and gives it back", () => {
  const setup: Setup = {
    ...withChannel(EMPTY, "force", "[2]"),
    sweep: "normal",
    span_s: 0.5,
    trigger: { on: "level", channel: "force", component: "[2]", edge: "falling", level: -1.5, hysteresis: 0.1 },
  };
  expect(fromLink(new URLSearchParams({ setup: toLink(setup) }))).toEqual(setup);
  expect(fromLink(new URLSearchParams({ names: "a,b" }))?.traces.map(traceId)).toEqual(["a", "b"]);
  expect(fromLink(new URLSearchParams())).toBeNull();
});

test.each([
  ['{"traces"', /check that it was copied completely/],
  ["3", /a setup of the scope must be an object/],
  ['{"traces":[{}]}', /trace 1 does not name a channel/],
  ['{"sweep":"fast"}', /'sweep' must be one of roll, auto, normal, single, not 'fast'/],
  ['{"span_s":0}', /'span_s' must be from 0.000001 to 600, not 0/],
])("a link that is wrong says so: %s", (text, words) => {
  expect(() => fromLink(new URLSearchParams({ setup: text }))).toThrow(words);
});

test("all channels that a setup needs are asked for, each once", () => {
  const setup = checked({
    traces: [{ channel: "a" }, { channel: "a", component: "", derive: { kind: "difference", less: { channel: "b", component: "" } } }],
    trigger: { on: "level", channel: "c", component: "", edge: "rising", level: 0, hysteresis: 0 },
  });
  expect(channelsOf(setup)).toEqual(["a", "b", "c"]);
});

test("64 traces all look different", () => {
  const looks = Array.from({ length: 64 }, (_, i) => `${colourOf(i)} ${patternOf(i)}`);
  expect(new Set(looks).size).toBe(64);
});

test("a formula names traces that are on the screen", () => {
  const setup = withChannel(withChannel(EMPTY, "force", "[0]"), "force", "[1]");
  const made = withFormula(setup, "hypot(force[0], force[1])");
  expect(made.traces.at(-1)).toMatchObject({ channel: "force", component: "[0]", look: 2, derive: { kind: "formula" } });
  expect(channelsOf(made)).toEqual(["force"]);
  expect(withFormula(made, "hypot(force[0], force[1])")).toBe(made);
  expect(checked(JSON.parse(toLink(made))).traces).toEqual(made.traces);
  expect(() => withFormula(setup, "force[2] + 1")).toThrow("no trace 'force[2]' is on the screen; choose one of force[0], force[1]");
  const broken = { ...made.traces[2], derive: { kind: "formula", text: "force[0] +", of: [] } };
  expect(() => checked({ ...made, traces: [broken] })).toThrow("invalid at its end");
});

test("traces are in the plots that they name, and a spectrum that is none is refused", () => {
  const traces = [{ channel: "a" }, { channel: "b", plot: 2 }, { channel: "c", plot: 1, hidden: true }];
  const setup = checked({ traces });
  expect(plotsOf(setup)).toEqual([0, 2]);
  expect(plotsOf({ ...setup, scales: "lanes" })).toEqual([0]);
  expect(plotsOf(EMPTY)).toEqual([0]);
  expect(() => checked({ traces: [{ channel: "a", plot: 99 }] })).toThrow(/the plot of trace 1 must be from 0 to 5, not 99/);
  expect(() => checked({ spectrum: { window: "round", amount: "amplitude", to_hz: null } })).toThrow(
    /window function must be one of .*, not 'round'/,
  );
  expect(() => checked({ spectrum: { window: "hann", amount: "amplitude", to_hz: -1 } })).toThrow(/'to_hz' must be more than 0, not -1/);
});
