// SPDX-License-Identifier: Apache-2.0
import type { Node, NodeProps } from "@xyflow/react";
import { memo } from "react";
import type { Region } from "./regions";
import { sourceColour } from "./sources";

export type RegionNode = Node<{ region: Region }, "region">;

/** The background area of the boxes of a source. */
export const RegionView = memo(function RegionView(props: NodeProps<RegionNode>) {
  const { region } = props.data;
  return (
    <div className="region" style={{ borderTopColor: sourceColour(region.source) }} data-region={region.title}>
      {region.title}
    </div>
  );
});
