// SPDX-License-Identifier: Apache-2.0
import { seconds } from "../design/numbers";
import { Refusals, Tag } from "../design/parts";
import { CommandHolder } from "./CommandHolder";
import { useControl, useTopic, useWatched } from "./context";
import { EmergencyStop } from "./EmergencyStop";
import { ModeAndPause } from "./ModeAndPause";

/** Always seen: which system, whether it is heard, who commands, mode and pause, the emergency stop. */
export function TopBar() {
  const control = useControl();
  const now = useTopic(control.topics.statistics);
  const statisticsTrouble = useWatched(control.topics.statistics.trouble);
  const sessionTrouble = useWatched(control.session.trouble);
  return (
    <div className="top">
      <header className="bar">
        <div className="who">
          <h1>{control.version.system}</h1>
          <Heard />
          <span className="quiet clock" title={`${control.version.clock} clock`}>
            {control.version.clock === "virtual" ? "virtual " : ""}
            <span className="figures">{now ? seconds(now.now_s) : "–"}</span>
          </span>
        </div>
        <CommandHolder />
        <ModeAndPause now={now} />
        <EmergencyStop now={now} />
      </header>
      <Refusals of={[...sessionTrouble, ...statisticsTrouble]} />
    </div>
  );
}

const SAID = { connecting: "connecting", broken: "not heard: values are old", out: "let in no longer: open the page with another token" };

function Heard() {
  const control = useControl();
  const connection = useWatched(control.stream.connection);
  if (connection === "open") return <Tag tone="good">live</Tag>;
  return (
    <span role="status">
      <Tag tone={connection === "connecting" ? "plain" : "bad"}>{SAID[connection]}</Tag>
    </span>
  );
}
