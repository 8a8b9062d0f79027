// SPDX-License-Identifier: Apache-2.0
import { Suspense, useEffect } from "react";
import { Empty } from "../design/parts";
import { useAxis } from "./axis";
import { Boundary } from "./Boundary";
import { SourceContext, useLive, useWatched } from "./context";
import { useCutOffWarning } from "./cutOff";
import { Navigation } from "./Navigation";
import { useRoute } from "./route";
import { TopBar } from "./TopBar";
import { views } from "./views";
import "./shell.css";

/** The frame of the studio: the elements that are always visible, and the open view. */
export function Shell() {
  const control = useLive();
  const source = useWatched(useAxis().source);
  const route = useRoute();
  const view = views.find((one) => one.name === route.view);
  useCutOffWarning();
  useEffect(() => {
    document.title = `${view?.title ?? "Not found"} · OpenGPAC studio`;
  }, [view]);
  const isHeard = useWatched(control.stream.connection) === "open";
  const Part = view?.part;
  return (
    <div className="shell" data-heard={isHeard || source.past !== null ? "yes" : "no"} data-panel={view?.alone ? "yes" : "no"}>
      <button type="button" className="skip" onClick={() => document.getElementById("main")?.focus()}>
        To the view
      </button>
      <TopBar />
      {!view?.alone && <Navigation present={view?.name ?? ""} />}
      <main id="main" tabIndex={-1} aria-label={view?.title} data-view={view?.name}>
        <Boundary key={`${view?.name} ${source.version.run} ${source.version.system}`}>
          <Suspense fallback={<p className="quiet wait">Loading…</p>}>
            {Part ? (
              <SourceContext value={source}>
                <Part />
              </SourceContext>
            ) : (
              <Empty title={`View '${route.view}' does not exist`}>Choose one of the views in the navigation.</Empty>
            )}
          </Suspense>
        </Boundary>
      </main>
    </div>
  );
}
