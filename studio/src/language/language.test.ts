// SPDX-License-Identifier: Apache-2.0
import { readdirSync, readFileSync } from "node:fs";
import path from "node:path";
import { afterEach, expect, test } from "vitest";
import { texts as de } from "./de";
import { en } from "./en";
import { languageOf } from "./language";
import { literalTexts } from "./lint";
import { trNodes } from "./nodes";
import { type Key, type Message, placeholdersOf, setTexts, tr, trWord } from "./text";

const SOURCE = path.resolve(import.meta.dirname, "..");
const MODULES = readdirSync(SOURCE, { recursive: true, encoding: "utf8" })
  .filter((file) => /\.tsx?$/.test(file) && !/\.test\.ts$|^language|shapes\.ts$/.test(file))
  .map((file) => ({ file, text: readFileSync(path.join(SOURCE, file), "utf8") }));

/** Modules with prose that is not translated, each with the reason. */
const EXCEPTIONS: Record<string, string> = {
  "control/wording.ts": "patterns of the system's messages, which are in English",
  "help/topics.ts": "headings of the docs, which are in English",
  "views/scope/signal/frame.ts": "damage of a frame, for the author of a system",
  "views/scope/signal/mcap.ts": "metadata of files for other programs",
  "views/scope/worker/scales.ts": "names of scales, which are not shown",
};

/** Texts that are not shown to a person, or that come from or are sent to the system. */
const SENT = [
  // Quoted in messages of the system.
  "part '{}'",
  // Faults of the page itself.
  "this part of the page has no connected system",
  "index.html has no element 'studio'",
  // Cause of an emergency stop, and classes of verbs.
  "pressed in the studio{}",
  "acts on devices",
  "supports devices",
];

afterEach(() => setTexts(en, "en"));

test("a text has values at its placeholders, and the form of its number", () => {
  expect(tr("shell.acknowledge")).toBe("Acknowledge");
  expect(tr("shell.takeFromHolder", { holder: "panel" })).toBe("Take from panel");
  expect([1, 2, 0].map((count) => tr("shell.countAlarmsAreShelved", { count }))).toEqual([
    "1 alarm is shelved",
    "2 alarms are shelved",
    "0 alarms are shelved",
  ]);
  // Braces of JSON are no placeholders.
  expect(tr("workspaces.buttonsOnePerLineLabelINSTANCE")).toContain('{"input": value}');
});

test("another language has its own order of words, and unknown words of the system stay", () => {
  setTexts(de, "de");
  expect(tr("shell.takeFromHolder", { holder: "panel" })).toBe("Von panel übernehmen");
  expect(tr("shell.countAlarmsAreShelved", { count: 1 })).toBe("1 Alarm ist zurückgestellt");
  expect(trWord("standstill")).toBe("Stillstand");
  expect(trWord("warp")).toBe("warp");
  expect(trNodes("shell.keysKbd", { kbd: "?" })).toMatchObject({ props: { children: ["Tasten ", "?", ""] } });
});

test("the language is the first of the browser's that the page has", () => {
  expect(languageOf(["fr-FR", "de-AT", "en"])).toBe("de");
  expect(languageOf(["fr"])).toBe("en");
  expect(languageOf([])).toBe("en");
});

test("texts of all languages have the same placeholders", () => {
  const keys = Object.keys(en) as Key[];
  const different = keys.filter((key) => String(placeholdersOf(en[key])) !== String(placeholdersOf(de[key])));
  expect(different).toEqual([]);
  const blank = keys.filter((key) => Object.values(formsOf(de[key])).some((text) => text.trim() === "" || text !== text.trim()));
  expect(blank).toEqual([]);
});

/** Words after a number that are the same for one and for several, in both languages. */
const UNCHANGED = new Set([
  "shell.countTimes",
  "shell.andCountMore",
  "flow.countFound",
  "log.timesTimesFirstAtFirstS",
  "log.newerNewer",
  "recordings.lostLost",
  "scope.hzOfCountValuesAtRate",
  "scope.lostLost",
  "scope.lostLostSkippedDiscarded",
  "scope.skippedDiscardedScopeStopped",
  "scope.stoppedSkippedDiscarded",
  "start.enabledEnabled",
  "start.faultsInFault",
  "system.countRaised",
]);

test("a word that follows a number has its plural forms", () => {
  const NUMBER = /\{(count|times|firings|lost|skipped|held|newer|enabled|faults|slew_limited)\} \p{L}/u;
  const keys = (Object.keys(en) as Key[]).filter((key) => [en[key], de[key]].some((text) => typeof text === "string" && NUMBER.test(text)));
  expect(keys.sort()).toEqual([...UNCHANGED].sort());
  setTexts(de, "de");
  expect([1, 2].map((count) => tr("verbs.countRunning", { count }))).toEqual(["läuft", "2 laufen"]);
  expect([1, 2].map((count) => tr("system.countMissing", { count }))).toEqual(["1 fehlt", "2 fehlen"]);
});

test("every text is used", () => {
  const all = MODULES.map((module) => module.text).join("\n");
  const templates = [...all.matchAll(/tr(?:Nodes)?\(`([\w.]+)\$\{/g)].map(([, begin = ""]) => begin);
  const unused = Object.keys(en).filter(
    (key) => !key.startsWith("words.") && !all.includes(`"${key}"`) && !templates.some((begin) => key.startsWith(begin)),
  );
  expect(unused).toEqual([]);
});

test("the lint finds texts in JSX, in attributes and in modules", () => {
  const source = [
    'const a = <p title="Hello" className="big red">{on ? "yes" : tr("x.y")} of <code>gpac.run</code> 5 ms</p>;',
    'const b = { message: "no such thing" };',
  ].join("\n");
  expect(literalTexts("a.tsx", source)).toEqual([
    { line: 1, text: "Hello", isShown: true },
    { line: 1, text: "yes", isShown: true },
    { line: 1, text: " of ", isShown: true },
    { line: 2, text: "no such thing", isShown: false },
  ]);
});

test("no text is outside of the files of languages", () => {
  const found = MODULES.filter(({ file }) => !(file in EXCEPTIONS)).flatMap(({ file, text }) =>
    literalTexts(file, text)
      .filter((one) => !SENT.includes(one.text))
      .map((one) => `${file}:${one.line}: ${one.text}`),
  );
  expect(found).toEqual([]);
});

function formsOf(message: Message): Record<string, string> {
  return typeof message === "string" ? { other: message } : { ...message };
}

test("no text of a language is compared, or is a property that identifies something", () => {
  // The ids of ports were translated, so no wire was drawn on a German page.
  const looked = /\b(?:\w*Handle|id|kind|channel|component|svv|topic): tr\(|(?:===|!==) tr\(|\btr\([^()]*\) (?:===|!==)/;
  expect(looked.test('sourceHandle: tr("flow.outputPort", { port }),')).toBe(true);
  expect(MODULES.filter(({ text }) => looked.test(text)).map(({ file }) => file)).toEqual([]);
});
