// SPDX-License-Identifier: Apache-2.0
import { HelpButton } from "./HelpButton";
import { Keys } from "./Keys";
import { addressOf } from "./route";
import { ThemeSwitch } from "./ThemeSwitch";
import { views } from "./views";

export function Navigation(props: { present: string }) {
  return (
    <nav className="navigation" aria-label="Views">
      <ul>
        {views
          .filter((view) => !view.alone)
          .map((view) => (
            <li key={view.name}>
              <a href={addressOf(view.name)} title={view.about} aria-current={view.name === props.present ? "page" : undefined}>
                {view.title}
              </a>
            </li>
          ))}
      </ul>
      <div className="foot">
        <HelpButton view={views.find((view) => view.name === props.present)} />
        <Keys />
        <ThemeSwitch />
      </div>
    </nav>
  );
}
