// SPDX-License-Identifier: Apache-2.0
import { tr } from "../language/text";
import { useWatched } from "./context";
import { setTheme, type Theme, theme } from "./theme";

export function ThemeSwitch() {
  const now = useWatched(theme);
  return (
    <label className="theme">
      <span className="quiet small">{tr("shell.colours")}</span>
      <select aria-label={tr("shell.colours")} value={now} onChange={(event) => setTheme(event.target.value as Theme)}>
        <option value="system">{tr("language.automatic")}</option>
        <option value="light">{tr("shell.light")}</option>
        <option value="dark">{tr("shell.dark")}</option>
        <option value="contrast">{tr("shell.highContrast")}</option>
      </select>
    </label>
  );
}
