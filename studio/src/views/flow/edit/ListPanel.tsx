// SPDX-License-Identifier: Apache-2.0

import { period } from "../../../design/numbers";
import { own } from "../../../design/own";
import { Panel } from "../../../design/parts";
import { TextField } from "../../../design/TextField";
import { tr, trWord } from "../../../language/text";
import { removeList, setInitial, setList } from "./change";
import type { Command, Draft, Verb } from "./definition";
import { about, type Finding } from "./findings";
import { timeOrNull } from "./reading";
import { renameList } from "./rename";
import { everyOf, words } from "./written";

const KINDS: Command["command"][] = ["install", "execute", "activate", "deactivate", "wait", "ready"];
const EVERY_NS = 20_000_000;

/** The commands of a list, in order. */
export function ListPanel(props: {
  draft: Draft & { kind: "verb" };
  list: string;
  findings: Finding[];
  change: (draft: Draft) => void;
  choose: (list: string) => void;
}) {
  const { draft, list, change } = props;
  const commands = own(draft.of.command_lists, list)?.commands ?? [];
  const put = (next: Command[]) => change(setList(draft, list, next));
  const found = (index: number) =>
    props.findings.filter((finding) => finding.where.some((where) => "list" in where && where.list === list && where.command === index));
  return (
    <Panel
      title={tr("flow.commandListList", { list })}
      end={
        <>
          <button type="button" onClick={() => change(setInitial(draft, list))} aria-pressed={draft.of.initial === list}>
            {tr("flow.begins")}
          </button>
          <button type="button" onClick={() => change(removeList(draft, list))}>
            {tr("flow.remove")}
          </button>
        </>
      }
    >
      <TextField
        label={tr("flow.name")}
        value={list}
        commit={(to) => {
          if (to === "" || Object.hasOwn(draft.of.command_lists, to))
            return to === "" ? tr("flow.enterAName") : tr("flow.toAlreadyExists", { to });
          change(renameList(draft, list, to));
          props.choose(to);
        }}
      />
      <ol className="stack">
        {commands.map((command, index) => (
          // biome-ignore lint/suspicious/noArrayIndexKey: a command is known by its place
          <li key={index} data-place={`list:${list}:${index}`}>
            <CommandRow
              command={command}
              of={draft.of}
              label={tr("flow.commandIndex", { index: index + 1 })}
              put={(next) => put(commands.map((one, at) => (at === index ? next : one)))}
              remove={() => put(commands.filter((_, at) => at !== index))}
              up={index > 0 ? () => put(swapped(commands, index)) : null}
            />
            {found(index).map((finding) => (
              <p key={finding.message} className="small" role="alert">
                {about(finding)}
              </p>
            ))}
          </li>
        ))}
      </ol>
      <div className="row">
        <button
          type="button"
          onClick={() => put([...commands, { command: "activate", block: Object.keys(draft.of.blocks)[0] ?? "", every_ns: EVERY_NS }])}
        >
          {tr("flow.addCommand")}
        </button>
      </div>
    </Panel>
  );
}

function swapped(commands: Command[], index: number): Command[] {
  const next = [...commands];
  const [moved] = next.splice(index, 1);
  if (moved) next.splice(index - 1, 0, moved);
  return next;
}

function CommandRow(props: {
  command: Command;
  of: Verb;
  label: string;
  put: (command: Command) => void;
  remove: () => void;
  up: (() => void) | null;
}) {
  const { command, of, label, put } = props;
  const labels = Object.keys(of.blocks);
  const block = command.block ?? command.blocks?.[0] ?? labels[0] ?? "";
  return (
    <fieldset className="row" aria-label={label}>
      <select
        aria-label={tr("flow.labelCommand", { label })}
        value={command.command}
        onChange={(event) => put(commandOf(event.target.value as Command["command"], block))}
      >
        {KINDS.map((kind) => (
          <option key={kind} value={kind}>
            {trWord(kind)}
          </option>
        ))}
      </select>
      {(command.command === "execute" || command.command === "activate" || command.command === "deactivate") && (
        <select
          aria-label={tr("flow.labelBlock", { label })}
          value={block}
          onChange={(event) => put({ ...command, block: event.target.value })}
        >
          {!labels.includes(block) && <option>{block}</option>}
          {labels.map((one) => (
            <option key={one}>{one}</option>
          ))}
        </select>
      )}
      {command.command === "install" && (
        <TextField
          label={tr("flow.blocks")}
          value={(command.blocks ?? []).join(", ")}
          commit={(text) => put({ ...command, blocks: words(text) })}
        />
      )}
      {command.command === "activate" && (
        <TextField
          label={tr("flow.every")}
          placeholder={tr("flow.whenDataComes")}
          value={command.every_ns ? period(command.every_ns) : ""}
          commit={(text) => {
            const read = everyOf(text);
            if (read.wrong !== undefined) return read.wrong;
            put({ ...command, every_ns: read.value });
          }}
        />
      )}
      {command.command === "activate" && (
        <>
          <TextField
            label={tr("flow.budget")}
            placeholder={tr("flow.none")}
            value={typeof command.budget_ns === "number" ? period(command.budget_ns) : ""}
            commit={(text) => {
              const read = everyOf(text);
              if (read.wrong !== undefined) return read.wrong;
              put(withOrWithout(command, "budget_ns", read.value));
            }}
          />
          <label className="row">
            <input
              type="checkbox"
              checked={command.tunable === true}
              onChange={(event) => put(withOrWithout(command, "tunable", event.target.checked || null))}
            />
            {tr("flow.intervalMayChange")}
          </label>
        </>
      )}
      {command.command === "wait" && (
        <TextField
          label={tr("flow.for")}
          placeholder={tr("flow.untilNothingIsActive")}
          value={command.time_ns ? period(command.time_ns) : (command.conditions ?? []).join(", ")}
          commit={(text) => put(waitOf(text))}
        />
      )}
      {props.up && (
        <button type="button" onClick={props.up} aria-label={tr("flow.labelMoveUp", { label })}>
          ↑
        </button>
      )}
      <button type="button" onClick={props.remove} aria-label={tr("flow.labelRemove", { label })}>
        ×
      </button>
    </fieldset>
  );
}

function commandOf(kind: Command["command"], block: string): Command {
  if (kind === "install") return { command: kind, blocks: block ? [block] : [] };
  if (kind === "activate") return { command: kind, block, every_ns: EVERY_NS };
  if (kind === "execute" || kind === "deactivate") return { command: kind, block };
  return { command: kind };
}

/** Sets a member of a command, or removes it if the value is null, so that short forms stay short. */
function withOrWithout(command: Command, key: "budget_ns" | "tunable", value: unknown): Command {
  const { [key]: _before, ...rest } = command;
  return value === null ? rest : { ...rest, [key]: value };
}

/** Parses a wait: "0.5 s", "near.done, near.lost", or empty. */
export function waitOf(text: string): Command {
  const time_ns = timeOrNull(text);
  if (time_ns !== null) return { command: "wait", time_ns };
  return text === "" ? { command: "wait" } : { command: "wait", conditions: words(text) };
}
