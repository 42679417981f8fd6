// Bundles the page with three.js into dist/: names hold a digest of what is in them, so browsers keep them for good.
import { build } from "esbuild";
import { readFileSync, rmSync, writeFileSync } from "node:fs";

rmSync("dist", { recursive: true, force: true });
const { metafile } = await build({
  entryPoints: ["src/main.js", "src/style.css", "src/icon.svg"],
  bundle: true,
  minify: true,
  format: "esm",
  target: ["es2022"],
  loader: { ".svg": "copy" },
  outdir: "dist",
  entryNames: "[name]-[hash]",
  legalComments: "eof",
  metafile: true,
});
let page = readFileSync("src/index.html", "utf8");
for (const [path, { entryPoint }] of Object.entries(metafile.outputs)) {
  if (entryPoint) page = page.replace(entryPoint.replace("src/", "assets/"), path.replace("dist/", "assets/"));
}
writeFileSync("dist/index.html", page);
