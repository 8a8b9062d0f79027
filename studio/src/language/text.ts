// SPDX-License-Identifier: Apache-2.0
import { en } from "./en";

/**
 * A text in the plural forms of the language, by the categories of `Intl.PluralRules`. The value of the placeholder `{count}` selects
 * the form.
 */
export type Plural = { other: string } & { [form in Intl.LDMLPluralRule]?: string };

/** Text of the page; `{name}` is a placeholder. */
export type Message = string | Plural;

export type Key = keyof typeof en;

/**
 * All texts of the page in one language. It is a type error if a text is missing, or if its type differs from that of the English text.
 */
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

/** Sets the language of all texts that are requested afterwards. */
export function setTexts(next: Texts, name: string): void {
  texts = next;
  language = name;
  plurals = new Intl.PluralRules(name);
}

/** Returns the current language and its texts, for use in a worker. */
export function presentTexts(): { texts: Texts; language: string } {
  return { texts, language };
}

/**
 * Returns a text in the page's language, with its placeholders replaced by values. Null, undefined and Booleans are rendered as nothing,
 * as in React.
 */
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

/** Splits a text in the page's language into its parts, with the placeholders replaced by values. */
export function parts<V>(key: Key, values: { [name: string]: V } | undefined): (V | string)[] {
  const message: Message = texts[key];
  const text = typeof message === "string" ? message : (message[plurals.select(Number(values?.count))] ?? message.other);
  return text.split(PLACEHOLDER).map((part, index) => (index % 2 === 1 && values && part in values ? (values[part] as V) : part));
}

/** Translates a word of the system, such as the state of a device, into the page's language. An unknown word is returned unchanged. */
export function trWord(word: string): string {
  const key = `words.${word}`;
  const found: Message | undefined = Object.hasOwn(texts, key) ? texts[key as Key] : undefined;
  return typeof found === "string" ? found : word;
}
