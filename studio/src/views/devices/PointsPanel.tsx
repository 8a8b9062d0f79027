// SPDX-License-Identifier: Apache-2.0

import { useState } from "react";
import { type Refusal, refusalsOf } from "../../control/refusals";
import type { ArmDescription, ChainDescription, Statistics, TaughtPoint, TaughtPoints } from "../../control/shapes";
import { Choice } from "../../design/Choice";
import { Name, Panel, Refusals } from "../../design/parts";
import { tr } from "../../language/text";
import { useControl } from "../../shell/context";
import { isRenewed } from "./families";
import { goalOf, JOINTS, motionTo, taughtAt, toldOfMotion, type Way, WORLD } from "./points";
import { notEnabled } from "./toolJog";
import { type PointsOfArm, usePoints } from "./usePoints";
import { useVerb } from "./useVerb";

const NO_FILE = tr("devices.noFileOfTaughtPointsIs");

/** Panel for the taught points of an arm, in the file that its program also uses: it teaches, approaches, renames and deletes them. */
export function PointsPanel(props: { of: ArmDescription; chain: ChainDescription; now: Statistics }) {
  const { of: arm, chain, now } = props;
  const control = useControl();
  const known = usePoints(arm.name);
  const [chosen, setChosen] = useState<string | null>(null);
  const { points, trouble } = known;
  const point = points?.points.find((one) => one.name === chosen) ?? null;
  const isUnnamed = trouble.some((one) => one.class === "UnknownName");
  return (
    <Panel title={tr("devices.pointsOfName", { name: arm.name })} className="points">
      {!isUnnamed && <Refusals of={trouble} />}
      {!points && (
        <p className="quiet">
          {isUnnamed ? NO_FILE : trouble.length > 0 ? tr("devices.theFileOfPointsCannotBe") : tr("devices.readingThePoints")}
        </p>
      )}
      {points && (
        <>
          <PointList of={points} chain={chain} chosen={point?.name ?? null} choose={setChosen} arm={arm.name} />
          {control.may("operate") && (
            <PointTools arm={arm} chain={chain} now={now} known={known} points={points} point={point} choose={setChosen} />
          )}
          <p className="quiet small">
            {tr("devices.in")} <Name of={points.file} />
            {tr("devices.whichProgramsAndOtherUsersMay")}
          </p>
        </>
      )}
    </Panel>
  );
}

/** Table of the points, one per row. Its height is fixed, so that no element below it moves when another program teaches a point. */
function PointList(props: {
  of: TaughtPoints;
  chain: ChainDescription;
  chosen: string | null;
  choose: (name: string) => void;
  arm: string;
}) {
  const { of: points, chain } = props;
  return (
    <div className="point-list" role="group" aria-label={tr("devices.taughtPointsOfArm", { arm: props.arm })} tabIndex={0}>
      <table>
        <thead>
          <tr>
            <th scope="col">{tr("devices.point")}</th>
            <th scope="col">{tr("devices.frame")}</th>
            <th scope="col">{tr("devices.tool")}</th>
            <th scope="col" className="number">
              {tr("devices.xYZMm")}
            </th>
            <th scope="col">{tr("devices.note")}</th>
          </tr>
        </thead>
        <tbody>
          {points.points.map((point) => (
            <tr key={point.name} className={point.name === props.chosen ? "chosen" : ""}>
              <th scope="row">
                <label>
                  <input
                    type="radio"
                    name={`point of ${props.arm}`}
                    checked={point.name === props.chosen}
                    onChange={() => props.choose(point.name)}
                  />{" "}
                  {point.name}
                </label>
              </th>
              <td>{point.frame}</td>
              <td>{point.frame === JOINTS ? "–" : (point.tool ?? tr("devices.ofTheArm"))}</td>
              <td className="number">{placeText(goalOf(points, point, chain)?.pose.place)}</td>
              <td>{point.note}</td>
            </tr>
          ))}
        </tbody>
      </table>
      {points.points.length === 0 && <p className="quiet">{tr("devices.noPointsTaughtYetJogThe")}</p>}
    </div>
  );
}

function placeText(place: readonly number[] | undefined): string {
  return place ? place.map((x) => (1000 * x).toFixed(1)).join(", ") : "–";
}

function PointTools(props: {
  arm: ArmDescription;
  chain: ChainDescription;
  now: Statistics;
  known: PointsOfArm;
  points: TaughtPoints;
  point: TaughtPoint | null;
  choose: (name: string | null) => void;
}) {
  const { arm, chain, now, known, points, point, choose } = props;
  const control = useControl();
  const motions = useVerb();
  const [share, setShare] = useState(20);
  const [told, setTold] = useState<{ text: string; wrong: Refusal[] }>({ text: "", wrong: [] });
  const [deleted, setDeleted] = useState<TaughtPoint | null>(null);
  const [isBusy, setBusy] = useState(false);
  const [name, setName] = useState("");
  const [frame, setFrame] = useState(JOINTS);
  const [tool, setTool] = useState("");

  const asleep = arm.joints.filter((joint) => !isRenewed(now.devices[joint]));
  const goal = point && goalOf(points, point, chain);
  const say = (text: string, wrong: Refusal[] = []) => {
    motions.clear();
    setTold({ text, wrong });
  };
  const change = async (text: string, action: () => Promise<unknown>) => {
    setBusy(true);
    say("");
    try {
      await action();
      say(text);
    } catch (why) {
      say("", refusalsOf(why));
    }
    await known.look();
    setBusy(false);
  };

  const go = (way: Way) => {
    const asked = goal && motionTo(goal, way, share, chain);
    if (!point || !asked) return;
    if (asleep.length > 0) return say("", [notEnabled(asleep)]);
    say("");
    motions.begin(point.name, { ...asked, arguments: { arm: { devices: arm.joints } } }, (report) => {
      const wrong = toldOfMotion(arm, point.name, report);
      setTold({ text: wrong ? "" : tr("devices.theArmIsAtName", { name: point.name }), wrong: wrong ? [wrong] : [] });
    });
  };
  const teach = () => {
    if (asleep.length > 0) return say("", [notEnabled(asleep)]);
    void change(tr("devices.nameWasTaughtAtThePresent", { name: name.trim() }), async () => {
      const names = arm.joints.map((joint) => `${joint}.sensed`);
      const { values } = await control.look("read", { names });
      const q = names.map((one) => Number(values[one]?.value));
      const taught = taughtAt(points, chain, q, name.trim(), frame, tool === "" ? null : tool);
      // Under the virtual clock, wall-clock time is meaningless.
      const time = control.version.clock === "virtual" ? {} : { taught: `${new Date().toISOString().slice(0, 19)}Z` };
      await control.order("teach_point", { arm: arm.name, point: { ...taught, ...time } });
      choose(name.trim());
    });
  };
  const rename = (from: TaughtPoint) =>
    void change(tr("devices.nameWasRenamedName2", { name: from.name, name2: name.trim() }), async () => {
      await control.order("rename_point", { arm: arm.name, name: from.name, to: name.trim() });
      choose(name.trim());
    });
  const remove = (from: TaughtPoint) =>
    void change(tr("devices.nameWasDeletedUndoRestoresIt", { name: from.name }), async () =>
      setDeleted(await control.order("delete_point", { arm: arm.name, name: from.name })),
    );
  const undo = (back: TaughtPoint) =>
    void change(tr("devices.nameWasRestored", { name: back.name }), async () => {
      await control.order("teach_point", { arm: arm.name, point: back });
      setDeleted(null);
      choose(back.name);
    });

  const isNamed = name.trim() !== "";
  const isThere = points.points.some((one) => one.name === name.trim());
  const moves = motions.under !== null;
  const hint = point === null ? tr("devices.selectAPointOrTeachOne") : goal === null ? tr("devices.itsFrameOrItsToolIs") : goalHint(goal);
  const said = motions.under ? tr("devices.theArmMovesToAbout", { about: motions.under.about }) : told.text || tr("devices.theArmIsAtRest");
  return (
    <>
      <div className="row" data-commands>
        <button type="button" disabled={moves || !goal?.joints} onClick={() => go("joints")}>
          {tr("devices.moveJoints")}
        </button>
        <button type="button" disabled={moves || !goal} onClick={() => go("line")}>
          {tr("devices.moveInALine")}
        </button>
        <button type="button" disabled={!moves} onClick={motions.stop}>
          {tr("devices.stop")}
        </button>
        <label className="row">
          <span className="quiet">{tr("devices.speed")}</span>
          <input type="range" min={5} max={100} step={5} value={share} onChange={(event) => setShare(Number(event.target.value))} />
          <span className="figures point-speed">{share} %</span>
        </label>
      </div>
      <p className="quiet point-told">{hint}</p>
      <form className="row" data-commands onSubmit={(event) => event.preventDefault()}>
        <label className="row">
          <span className="quiet">{tr("devices.name")}</span>
          <input size={12} value={name} onChange={(event) => setName(event.target.value)} />
        </label>
        <Choice label={tr("devices.frame")} value={frame} put={setFrame}>
          <option value={JOINTS}>{tr("devices.joints")}</option>
          <option value={WORLD}>{tr("devices.world")}</option>
          {points.frames.map((one) => (
            <option key={one.name}>{one.name}</option>
          ))}
        </Choice>
        <Choice label={tr("devices.tool")} value={frame === JOINTS ? "" : tool} put={setTool}>
          <option value="">{tr("devices.ofTheArm")}</option>
          {frame !== JOINTS && points.tools.map((one) => <option key={one.name}>{one.name}</option>)}
        </Choice>
        <button type="button" className="teach" disabled={isBusy || !isNamed} onClick={teach}>
          {isThere ? tr("devices.teachAgain") : tr("devices.teach")}
        </button>
      </form>
      <div className="row" data-commands>
        <button type="button" disabled={isBusy || !point || !isNamed || isThere} onClick={() => point && rename(point)}>
          {tr("devices.rename")}
        </button>
        <button type="button" disabled={isBusy || !point} onClick={() => point && remove(point)}>
          {tr("devices.delete")}
        </button>
        <button type="button" disabled={isBusy || !deleted} onClick={() => deleted && undo(deleted)}>
          {tr("devices.undo")}
        </button>
      </div>
      <p className="point-told quiet" role="status" aria-label={tr("devices.stateOfThePointsOfName", { name: arm.name })}>
        {said}
      </p>
      <Refusals of={[...motions.refusals, ...told.wrong]} />
    </>
  );
}

function goalHint(goal: { joints: number[] | null }): string {
  return goal.joints ? tr("devices.goThereOrChooseAnotherName") : tr("devices.itsFrameOrToolHasChanged");
}
