// SPDX-License-Identifier: Apache-2.0
// Unpacks the browser that an npm package brings, with the libraries that a machine without a browser may lack: node browser.mjs FOLDER, where the
// package was installed. FOLDER/chromium starts it.
import { execFileSync } from "node:child_process";
import { chmodSync, createReadStream, createWriteStream, existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { resolve } from "node:path";
import { pipeline } from "node:stream/promises";
import { brotliDecompressSync, createBrotliDecompress } from "node:zlib";

const folder = resolve(process.argv[2]);
const packed = `${folder}/node_modules/@sparticuz/chromium/bin`;
const program = `${folder}/unpacked/chromium`;
mkdirSync(`${folder}/unpacked`, { recursive: true });
await pipeline(createReadStream(`${packed}/chromium.br`), createBrotliDecompress(), createWriteStream(program));
chmodSync(program, 0o755);
for (const name of ["al2023", "fonts", "swiftshader"]) {
  const to = name === "swiftshader" ? `${folder}/unpacked` : `${folder}/unpacked/${name}`;
  mkdirSync(to, { recursive: true });
  execFileSync("tar", ["-x", "-C", to], { input: brotliDecompressSync(readFileSync(`${packed}/${name}.tar.br`)) });
}
// Only what this machine lacks is taken from the package.
const lacks = execFileSync("ldd", [program]).includes("not found");
const settings = [
  ...(lacks ? [`LD_LIBRARY_PATH="${folder}/unpacked/al2023/lib"`] : []),
  ...(existsSync("/etc/fonts") ? [] : [`FONTCONFIG_PATH="${folder}/unpacked/fonts"`]),
];
writeFileSync(`${folder}/chromium`, `#!/bin/sh\n${settings.join(" ")} exec "${program}" "$@"\n`);
chmodSync(`${folder}/chromium`, 0o755);
