// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { arrowsOf } from "../../verbs/shape";
import { layOut } from "../../verbs/states";
import * as composed from "./composed";
import { type ComposedDefinition, newComposition, type Part } from "./definition";
import { draftsOf, fileText, savedFile } from "./file";
import { draftOf } from "./reading";

const verb = (name: string): Part =>
  draftOf("verb", name, {
    blocks: { ramp: "press.ramp", stop: "press.stop_at" },
    objects: { slide: "Slide" },
    instantiation_parameters: { "slide.speed": "ramp.speed", "slide.position": "stop.position" },
    input_parameters: { to: { targets: "stop.there", unit: "m" } },
    output_values: { reached: "stop.reached" },
    command_lists: { start: [{ activate: "ramp", every: "1 ms" }] },
    conditions: { there: { on: "stop.there", returns: "reached" } },
  }) as Part;
const parts = { approach: verb("approach"), insert: verb("insert") };

function press(): ComposedDefinition {
  let made = newComposition("press", parts);
  for (const name of ["approach", "insert"]) made = composed.addPart(made, name).composed;
  made = composed.setStep(made, 0, composed.drawnStep(made, "approach", "insert"));
  made = composed.setRename(made, "approach.to", "contact");
  return composed.setRename(made, "insert.to", "depth");
}

test("parts are states around their lists, and a transition between parts ends nothing where it leads on", async () => {
  const shape = composed.shapeOfComposition(press());
  expect(shape.parts).toEqual([
    { name: "approach", about: "approach", within: null },
    { name: "insert", about: "insert", within: null },
  ]);
  expect(shape.lists.map(({ name, part }) => [name, part])).toEqual([
    ["approach.start", "approach"],
    ["insert.start", "insert"],
  ]);
  const arrows = arrowsOf(shape).map(({ from, to, conditions }) => [from, to, conditions.map(({ name }) => name)]);
  expect(arrows).toEqual([
    ["approach", "insert", ["there"]],
    ["insert.start", null, ["there"]],
  ]);
  const laid = await layOut(shape);
  expect(laid.boxes.filter(({ kind }) => kind === "part").map(({ name }) => name)).toEqual(["approach", "insert"]);
  expect(laid.boxes.find(({ name }) => name === "insert.start")?.within).toBe("insert");
  // A part is only as high as its content.
  const height = (name: string) => laid.boxes.find((box) => box.name === name)?.height ?? 0;
  expect(height("approach")).toBe(height("approach.start") + 34 + 14);
  expect(laid.arrows).toHaveLength(3);
});

test("a part with another label, or none: what names it follows, or goes", () => {
  const made = composed.setPreset(press(), "insert.to", 0.1);
  const renamed = composed.renamePart(made, "insert", "into").of;
  expect(renamed.parts).toEqual({ approach: "approach", into: "insert" });
  expect(renamed.transitions).toEqual([{ from: ["approach"], condition: "there", to: "into" }]);
  expect(renamed.rename).toEqual({ "approach.to": "contact", "into.to": "depth" });
  expect(renamed.preset).toEqual({ "into.to": 0.1 });
  const left = composed.removePart(made, "insert").of;
  expect([left.parts, left.transitions, left.rename, left.preset]).toEqual([
    { approach: "approach" },
    [],
    { "approach.to": "contact" },
    {},
  ]);
});

test("what a composition is made of has its names there, in compositions of compositions too", () => {
  const { of } = press();
  const outer: ComposedDefinition = {
    kind: "composition",
    of: { ...of, name: "twice", parts: { one: "press", two: "insert" }, rename: {} },
    made_of: { ...parts, press: { kind: "composition", of } },
  };
  expect(composed.namesOf(composed.partOf(outer, "one"), outer.made_of)).toEqual({
    objects: ["slide"],
    parameters: [],
    inputs: ["contact", "depth"],
    outputs: ["reached"],
    conditions: ["there"],
  });
  expect(composed.shapeOfComposition(outer).parts.map(({ name, within }) => [name, within])).toEqual([
    ["one", null],
    ["one.approach", "one"],
    ["one.insert", "one"],
    ["two", null],
  ]);
  // A cyclic composition must terminate.
  const round: ComposedDefinition = {
    ...outer,
    made_of: { ...outer.made_of, press: { kind: "composition", of: { ...of, parts: { again: "press" } } } },
  };
  expect(composed.shapeOfComposition(round).parts.length).toBeLessThan(50);
});

test("a composition is saved with its parts, opened as it was, and a file that has it changes there only", () => {
  const made = press();
  const text = fileText(made);
  const [again] = draftsOf(text);
  expect(again).toMatchObject(made);
  const file = { name: "press.json", text };
  expect(savedFile(again as ComposedDefinition, file)).toMatchObject({ text, said: "nothing was changed in the file" });

  const toml = `format = "opengpac-definitions"
version = 1

[verbs.approach]
blocks = { ramp = "press.ramp" }   # rises
command_lists = { start = [{ activate = "ramp", every = "1 ms" }] }

# From part to part.
[compositions.press]
parts = { first = "approach", then = "approach" }
transitions = [{ from = "first", condition = "there", to = "then" }] # goes on
`;
  const opened = draftsOf(toml)[0] as ComposedDefinition;
  const saved = savedFile(composed.setRename(opened, "then.to", "depth"), { name: "press.toml", text: toml });
  expect(saved.name).toBe("press.toml");
  expect(saved.text).toBe(`${toml}rename = { "then.to" = "depth" }\n`);
  expect(() => draftsOf(toml.replace('"approach", then', "7, then"))).toThrow("part 'first' of 'press'");
});
