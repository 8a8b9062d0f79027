// SPDX-License-Identifier: Apache-2.0

import { useEffect, useRef } from "react";
import { tr } from "../language/text";
import { HelpButton } from "./HelpButton";
import { Keys } from "./Keys";
import { LanguageSwitch } from "./LanguageSwitch";
import { addressOf } from "./route";
import { ThemeSwitch } from "./ThemeSwitch";
import { views } from "./views";

/** Links to the views. The link to the current view is scrolled into view if the window is too small for all links. */
export function Navigation(props: { present: string }) {
  const links = useRef<HTMLUListElement>(null);
  // biome-ignore lint/correctness/useExhaustiveDependencies: another view has another link
  useEffect(() => {
    links.current?.querySelector('[aria-current="page"]')?.scrollIntoView({ block: "nearest", inline: "nearest" });
  }, [props.present]);
  return (
    <nav className="navigation" aria-label={tr("shell.views")}>
      <ul ref={links}>
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
        <LanguageSwitch />
      </div>
    </nav>
  );
}
