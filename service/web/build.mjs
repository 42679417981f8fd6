// Bundles the page with three.js into dist/, which is committed: installing motionenv needs neither npm nor its registry.
// File names carry a hash of their content, so browsers may cache them forever. dist/SOURCES is the digest of what the
// bundle was built from; tests/service/routes/test_page.py compares it with the sources.
import { build } from "esbuild";
import { createHash } from "node:crypto";
import { readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";

rmSync("dist", { recursive: true, force: true });
const { metafile } = await build({
  entryPoints: ["src/main.js", "src/style.css", "src/icon.svg", "src/docs/contents.js", "src/docs/contents.css"],
  outbase: "src",
  bundle: true,
  minify: true,
  format: "iife", // the documentation opens its pages from disk, where browsers load no modules
  target: ["es2022"],
  loader: { ".svg": "copy" },
  outdir: "dist/assets",
  entryNames: "[name]-[hash]", // of the page, and of the API's reference
  legalComments: "eof",
  metafile: true,
});
let page = readFileSync("src/index.html", "utf8");
for (const [path, { entryPoint }] of Object.entries(metafile.outputs)) {
  if (entryPoint) page = page.replace(entryPoint.replace("src/", "assets/"), path.replace("dist/", ""));
}
// In the page itself, as it is what a slow line shows first.
page = page.replace("assets/poster.webp", `data:image/webp;base64,${readFileSync("src/poster.webp").toString("base64")}`);
writeFileSync("dist/index.html", page);

const inSrc = readdirSync("src", { recursive: true, withFileTypes: true }).filter((entry) => entry.isFile());
const sources = [...inSrc.map(({ parentPath, name }) => `${parentPath}/${name}`), "build.mjs", "package-lock.json", "package.json"];
const digest = createHash("sha256");
for (const path of sources.sort()) digest.update(`${path}\0`).update(readFileSync(path)).update("\0");
writeFileSync("dist/SOURCES", `${digest.digest("hex")}\n`);
