// SPDX-License-Identifier: Apache-2.0
// Random actions in the editor: buttons, fields, choices, keys, boxes and wires with the mouse, chosen by a seed.
import type { Page } from "playwright-core";

/** Returns pseudo-random numbers from 0 up to 1, the same for the same seed. */
export function randomOf(seed: number): () => number {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let mixed = Math.imul(state ^ (state >>> 15), state | 1);
    mixed ^= mixed + Math.imul(mixed ^ (mixed >>> 7), mixed | 61);
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
  };
}

/** Texts to type: names, numbers, times, lists, and values that no field accepts. */
const TEXTS = [
  "",
  "x",
  "gain",
  "near",
  "wave.y",
  "side.rose, side.fell",
  "constructor",
  "__proto__",
  "a.b",
  "ünit \"'",
  "1",
  "-3.5",
  "1e400",
  "1,5",
  "[1, 2",
  "[1, 2]",
  "true",
  "20 ms",
  "0.5 s",
  "rad",
];
const KEYS = [
  "Delete",
  "Backspace",
  "Escape",
  "Tab",
  "Shift+Tab",
  "Enter",
  "ArrowRight",
  "ArrowDown",
  "Control+z",
  "Control+z",
  "Control+y",
  "Control+f",
];
const COPYING = ["Control+a", "Control+c", "Control+v", "Control+x", "Control+d"];

/** Location of a selected element; null if there is none or it is covered. */
interface Spot {
  what: string;
  x: number;
  y: number;
}

/** Selects one of the elements by `part`, from 0 up to 1, scrolls it into view, and returns its location. */
async function spot(page: Page, selector: string, part: number): Promise<Spot | null> {
  return await page.evaluate(
    ([selector, part]) => {
      // Controls that change the running system or ask for a file do not belong to the draft.
      const isOthers = (element: Element) =>
        element.closest("section")?.querySelector("h2")?.textContent === "Install" || (element as HTMLInputElement).type === "file";
      const all = [...document.querySelectorAll<HTMLElement>(selector)].filter(
        (element) => !(element as HTMLButtonElement).disabled && !isOthers(element),
      );
      const element = all[Math.floor(part * all.length)];
      if (!element) return null;
      if (!element.closest(".react-flow")) element.scrollIntoView({ block: "nearest" });
      const { x, y, width, height } = element.getBoundingClientRect();
      const at = { x: x + width / 2, y: y + height / 2 };
      const there = document.elementFromPoint(at.x, at.y);
      if (!there || !(element.contains(there) || there.contains(element))) return null;
      const name = element.getAttribute("aria-label") ?? element.dataset.port ?? element.dataset.box ?? element.textContent ?? "";
      return { what: `${element.tagName.toLowerCase()} '${name.slice(0, 60)}'`, ...at };
    },
    [selector, part] as const,
  );
}

const EDITOR = ".flow.editing";

/** Performs one action; returns its description. */
export async function act(page: Page, random: () => number): Promise<string> {
  const pick = <T>(of: readonly T[]): T => of[Math.floor(random() * of.length)] as T;
  const [kind, part, other] = [random(), random(), random()];
  const click = async (selector: string) => {
    const at = await spot(page, selector, part);
    if (!at) return `nothing to click among ${selector}`;
    await page.mouse.click(at.x, at.y);
    return `click ${at.what}`;
  };
  const drag = async (from: Spot, to: { x: number; y: number }, what: string) => {
    await page.mouse.move(from.x, from.y);
    await page.mouse.down();
    await page.mouse.move((from.x + to.x) / 2, (from.y + to.y) / 2, { steps: 2 });
    await page.mouse.move(to.x, to.y, { steps: 2 });
    await page.mouse.up();
    return what;
  };
  if (kind < 0.1) return await click(`${EDITOR} .tools button`);
  if (kind < 0.2) return await click(`${EDITOR} .palette button[data-component]`);
  if (kind < 0.35) return await click(`${EDITOR} > .side:not(.palette) button`);
  if (kind < 0.4) return await click(`${EDITOR} .side input[type="checkbox"]`);
  if (kind < 0.55) {
    const at = await spot(page, `${EDITOR} input:not([type="checkbox"], [type="search"])`, part);
    if (!at) return "no field";
    const [text, key] = [pick(TEXTS), pick(["Enter", "Tab", "Escape", "Enter"])];
    await page.mouse.click(at.x, at.y, { clickCount: 3 });
    if (text === "") await page.keyboard.press("Delete");
    else await page.keyboard.insertText(text);
    await page.keyboard.press(key);
    return `'${text}' and ${key} into ${at.what}`;
  }
  if (kind < 0.63) {
    return await page.evaluate(
      ([editor, part, other]) => {
        const all = [...document.querySelectorAll<HTMLSelectElement>(`${editor} select`)].filter(
          (one) => one.closest("section")?.querySelector("h2")?.textContent !== "Install",
        );
        const select = all[Math.floor(part * all.length)];
        if (!select) return "no choice";
        select.focus();
        const option = select.options[Math.floor(other * select.options.length)];
        if (!option) return "no option";
        select.value = option.value;
        select.dispatchEvent(new Event("change", { bubbles: true }));
        return `choose '${option.value}' of '${select.ariaLabel}'`;
      },
      [EDITOR, part, other] as const,
    );
  }
  if (kind < 0.71) {
    const key = pick(random() < 0.5 ? KEYS : COPYING);
    await page.keyboard.press(key);
    return `press ${key}`;
  }
  if (kind < 0.75) return await click(`${EDITOR} .react-flow__node`);
  // Into a graph and back; the offers for a wire that ends nowhere; the search results.
  if (kind < 0.77) return await click(`${EDITOR} .box .opens`);
  if (kind < 0.79) return await click(`${EDITOR} .way button, ${EDITOR} .offer [role="option"], ${EDITOR} .find-corner button`);
  if (kind < 0.82) return await click(`${EDITOR} .react-flow__edge-interaction`);
  if (kind < 0.88) {
    const at = await spot(page, `${EDITOR} .react-flow__node`, part);
    if (!at) return "no box";
    return await drag(at, { x: at.x + 200 * (other - 0.5), y: at.y + 200 * (random() - 0.5) }, `drag ${at.what}`);
  }
  const from = await spot(page, `${EDITOR} .react-flow__handle`, part);
  if (!from) return "no port";
  const to = random() < 0.8 ? await spot(page, `${EDITOR} .react-flow__handle`, other) : null;
  return await drag(
    from,
    to ?? { x: from.x + 150 * (other - 0.5), y: from.y + 60 },
    `a wire from ${from.what} to ${to?.what ?? "nothing"}`,
  );
}
