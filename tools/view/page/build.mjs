// Makes the page: node build.mjs FOLDER writes page.html (one self-contained file), page.html.gz and page.html.d, which
// names the files that the page was made of, there.
import { build } from "esbuild";
import { createHash } from "node:crypto";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";

const kMostBytes = 1.5 * 1024 * 1024;
const here = dirname(fileURLToPath(import.meta.url));
const target = process.argv[2];
if (!target) {
  console.error("usage: node build.mjs FOLDER");
  process.exit(2);
}

const template = join(here, "src/index.html");
const sources = [template];

async function bundle(entry, options = {}) {
  const result = await build({
    entryPoints: [join(here, entry)],
    bundle: true,
    minify: true,
    write: false,
    metafile: true,
    legalComments: "none",
    logLevel: "warning",
    absWorkingDir: here,
    ...options,
  });
  sources.push(...Object.keys(result.metafile.inputs).map((input) => join(here, input)));
  return result.outputFiles[0].text;
}

const hash = (text) => `'sha256-${createHash("sha256").update(text, "utf8").digest("base64")}'`;

// "</script" inside a string would end the element early.
const script = (await bundle("src/main.ts", { format: "iife", target: "es2021" })).replaceAll("</script", "<\\/script");
const style = await bundle("src/style.css");

const policy = [
  "default-src 'none'",
  `script-src ${hash(script)}`,
  `style-src ${hash(style)}`,
  "connect-src 'self' ws: wss:",
  "img-src data: blob:",
  "base-uri 'none'",
  "form-action 'none'",
].join("; ");

const parts = { POLICY: policy, STYLE: style, SCRIPT: script };
const html = readFileSync(template, "utf8").replace(/\{\{(\w+)\}\}/g, (_, name) => parts[name]);
const bytes = Buffer.from(html, "utf8");
if (bytes.length > kMostBytes) {
  console.error(`build.mjs: page.html: expected at most ${kMostBytes} bytes, got ${bytes.length}`);
  process.exit(1);
}

mkdirSync(target, { recursive: true });
writeFileSync(join(target, "page.html"), bytes);
writeFileSync(join(target, "page.html.gz"), gzipSync(bytes, { level: 9 }));
const escape = (file) => file.replace(/[ #]/g, "\\$&").replaceAll("$", "$$$$");
writeFileSync(join(target, "page.html.d"), `${escape(join(target, "page.html"))}: ${sources.map(escape).join(" ")}\n`);
