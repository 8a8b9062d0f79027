// SPDX-License-Identifier: Apache-2.0
import { en } from "./en";

/** Text in each plural form that the language has, of the forms of `Intl.PluralRules`; the placeholder `{count}` selects one. */
export type Plural = { other: string } & { [form in Intl.LDMLPluralRule]?: string };

/** Text of the page; `{name}` is a placeholder. */
export type Message = string | Plural;

export type Key = keyof typeof en;

/** All texts of the page in one language. A text that is missing, or has another form than the English one, is a type error. */
export type Texts = { [K in Key]: (typeof en)[K] extends string ? string : Plural };

/** Names of the placeholders of a text. */
type Names<Text> = Text extends `${string}{${infer Name}}${infer Rest}`
  ? (Name extends `${string}${" " | '"' | ":"}${string}` ? never : Name) | Names<Rest>
  : never;
type NamesOf<K extends Key> = (typeof en)[K] extends string ? Names<(typeof en)[K]> : "count" | Names<(typeof en)[K][keyof (typeof en)[K]]>;

type Value = string | number | boolean | null | undefined;
export type Arguments<K extends Key, V> = [NamesOf<K>] extends [never] ? [] : [values: { [Name in NamesOf<K>]: V }];

let texts: Texts = en;
let language = "en";
let plurals = new Intl.PluralRules(language);

/** Sets the language of all texts that are requested later. */
export function setTexts(next: Texts, name: string): void {
  texts = next;
  language = name;
  plurals = new Intl.PluralRules(name);
}

/** Returns the present language and its texts, for a worker. */
export function presentTexts(): { texts: Texts; language: string } {
  return { texts, language };
}

/** Returns a text in the page's language, with values at its placeholders; null, undefined and booleans are shown as nothing, as in React. */
export function tr<K extends Key>(key: K, ...given: Arguments<K, Value>): string {
  return parts<Value>(key, given[0])
    .map((part) => (part === null || part === undefined || typeof part === "boolean" ? "" : String(part)))
    .join("");
}

const PLACEHOLDER = /\{(\w+)\}/;

/** Names of the placeholders of a text, in alphabetical order. */
export function placeholdersOf(message: Message): string[] {
  const found = Object.values(typeof message === "string" ? [message] : message).flatMap((text) => [
    ...text.matchAll(new RegExp(PLACEHOLDER, "g")),
  ]);
  return [...new Set(found.map(([, name = ""]) => name))].sort();
}

/** Returns the parts of a text in the page's language, with values at its placeholders. */
export function parts<V>(key: Key, values: { [name: string]: V } | undefined): (V | string)[] {
  const message: Message = texts[key];
  const text = typeof message === "string" ? message : (message[plurals.select(Number(values?.count))] ?? message.other);
  return text.split(PLACEHOLDER).map((part, index) => (index % 2 === 1 && values && part in values ? (values[part] as V) : part));
}

/** Returns a word of the system, such as the state of a device, in the page's language; a word that the page does not know is returned as it is. */
export function trWord(word: string): string {
  const key = `words.${word}`;
  const found: Message | undefined = Object.hasOwn(texts, key) ? texts[key as Key] : undefined;
  return typeof found === "string" ? found : word;
}
