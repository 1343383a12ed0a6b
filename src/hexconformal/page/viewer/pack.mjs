// Pack the viewer, with three.js and the style sheet, into ../packed: npm ci && npm run pack.
// The first line of the packed file is the digest of all that it was packed from, by which a test knows a stale one.
import { build } from "esbuild";
import { createHash } from "node:crypto";
import { mkdirSync, readdirSync, readFileSync, writeFileSync } from "node:fs";

const here = new URL(".", import.meta.url);
const text = (path) => readFileSync(new URL(path, here), "utf8");

const sources = readdirSync(here, { recursive: true })
  .filter((name) => !name.startsWith("node_modules"))
  .filter((name) => /\.(js|mjs|css)$/.test(name) || name === "package-lock.json")
  .sort();
const digest = createHash("sha256");
for (const name of sources) digest.update(`${name}\n${text(name)}`);

const three = JSON.parse(text("node_modules/three/package.json"));
const licence = text("node_modules/three/LICENSE");

const packed = await build({
  entryPoints: [new URL("main.js", here).pathname],
  bundle: true,
  minify: true,
  format: "iife",
  target: ["chrome103", "firefox113", "safari16.4"], // those that have DecompressionStream
  loader: { ".css": "text" },
  legalComments: "none",
  charset: "utf8",
  write: false,
});
// In a page the script stands between tags, which must not appear in it.
const script = packed.outputFiles[0].text.replaceAll("</script", "<\\/script").replaceAll("<!--", "<\\!--");
const head = [
  `// sha256 of the sources: ${digest.digest("hex")}`,
  `/*! hexconformal, MIT. With three.js ${three.version} (threejs.org):`,
  "",
  licence.trim(),
  "*/",
];
mkdirSync(new URL("../packed/", here), { recursive: true });
writeFileSync(new URL("../packed/viewer.js", here), `${head.join("\n")}\n${script}`);
console.log(`packed/viewer.js: ${Math.round(script.length / 1000)} kB with three.js ${three.version}`);
