// Bundles the page into ../emulator/live/page, or elsewhere with a folder as argument. The same sources and
// package-lock.json give the same bytes, which is how CI knows that what is committed was built from them.
import { build } from "esbuild";
import { copyFileSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { gzipSync } from "node:zlib";

const folder = process.argv[2] ?? join("..", "emulator", "live", "page");
mkdirSync(folder, { recursive: true });
await build({
  entryPoints: { app: "src/main.ts" },
  bundle: true,
  minify: true,
  format: "iife", // JupyterHub refuses requests for modules, because browsers mark them as CORS
  target: "es2022",
  legalComments: "none",
  loader: { ".css": "css" },
  outdir: folder,
});
for (const name of ["index.html", "icon.svg"]) copyFileSync(join("src", name), join(folder, name));
const parts = ["three", "@xterm/xterm", "@xterm/addon-fit", "@xterm/addon-search", "uplot"];
const licences = parts.map((name) => {
  const text = readFileSync(join("node_modules", name, "LICENSE"), "utf8").replaceAll("\r\n", "\n").trim();
  const { version } = JSON.parse(readFileSync(join("node_modules", name, "package.json"), "utf8"));
  return `${name} ${version}\n\n${text}\n`;
});
const rule = `\n${"-".repeat(80)}\n\n`;
writeFileSync(join(folder, "LICENSES.txt"), `app.js and app.css contain these packages.${rule}${licences.join(rule)}`);
const sizes = ["app.js", "app.css", "index.html"].map((name) => gzipSync(readFileSync(join(folder, name))).length);
console.log(`${folder}: ${Math.round(sizes.reduce((a, b) => a + b) / 1000)} kB compressed`);
