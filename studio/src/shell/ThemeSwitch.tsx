// SPDX-License-Identifier: Apache-2.0
import { useWatched } from "./context";
import { setTheme, type Theme, theme } from "./theme";

export function ThemeSwitch() {
  const now = useWatched(theme);
  return (
    <label className="theme">
      <span className="quiet small">Colours</span>
      <select aria-label="Colours" value={now} onChange={(event) => setTheme(event.target.value as Theme)}>
        <option value="system">automatic</option>
        <option value="light">light</option>
        <option value="dark">dark</option>
      </select>
    </label>
  );
}
