// SPDX-License-Identifier: Apache-2.0

import { Suspense, useEffect } from "react";
import { Empty } from "../design/parts";
import { tr } from "../language/text";
import { useAxis } from "./axis";
import { Boundary } from "./Boundary";
import { SourceContext, useLive, useWatched } from "./context";
import { useCutOffWarning } from "./cutOff";
import { Navigation } from "./Navigation";
import { useRoute } from "./route";
import { TopBar } from "./TopBar";
import { fetchViews, views } from "./views";
import "./shell.css";

/** Time after which the views that are not open are fetched, ms: the open one comes first. */
const FETCH_MS = 2000;

/** The frame of the studio: the elements that are always visible, and the open view. */
export function Shell() {
  const control = useLive();
  const source = useWatched(useAxis().source);
  const route = useRoute();
  const view = views.find((one) => one.name === route.view);
  useCutOffWarning();
  useEffect(() => {
    const later = setTimeout(() => void fetchViews(), FETCH_MS);
    return () => clearTimeout(later);
  }, []);
  useEffect(() => {
    document.title = tr("shell.openGPACStudio2", { part: view?.title ?? tr("shell.notFound") });
  }, [view]);
  const isHeard = useWatched(control.stream.connection) === "open";
  const Part = view?.part;
  return (
    <div className="shell" data-heard={isHeard || source.past !== null ? "yes" : "no"} data-panel={view?.alone ? "yes" : "no"}>
      <button type="button" className="skip" onClick={() => document.getElementById("main")?.focus()}>
        {tr("shell.toTheView")}
      </button>
      <TopBar />
      {!view?.alone && <Navigation present={view?.name ?? ""} />}
      <main id="main" tabIndex={-1} aria-label={view?.title} data-view={view?.name}>
        <Boundary key={`${view?.name} ${source.version.run} ${source.version.system}`}>
          <Suspense fallback={<p className="quiet wait">{tr("shell.loading")}</p>}>
            {Part ? (
              <SourceContext value={source}>
                <Part />
              </SourceContext>
            ) : (
              <Empty title={tr("shell.viewViewDoesNotExist", { view: route.view })}>{tr("shell.chooseOneOfTheViewsIn")}</Empty>
            )}
          </Suspense>
        </Boundary>
      </main>
    </div>
  );
}
