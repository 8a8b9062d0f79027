// SPDX-License-Identifier: Apache-2.0
import { useEffect, useId, useState } from "react";
import { type Refusal, refusalsOf } from "../../control/refusals";
import { Refusals } from "../../design/parts";
import { arrowsOf, type Shape } from "./shape";
import { END, type Laid, layOut, START } from "./states";

/** The command lists of a verb and what leads from one to another. `present`: the list that runs; `last`: the arrow that was taken last. */
export function StateDiagram(props: { shape: Shape; present: string | null; last: { from: string; to: string } | null }) {
  const { shape, present, last } = props;
  const [laid, setLaid] = useState<Laid | null>(null);
  const [trouble, setTrouble] = useState<Refusal[]>([]);
  const words = useId();
  const drawn = JSON.stringify(shape);
  useEffect(() => {
    let over = false;
    layOut(JSON.parse(drawn) as Shape).then(
      (found) => over || setLaid(found),
      (why) => over || setTrouble(refusalsOf(why)),
    );
    return () => {
      over = true;
    };
  }, [drawn]);
  const commands = new Map(shape.lists.map((list) => [list.name, list.commands]));
  return (
    <div className="scroll-x diagram" role="group" aria-label="State diagram" tabIndex={0}>
      <Refusals of={trouble} />
      <ul className="unseen" id={words}>
        {arrowsOf(shape).map((arrow) => (
          <li key={`${arrow.from} ${arrow.to}`}>
            {arrow.from}: {arrow.conditions.map((one) => one.name).join(", ")}{" "}
            {arrow.to === null ? "ends the verb" : `leads to ${arrow.to}`}
          </li>
        ))}
      </ul>
      {laid && (
        <svg
          width={laid.width}
          height={laid.height}
          viewBox={`0 0 ${laid.width} ${laid.height}`}
          role="img"
          aria-label={present ? `Command lists; ${present} runs` : "Command lists"}
          aria-describedby={words}
        >
          <defs>
            <marker
              id="head"
              viewBox="0 0 8 8"
              refX="7"
              refY="4"
              markerWidth="8"
              markerHeight="8"
              markerUnits="userSpaceOnUse"
              orient="auto-start-reverse"
            >
              <path d="M0 1L7 4L0 7z" className="head" />
            </marker>
          </defs>
          {laid.arrows.map(({ arrow, path, label }) => {
            const taken = last !== null && arrow.from === last.from && arrow.to === last.to;
            return (
              <g key={`${arrow.from} ${arrow.to}`} className={`arrow ${arrow.to === null ? "ends" : ""} ${taken ? "taken" : ""}`}>
                <path d={path} markerEnd="url(#head)" />
                {label &&
                  arrow.conditions.map((one, index) => (
                    <text key={one.name} x={label.x + 2} y={label.y + 11 + index * 15} className={one.raises ? "raises" : ""}>
                      {one.name}
                      {one.raises ? " (raises)" : ""}
                    </text>
                  ))}
              </g>
            );
          })}
          {laid.boxes.map((box) => (
            <Box
              key={box.name}
              of={box}
              commands={commands.get(box.name) ?? []}
              lit={box.name === present}
              isEnding={box.name === shape.ending}
            />
          ))}
        </svg>
      )}
    </div>
  );
}

function Box(props: { of: Laid["boxes"][number]; commands: string[]; lit: boolean; isEnding: boolean }) {
  const { of, commands, lit } = props;
  if (of.name === START) return <circle className="start" cx={of.x + 6} cy={of.y + 6} r={5} />;
  if (of.name === END) {
    return (
      <g className="end">
        <circle cx={of.x + 9} cy={of.y + 9} r={8} />
        <circle className="start" cx={of.x + 9} cy={of.y + 9} r={4.5} />
      </g>
    );
  }
  return (
    <g className={`list ${lit ? "lit" : ""}`} data-list={of.name} transform={`translate(${of.x} ${of.y})`}>
      <rect width={of.width} height={of.height} rx={4} />
      <text className="name" x={10} y={16}>
        {of.name}
        {props.isEnding ? " (at every end)" : ""}
      </text>
      {commands.map((text, index) => (
        // biome-ignore lint/suspicious/noArrayIndexKey: the same command may stand twice
        <text key={index} className="command" x={10} y={35 + index * 15}>
          {text}
        </text>
      ))}
    </g>
  );
}
