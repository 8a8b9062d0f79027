// SPDX-License-Identifier: Apache-2.0

import { useMemo, useState } from "react";
import { Panel } from "../../../design/parts";
import { tr } from "../../../language/text";
import type { Graph } from "./definition";
import type { Face, Faces } from "./faces";

/**
 * The component data base: blocks by module and category, which a person drags into the drawing, or adds with a click or Enter. Graphs
 * of the file and of the draft are blocks too; `addGraph(null)` adds an empty graph.
 */
export function Palette(props: { faces: Faces; graphs: Graph[]; add: (block: string) => void; addGraph: (graph: Graph | null) => void }) {
  const [sought, setSought] = useState("");
  const groups = useMemo(() => grouped(props.faces, sought), [props.faces, sought]);
  const graphs = props.graphs.filter((graph) => says(`${graph.name} ${graph.doc}`, sought));
  return (
    <Panel title={tr("flow.components")} className="palette side">
      <label className="stack">
        <span className="unseen">{tr("flow.searchComponents")}</span>
        <input type="search" placeholder={tr("flow.search")} value={sought} onChange={(event) => setSought(event.target.value)} />
      </label>
      <section aria-label={tr("flow.graphs")}>
        <h3>{tr("flow.graphs")}</h3>
        <ul>
          {graphs.map((graph) => (
            <li key={graph.name}>
              <button type="button" title={graph.doc} data-graph={graph.name} onClick={() => props.addGraph(graph)}>
                {graph.name}
              </button>
            </li>
          ))}
          <li>
            <button type="button" title={tr("flow.aNewGraphUsedAsA")} onClick={() => props.addGraph(null)}>
              {tr("flow.anEmptyGraph")}
            </button>
          </li>
        </ul>
      </section>
      {[...groups].map(([group, faces]) => (
        <section key={group} aria-label={group}>
          <h3>{group}</h3>
          <ul>
            {faces.map((face) => (
              <li key={face.name}>
                <button
                  type="button"
                  draggable
                  title={face.doc}
                  data-component={face.name}
                  onDragStart={(event) => {
                    event.dataTransfer.setData("application/x-opengpac-block", face.name);
                    event.dataTransfer.effectAllowed = "copy";
                  }}
                  onClick={() => props.add(face.name)}
                >
                  {face.name.split(".").slice(1).join(".")}
                </button>
              </li>
            ))}
          </ul>
        </section>
      ))}
      {groups.size === 0 && <p className="quiet">{tr("flow.noComponentContainsSoughtInIts", { sought })}</p>}
    </Panel>
  );
}

/** Returns the faces whose name or description contains every search word, by category. */
export function grouped(faces: Faces, sought: string): Map<string, Face[]> {
  const groups = new Map<string, Face[]>();
  for (const face of faces.values()) {
    if (!says(`${face.name} ${face.doc}`, sought)) continue;
    const group = categoryOf(face);
    const known = groups.get(group);
    if (known) known.push(face);
    else groups.set(group, [face]);
  }
  return new Map([...groups].sort(([one], [other]) => one.localeCompare(other)));
}

function says(text: string, sought: string): boolean {
  const words = sought.toLowerCase().split(/\s+/).filter(Boolean);
  return words.every((word) => text.toLowerCase().includes(word));
}

// The category of a block is the folder of its file, in the library as in the manual.
function categoryOf(face: Face): string {
  const [module = ""] = face.name.split(".");
  const folder = /blocks\/([^/]+)\/[^/]+$/.exec(face.file)?.[1];
  return module === "library" ? (folder ?? "library").replaceAll("_", " ") : tr("flow.moduleModule", { module });
}
