// SPDX-License-Identifier: Apache-2.0

import type { InstalledInstance, VerbSummary } from "../../control/shapes";
import { Name, Tag } from "../../design/parts";
import { tr, trWord } from "../../language/text";
import { addressOf } from "../../shell/route";
import { stateTone } from "./stateTone";

/**
 * The verbs: first those that a person starts, then those that support devices. The latter are recognised by their definition, or
 * because all their instances have an owner.
 */
export function VerbList(props: { verbs: VerbSummary[]; instances: InstalledInstance[]; chosen: string | null }) {
  const isKeeping = (verb: VerbSummary) => {
    const instances = props.instances.filter((one) => one.verb === verb.name);
    return verb.supports.length > 0 || (instances.length > 0 && instances.every((one) => one.owner !== null));
  };
  const actions = props.verbs.filter((verb) => !isKeeping(verb));
  const keeping = props.verbs.filter(isKeeping);
  return (
    <nav className="panel verb-list" aria-label={tr("verbs.verbs")}>
      <Part title={tr("verbs.verbs")} {...props} verbs={actions} />
      <Part title={tr("verbs.deviceServos")} {...props} verbs={keeping} />
    </nav>
  );
}

function Part(props: { title: string; verbs: VerbSummary[]; instances: InstalledInstance[]; chosen: string | null }) {
  if (props.verbs.length === 0) return null;
  return (
    <>
      <h2>{props.title}</h2>
      <ul>
        {props.verbs.map((verb) => {
          const live = props.instances.filter((one) => one.verb === verb.name && one.state !== "deleted");
          const counts = new Map<string, number>();
          for (const one of live) counts.set(one.state, (counts.get(one.state) ?? 0) + 1);
          return (
            <li key={verb.name}>
              <a
                href={addressOf("verbs", [verb.name])}
                aria-current={verb.name === props.chosen ? "page" : undefined}
                title={verb.doc.split("\n")[0]}
              >
                <span className="name">
                  <Name of={verb.name} />
                </span>
                {[...counts].map(([state, count]) => (
                  <Tag key={state} tone={stateTone(state)}>
                    {state === "running" ? tr("verbs.countRunning", { count }) : `${count > 1 ? `${count} ` : ""}${trWord(state)}`}
                  </Tag>
                ))}
              </a>
            </li>
          );
        })}
      </ul>
    </>
  );
}
