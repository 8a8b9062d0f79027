// SPDX-License-Identifier: Apache-2.0
import { chooseLanguage, chosenLanguage, LANGUAGES, type Language } from "../language/language";
import { tr } from "../language/text";

/** Choice of the page's language. A reloaded page continues its session, so what runs keeps running. */
export function LanguageSwitch() {
  return (
    <label className="theme">
      <span className="quiet small">{tr("language.language")}</span>
      <select
        aria-label={tr("language.language")}
        value={chosenLanguage() ?? ""}
        onChange={(event) => chooseLanguage((event.target.value || null) as Language | null)}
      >
        <option value="">{tr("language.automatic")}</option>
        {Object.entries(LANGUAGES).map(([language, { name }]) => (
          <option key={language} value={language} lang={language}>
            {name}
          </option>
        ))}
      </select>
    </label>
  );
}
