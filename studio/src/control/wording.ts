// SPDX-License-Identifier: Apache-2.0
// The core's remedies show Python code, which a user of the page cannot enter. This file has the page's texts for the same remedies.

type Wording = [RegExp, string];

/** Patterns and their wordings. The first match wins, so longer patterns come first. */
const WORDINGS: Wording[] = [
  // The editor: modes, lists, intervals.
  [/gpac\.ratio\((\w+)\)/g, "ratio $1"],
  [/relax (it|one|the input) with modes=\{\{?'([^']+)': '?([^'{}]+?)'?\}\}?/g, "set the mode of '$2' to $3"],
  [/relax (it|that input of verb '[^']+') with modes=/g, "set the mode of $1 to asynchronous"],
  [/give it one mode with modes=/g, "give it one mode at its port"],
  [/ with modes=(\{[^}]*\}+)?/g, " by the mode at its port"],
  [/modes=(\{[^}]*\}+)?/g, "the mode at its port"],
  [/set initial= to one of /g, "choose the command list that it begins with, one of "],
  [/write activate\('([^']+)', every='1 ms'\)/g, "give the command activate of '$1' an interval, for example 1 ms"],
  [
    /declare it in every list: activate\('([^']+)', every=gpac\.interval\('[^']+', tunable=True\)\)/g,
    "let the interval of '$1' change in every command list",
  ],
  [/for example every='1 ms'/g, "for example 1 ms"],
  [/: \.on\(every=…\)/g, ""],
  [/declare it with gpac\.input\(…, tunable=True\)/g, "let the input parameter be set while it runs"],
  [/(leave|leave out) (suspend|if_cut_off|supervisor|until)=('\w+')? ?(out)?/g, "leave '$2' out"],
  [/ending_limit='2 s'/g, "2 s"],
  [/with manual=True/g, "for manual mode"],
  // Compositions.
  [/rename=\{\{?'([^']+)': '([^']+)'\}\}?/g, "'$1' becomes '$2'"],
  [/preset=\{\{?'([^']+)': ([^}]*)\}\}?/g, "'$1' set to $2"],
  [/ with rename=/g, ""],
  [/conditions=\{\{?'([^']+)': on\('([^']+)', returns=\[\]\)\}\}?/g, "a condition '$1' that is '$2' and returns nothing"],
  [/returns=/g, "return values"],
  // Sizes, histories, ranges and units.
  [/\bk='2 N\.m\/rad'/g, "2 N.m/rad"],
  [/give, for example, n=6/g, "give, for example, 6"],
  [/declare it with each\(\) to take several/g, "let the object take several of them"],
  [/give, for example, arm\['elbow'\]/g, "give one, for example arm.elbow"],
  [/cell\.svv\(…, history=100\)/g, "a history of 100 values"],
  [/history=/g, "a history of "],
  [/within=\(([^)]*)\)/g, "$1"],
  // The rest of a system.
  [/clock="virtual"/g, "the virtual clock"],
  [/has suspend='(\w+)'/g, "is suspended by '$1'"],
  [/write suspend='(\w+)'/g, "choose '$1'"],
  [/(record it) with cell\.record\(path, replay=True\), or with 'opengpac record'/g, "$1 “for replay”"],
  [/: cell\.download\(path, name=…\)/g, ""],
  [/(replay it) with trust=True \(opengpac replay --trust\)/g, "$1 as trusted"],
  [/process="([^"]+)"/g, "process '$1'"],
  [/add process=True/g, "give it a separate process"],
  // The remaining options: `speed=` is the input or parameter of that name.
  [/\b([a-z]\w*)='([^']*)'/g, "'$1' of $2"],
  [/\b([a-z]\w*)=(\d\S*)/g, "'$1' of $2"],
  [/\b([a-z]\w*)=(?=[\s,.;)]|$)/g, "'$1'"],
];

/** Returns a message or remedy of the core in the page's wording, without instructions that only a program could follow. */
export function worded(text: string): string {
  return WORDINGS.reduce((said, [python, page]) => said.replace(python, page), text);
}
