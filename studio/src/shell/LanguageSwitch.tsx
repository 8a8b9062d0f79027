// SPDX-License-Identifier: Apache-2.0
import { chosenLanguage, keepLanguage, LANGUAGES, type Language } from "../language/language";
import { tr } from "../language/text";
import { reload } from "./cutOff";

/** Selection of the page's language. */
export function LanguageSwitch() {
  return (
    <label className="theme">
      <span className="quiet small">{tr("language.language")}</span>
      <select
        aria-label={tr("language.language")}
        value={chosenLanguage() ?? ""}
        onChange={(event) => {
          keepLanguage((event.target.value || null) as Language | null);
          reload();
        }}
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
