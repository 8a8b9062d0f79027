// SPDX-License-Identifier: Apache-2.0
import type { ReactNode } from "react";
import { useRoute } from "../../shell/route";

/** A link to another view. In a panel for operators, which has no other views, only its text is shown. */
export function Lead(props: { to: string; children: ReactNode }) {
  const { view } = useRoute();
  return view === "panel" ? <span>{props.children}</span> : <a href={props.to}>{props.children}</a>;
}
