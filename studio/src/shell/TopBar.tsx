// SPDX-License-Identifier: Apache-2.0

import { useEffect, useState } from "react";
import { faults } from "../control/asking";
import type { Statistics } from "../control/shapes";
import { seconds } from "../design/numbers";
import { Refusals, Tag } from "../design/parts";
import { tr, trWord } from "../language/text";
import { ageText } from "../live/Age";
import { AlarmBar } from "./AlarmBar";
import { CommandHolder, commanderOf } from "./CommandHolder";
import { CommandRequests } from "./CommandRequests";
import { useLive, useTopic, useWatched } from "./context";
import { EmergencyStop, Stopped, StopUnheard, useEmergencyStop } from "./EmergencyStop";
import { ForcedNote } from "./ForcedNote";
import { ModeAndPause } from "./ModeAndPause";
import { Aim, Notices } from "./Notices";
import { TimeBar } from "./TimeBar";
import { Tour } from "./tour/Tour";

/**
 * Bar that is always visible: system, connection, commander, mode and pause, alarms, emergency stop. In a narrow window, commander and
 * mode are combined on one line, and their controls and those of the clock are collapsed until they are expanded.
 */
export function TopBar() {
  const control = useLive();
  const now = useTopic(control.topics.statistics);
  const statisticsTrouble = useWatched(control.topics.statistics.trouble);
  const sessionTrouble = useWatched(control.session.trouble);
  // The faults of all questions read the same.
  const faulty = useWatched(faults);
  const press = useEmergencyStop(now);
  const [isUnfolded, setUnfolded] = useState(false);
  return (
    <div className="top" data-unfolded={isUnfolded ? "yes" : "no"}>
      <EmergencyStop press={press} />
      <StopUnheard press={press} />
      <header className="bar">
        <div className={`who ${control.may("operate") ? "beside" : ""}`}>
          <h1 title={control.version.system}>{control.version.system}</h1>
          <Heard />
          <span className="quiet clock" title={tr("shell.clockClock", { clock: trWord(control.version.clock) })}>
            {control.version.clock === "virtual" ? `${tr("shell.virtual")} ` : ""}
            <span className="figures">{now ? seconds(now.now_s) : "–"}</span>
          </span>
          <Summary now={now} />
          <button
            type="button"
            className="fold"
            aria-label={tr("shell.commandModeAndClock", { part: isUnfolded ? tr("shell.less") : tr("shell.more") })}
            aria-expanded={isUnfolded}
            onClick={() => setUnfolded(!isUnfolded)}
          >
            {isUnfolded ? tr("shell.less") : tr("shell.more")}
          </button>
        </div>
        <CommandHolder now={now} />
        <ModeAndPause now={now} />
      </header>
      <Aim />
      <Notices>
        {/* First, so that nothing which comes or goes moves its reset. */}
        <Stopped now={now} />
        <ForcedNote now={now} />
        <Unheard />
        <CommandRequests />
        <AlarmBar />
        <Restarted />
        <Refusals of={[...sessionTrouble, ...statisticsTrouble, ...faulty.slice(0, 1)]} />
      </Notices>
      <TimeBar />
      <Tour />
    </div>
  );
}

/** Summary of command, mode and pause while these are collapsed in a narrow window: first anything unusual, then the holder of command. */
function Summary(props: { now: Statistics | null }) {
  const control = useLive();
  const { holder, person } = useWatched(control.command.state);
  const name = useWatched(control.session.name);
  const { now } = props;
  const isPaused = now?.paused === true || (Array.isArray(now?.paused) && now.paused.length > 0);
  const mode = now?.mode ?? "automatic";
  const commander = commanderOf(holder, person ?? null, name, now);
  const said = [isPaused && tr("shell.paused2"), mode !== "automatic" && trWord(mode), tr("shell.commanderCommands", { commander })].filter(
    Boolean,
  );
  return <span className="summary small quiet">{said.join(" · ")}</span>;
}

const SAID = {
  connecting: tr("shell.connecting2"),
  silent: tr("shell.offline"),
  broken: tr("shell.offline"),
  out: tr("shell.accessDenied"),
};

function Heard() {
  const control = useLive();
  const connection = useWatched(control.stream.connection);
  if (connection === "open") return <Tag tone="good">{tr("shell.live2")}</Tag>;
  return <Tag tone={connection === "connecting" ? "plain" : "bad"}>{SAID[connection]}</Tag>;
}

/** Warning over the full width that the connection is lost, so that nothing on the page is current. */
function Unheard() {
  const control = useLive();
  const connection = useWatched(control.stream.connection);
  const isLost = connection === "broken" || connection === "silent";
  const age_ms = useAge(isLost);
  if (connection === "out") {
    return (
      <div className="notice bad unheard" role="alert">
        <strong>{tr("shell.accessToTheSystemWasDenied")}</strong> {tr("shell.theDisplayedValuesAreOutdatedOpen")}
      </div>
    );
  }
  if (!isLost) return null;
  return (
    <div className="notice bad unheard" role="alert">
      <strong>{tr("shell.noConnection")}</strong>{" "}
      <span>
        {tr("shell.everythingHereIs")} <span className="figures">{ageText(age_ms / 1000)}</span> {tr("shell.oldAndCommandsAreNotPossible")}
      </span>
    </div>
  );
}

/** Notice that the system has restarted, so that the page's information is from an earlier run. */
function Restarted() {
  const control = useLive();
  const restarts = useWatched(control.restarts);
  const [known, setKnown] = useState(0);
  if (restarts === known) return null;
  return (
    <div className="notice warn" role="status">
      <strong>{tr("shell.theSystemWasRestarted")}</strong> {tr("shell.earlierLogEntriesAreMarkedAs")}
      <button type="button" onClick={() => setKnown(restarts)}>
        {tr("shell.dismiss")}
      </button>
    </div>
  );
}

/** Returns the age of the last known state of the system, ms, as long as it is shown. */
function useAge(isLooked: boolean): number {
  const control = useLive();
  const [age_ms, setAge] = useState(0);
  useEffect(() => {
    if (!isLooked) return;
    const look = () => setAge(control.stream.age_ms());
    look();
    const again = setInterval(look, 500);
    return () => clearInterval(again);
  }, [control, isLooked]);
  return age_ms;
}
