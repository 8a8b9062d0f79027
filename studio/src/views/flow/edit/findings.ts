// SPDX-License-Identifier: Apache-2.0

import { inWords } from "../../../control/refusals";
import { tr } from "../../../language/text";

// Findings of `check_drawing`, and their locations in the drawing: docs/files.md.

export type Where =
  | { block: string; port?: string }
  | { cell: string }
  | { parameter: string }
  | { output: string }
  | { object: string }
  | { list: string; command?: number }
  | { condition: string }
  | { transition: [string, string] };

export interface Finding {
  class: string;
  message: string;
  remedy?: string | null;
  /** Locations of the finding, the main one first; empty if it concerns the whole definition. */
  where: Where[];
}

/** Returns the findings in an answer of the system. A finding without a location concerns the whole definition. */
export function findingsOf(answered: unknown): Finding[] {
  if (!Array.isArray(answered)) return [];
  return answered.map((one: Partial<Finding>) =>
    inWords({
      ...one,
      class: String(one.class ?? "Error"),
      message: String(one.message ?? tr("flow.theDefinitionWasRefused")),
      where: Array.isArray(one.where) ? one.where : [],
    }),
  );
}

export function isPort(where: Where): where is { block: string; port: string } {
  return "block" in where && typeof where.port === "string";
}

/** Describes a finding, with its remedy. */
export function about(finding: Finding): string {
  return finding.remedy ? `${finding.message}; ${finding.remedy}` : finding.message;
}

/** Returns the findings about a command list. The functions below return those about other kinds of locations. */
export function ofList(findings: Finding[], list: string): Finding[] {
  return findings.filter((finding) => finding.where.some((where) => "list" in where && where.list === list));
}

export function ofCondition(findings: Finding[], condition: string): Finding[] {
  return findings.filter((finding) => finding.where.some((where) => "condition" in where && where.condition === condition));
}

export function ofParameter(findings: Finding[], parameter: string): Finding[] {
  return findings.filter((finding) => finding.where.some((where) => "parameter" in where && where.parameter === parameter));
}

export function ofOutput(findings: Finding[], output: string): Finding[] {
  return findings.filter((finding) => finding.where.some((where) => "output" in where && where.output === output));
}

export function ofObject(findings: Finding[], object: string): Finding[] {
  return findings.filter((finding) => finding.where.some((where) => "object" in where && where.object === object));
}

export function ofTransition(findings: Finding[], from: string, condition: string): Finding[] {
  return findings.filter((finding) =>
    finding.where.some((where) => "transition" in where && where.transition[0] === from && where.transition[1] === condition),
  );
}
