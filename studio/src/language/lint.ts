// SPDX-License-Identifier: Apache-2.0
// Lint for texts that are written in a component or module instead of the files of the page's languages.
import { parseSync } from "vite";

interface Node {
  type: string;
  start: number;
  end: number;
  [name: string]: unknown;
}

/** Attributes whose text a person sees or hears. */
const VISIBLE = new Set([
  "aria-label",
  "title",
  "placeholder",
  "label",
  "ariaLabel",
  "empty",
  "one",
  "first",
  "limitName",
  "greatest",
  "alt",
]);
/** Elements that contain code or key names, which are not translated. */
const LITERAL = new Set(["code", "kbd", "pre"]);
/** Calls whose arguments are selectors or names, not user-visible text. */
const NAMES = new Set(["querySelector", "querySelectorAll", "matchMedia", "closest", "matches", "setAttribute", "getItem", "setItem"]);
/** Units and symbols, which are not translated. */
const SYMBOL = /^(s|ms|µs|ns|min|h|mm|N|B|MiB|KiB|GiB|TiB|Hz|px|d|dt|x|deg|dB|A|B|CSV|MCAP|SVG)$/;
/** Names, selectors, paths and examples, which are not prose. */
const NAME =
  /^[a-z]+\.[A-Za-z_.]+$|^[a-z]+\(.*\) - 5$|^<|^\d+px |^Bearer |, *(a\[|select)|^arrow |cursor cursor-|^[ML]\{\} |^font-|^\{\}<|^dB re |^\(prefers-/;

/** A hard-coded text, that is, one outside the language files, with its line. */
export interface LiteralText {
  line: number;
  text: string;
  /** True if the text is in JSX and is therefore certainly shown. */
  isShown: boolean;
}

/** Returns the hard-coded texts of a module. */
export function literalTexts(file: string, source: string): LiteralText[] {
  const found: LiteralText[] = [];
  const put = (node: Node, text: string, isShown: boolean) => {
    const words = text.match(/\p{L}+/gu) ?? [];
    if (NAME.test(text.trim()) || words.every((word) => SYMBOL.test(word))) return;
    if (isShown || /\p{L}[\p{L}\p{P}]* [\p{L}{'“(]/u.test(text))
      found.push({ line: source.slice(0, node.start).split("\n").length, text, isShown });
  };
  const walk = (value: unknown, isShown: boolean): void => {
    if (Array.isArray(value)) {
      for (const one of value) walk(one, isShown);
      return;
    }
    const node = value as Node | null;
    if (typeof node?.type !== "string") return;
    const inner = (name: string, shown = false) => walk(node[name], shown);
    switch (node.type) {
      case "ImportDeclaration":
      case "ExportAllDeclaration":
      case "TSTypeAnnotation":
      case "TSTypeAliasDeclaration":
      case "TSInterfaceDeclaration":
      case "TSTypeParameterInstantiation":
      case "TaggedTemplateExpression":
        break;
      case "JSXElement": {
        const opening = node.openingElement as Node;
        walk(opening.attributes, false);
        if (!LITERAL.has(nameOf(opening.name))) inner("children");
        break;
      }
      case "JSXText":
        put(node, String(node.value), true);
        break;
      case "JSXAttribute":
        if (VISIBLE.has(nameOf(node.name))) inner("value", true);
        break;
      case "JSXExpressionContainer":
        inner("expression", true);
        break;
      case "Literal":
        if (typeof node.value === "string") put(node, node.value, isShown);
        break;
      case "TemplateLiteral":
        put(node, (node.quasis as Node[]).map((part) => (part.value as { cooked: string }).cooked).join("{}"), isShown);
        inner("expressions", isShown);
        break;
      case "ConditionalExpression":
        inner("test");
        inner("consequent", isShown);
        inner("alternate", isShown);
        break;
      case "LogicalExpression":
        inner("left", isShown && node.operator !== "&&");
        inner("right", isShown);
        break;
      case "Property":
        if (nameOf(node.key) !== "className") inner("value");
        break;
      case "CallExpression":
        inner("callee");
        if (!NAMES.has(nameOf((node.callee as Node).property) || nameOf(node.callee))) inner("arguments");
        break;
      default:
        for (const [name, child] of Object.entries(node)) if (name !== "type" && typeof child === "object") walk(child, false);
    }
  };
  walk(parseSync(file, source).program, false);
  return found;
}

function nameOf(node: unknown): string {
  const name = (node as Node | null)?.name ?? (node as Node | null)?.value;
  return typeof name === "string" ? name : "";
}
