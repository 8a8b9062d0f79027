// SPDX-License-Identifier: Apache-2.0
// The page's language: chosen with the switch and kept in the browser, otherwise that of the browser. Module constants contain texts, so
// the language is set before any other module of the page is loaded, and a change takes effect when the page is loaded again.
import { setTexts, type Texts } from "./text";

/** Languages of the page, each with its native name and the file that contains its texts. The English texts are built in. */
export const LANGUAGES = {
  en: { name: "English", load: null },
  de: { name: "Deutsch", load: () => import("./de").then((file): Texts => file.texts) },
} as const;

export type Language = keyof typeof LANGUAGES;

const KEY = "opengpac.language";

function isLanguage(name: string | null | undefined): name is Language {
  return typeof name === "string" && Object.hasOwn(LANGUAGES, name);
}

/** Returns the language chosen with the switch; null if the page follows the browser's language. */
export function chosenLanguage(): Language | null {
  const kept = localStorage.getItem(KEY);
  return isLanguage(kept) ? kept : null;
}

/** Returns the first of the browser's languages that the page supports, or English. */
export function languageOf(wanted: readonly string[]): Language {
  return wanted.map((name) => name.toLowerCase().split("-")[0]).find(isLanguage) ?? "en";
}

/**
 * Loads the texts of the page's language, and sets the language of the document. If the texts cannot be loaded, the page is shown in
 * English.
 */
export async function applyLanguage(): Promise<void> {
  const language = chosenLanguage() ?? languageOf(navigator.languages);
  const load = LANGUAGES[language].load;
  const texts = load === null ? null : await load().catch(() => null);
  if (texts) setTexts(texts, language);
  document.documentElement.lang = texts ? language : "en";
}

/** Stores the chosen language (null for that of the browser) for the next load of the page. */
export function keepLanguage(next: Language | null): void {
  if (next === null) localStorage.removeItem(KEY);
  else localStorage.setItem(KEY, next);
}
