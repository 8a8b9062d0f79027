// SPDX-License-Identifier: Apache-2.0
import type { CSSProperties } from "react";
import type { Region } from "../../control/shapes";
import { Panel } from "../../design/parts";
import { headingOf, innerOf } from "./layout";
import { PanelBody } from "./PanelBody";

/** A layout as its author created it, without docking: rows wrap if there is not enough space, and tabs are stacked. */
export function Fixed(props: { layout: Region; workspace: string }) {
  const { layout, workspace } = props;
  if (layout.panel) {
    return (
      <Panel title={headingOf(layout)} className={`fixed-panel ${layout.panel}`}>
        <PanelBody of={layout} workspace={workspace} />
      </Panel>
    );
  }
  const { regions, side } = innerOf(layout);
  return (
    <div className={side === "row" ? "fixed-row" : "fixed-column"}>
      {regions.map((region, index) => (
        // biome-ignore lint/suspicious/noArrayIndexKey: a region is known by its place
        <div key={index} className="fixed-region" style={{ "--share": region.share ?? 1 } as CSSProperties}>
          <Fixed layout={region} workspace={workspace} />
        </div>
      ))}
    </div>
  );
}
