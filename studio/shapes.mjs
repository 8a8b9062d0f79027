// SPDX-License-Identifier: Apache-2.0
// Generates src/control/shapes.ts from the schemas of the control interface: `npm run shapes`. With --check it only reports whether the
// present file is up to date; with --print it converts schemas from its standard input to types on its standard output.
import { readFileSync, writeFileSync } from "node:fs";

const SCHEMAS = new URL("../crates/control/schemas/control-v1.json", import.meta.url);
const MADE = new URL("src/control/shapes.ts", import.meta.url);
const PREFIX = "#/$defs/";

/** Converts a schema to a TypeScript type. */
function type(schema, depth = 0) {
  if (schema === true) return "unknown";
  if (schema === false) return "never";
  if (schema.$ref) return both(schema.$ref.slice(PREFIX.length), rest(schema, "$ref"), depth);
  if ("const" in schema) return JSON.stringify(schema.const);
  if (schema.enum) return union(schema.enum.map((value) => JSON.stringify(value)));
  for (const word of ["anyOf", "oneOf"]) {
    if (schema[word]) return both(union(schema[word].map((one) => type(one, depth))), rest(schema, word), depth);
  }
  if (schema.allOf) return intersection([...schema.allOf.map((one) => type(one, depth)), ...shaped(rest(schema, "allOf"), depth)]);
  if (Array.isArray(schema.type)) return union(schema.type.map((one) => type({ ...schema, type: one }, depth)));
  return plain(schema, depth);
}

/** Returns the type of a schema; a schema without one of its own (`properties` beside `$ref`, a description alone) adds nothing. */
function shaped(schema, depth) {
  return ["properties", "additionalProperties", "type"].some((word) => word in schema) ? [type(schema, depth)] : [];
}

function both(of, more, depth) {
  return intersection([of, ...shaped(more, depth)]);
}

function rest(schema, word) {
  const { [word]: _, ...more } = schema;
  return more;
}

function intersection(types) {
  return types.length === 1 ? types[0] : types.map((one) => (one.includes(" | ") ? `(${one})` : one)).join(" & ");
}

function union(types) {
  return [...new Set(types)].join(" | ");
}

function plain(schema, depth) {
  switch (schema.type) {
    case "null":
      return "null";
    case "boolean":
      return "boolean";
    case "string":
      return "string";
    case "integer":
    case "number":
      return "number";
    case "array":
      return array(schema, depth);
    case "object":
    case undefined:
      return object(schema, depth);
    default:
      throw new Error(`no type for ${JSON.stringify(schema)}`);
  }
}

function array(schema, depth) {
  if (schema.prefixItems) return `[${schema.prefixItems.map((one) => type(one, depth)).join(", ")}]`;
  const item = type(schema.items ?? true, depth);
  const count = schema.minItems;
  if (count !== undefined && count === schema.maxItems && count <= 6) return `[${Array(count).fill(item).join(", ")}]`;
  return /[|&]/.test(item) && !item.startsWith("{") ? `(${item})[]` : `${item}[]`;
}

function object(schema, depth) {
  const members = Object.entries(schema.properties ?? {});
  const more = schema.additionalProperties;
  if (members.length === 0) {
    if (schema.type === undefined && more === undefined) return "unknown";
    return more === false ? "Record<string, never>" : `{ [name: string]: ${type(more ?? true, depth)} }`;
  }
  const lines = members.map(([name, of]) => member(name, of, schema.required ?? [], depth + 1));
  // Further members from a driver: of any type, so that the members above are compatible.
  if (more !== undefined && more !== false) lines.push(`${indent(depth + 1)}[more: string]: unknown;`);
  return `{\n${lines.join("\n")}\n${indent(depth)}}`;
}

function member(name, of, required, depth) {
  const key = /^[A-Za-z_]\w*$/.test(name) ? name : JSON.stringify(name);
  return `${doc(of, depth)}${indent(depth)}${key}${required.includes(name) ? "" : "?"}: ${type(of, depth)};`;
}

function doc(of, depth) {
  const words = of.description?.trim().replaceAll("*/", "*\\/");
  if (!words) return "";
  const lines = words.split("\n");
  if (lines.length === 1) return `${indent(depth)}/** ${words} */\n`;
  return `${indent(depth)}/**\n${lines.map((line) => `${indent(depth)} * ${line}`.trimEnd()).join("\n")}\n${indent(depth)} */\n`;
}

function indent(depth) {
  return "  ".repeat(depth);
}

function definition(name, of) {
  const body = type(of);
  const is_interface = body.startsWith("{") && !body.includes("} ");
  return `${doc(of, 0)}export ${is_interface ? `interface ${name} ` : `type ${name} = `}${body}${is_interface ? "" : ";"}\n`;
}

function call(name, of) {
  const lines = ["role", "arguments", "result"].map((word) => {
    return `    ${word}: ${word === "role" ? JSON.stringify(of.role) : type(of[word], 2)};`;
  });
  return `${doc({ description: of.words }, 1)}  ${name}: {\n${lines.join("\n")}\n  };`;
}

function file(schemas) {
  const definitions = Object.entries(schemas.$defs).sort(([one], [other]) => (one < other ? -1 : 1));
  const calls = Object.entries(schemas.calls);
  const lasting = calls.filter(([, of]) => of.lasts).map(([name]) => JSON.stringify(name));
  return [
    "// SPDX-License-Identifier: Apache-2.0",
    "// What the control interface takes and answers. Made by `npm run shapes` of crates/control/schemas/control-v1.json: not edited by hand.\n",
    ...definitions.map(([name, of]) => definition(name, of)),
    `/** The calls: the least role that may make each, its arguments, its answer. */\nexport interface Calls {\n${calls.map(([name, of]) => call(name, of)).join("\n")}\n}\n`,
    `/** The calls that last, and go on in slices. */\nexport const LASTING: ReadonlySet<string> = new Set([${lasting.join(", ")}]);\n`,
  ].join("\n");
}

const prints = process.argv.includes("--print");
const made = file(JSON.parse(readFileSync(prints ? 0 : SCHEMAS, "utf8")));
if (prints) {
  process.stdout.write(made);
} else if (!process.argv.includes("--check")) {
  writeFileSync(MADE, made);
} else if (readFileSync(MADE, "utf8") !== made) {
  process.stderr.write("src/control/shapes.ts is not what crates/control/schemas/control-v1.json says: npm run shapes\n");
  process.exit(1);
}
