// Bundles the page and writes it as the C++ source of page.hpp.
// node build.mjs FOLDER_OF_NODE_MODULES OUTPUT.cpp
import { readFileSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const [packages, output] = process.argv.slice(2);
const here = dirname(fileURLToPath(import.meta.url));
const esbuild = createRequire(join(packages, 'package.json'))('esbuild');

function licence(name) {
  const folder = join(packages, 'node_modules', name);
  const about = JSON.parse(readFileSync(join(folder, 'package.json'), 'utf8'));
  return { name, version: about.version, licence: about.license, text: readFileSync(join(folder, 'LICENSE'), 'utf8').trim() };
}

const bundle = await esbuild.build({
  entryPoints: [join(here, 'main.js')],
  bundle: true,
  minify: true,
  write: false,
  outdir: 'out',
  format: 'iife',
  target: 'es2022',
  charset: 'utf8',
  legalComments: 'inline',
  nodePaths: [join(packages, 'node_modules')],
  define: { LICENCES: JSON.stringify([licence('three'), licence('uplot')]) },
});
const text = (ending) => bundle.outputFiles.find((file) => file.path.endsWith(ending)).text;
const script = text('.js');
const style = text('.css');
if (/<\/script|<!--/i.test(script) || /<\/style/i.test(style)) throw new Error('the bundle would end its own element');

// Functions as replacements: the texts may hold "$".
const page = readFileSync(join(here, 'index.html'), 'utf8')
  .replace('/*STYLE*/', () => style)
  .replace('/*SCRIPT*/', () => script);
const [before, after] = page.split('/*DATA*/');

// A string literal of more than 64 KiB is beyond what C++ promises.
function literals(content) {
  const bytes = Buffer.from(content, 'utf8');
  const parts = [];
  for (let start = 0; start < bytes.length; start += 60000) {
    let part = '';
    for (const byte of bytes.subarray(start, start + 60000)) {
      if (byte === 0x0a) part += '\\n';
      else if (byte === 0x22 || byte === 0x5c) part += '\\' + String.fromCharCode(byte);
      else if (byte === 0x3f || byte < 0x20 || byte > 0x7e) part += '\\' + byte.toString(8).padStart(3, '0');
      else part += String.fromCharCode(byte);
    }
    parts.push(`    "${part}"sv,\n`);
  }
  return parts.join('');
}

writeFileSync(output, `// Written by web/build.mjs; do not edit.
#include "sdk/cli/report/page.hpp"

using namespace std::string_view_literals;

namespace defrec::cli {
namespace {
constexpr std::string_view kBefore[] = {
${literals(before)}};
constexpr std::string_view kAfter[] = {
${literals(after)}};
}  // namespace

std::span<const std::string_view> page_before_data() { return kBefore; }
std::span<const std::string_view> page_after_data() { return kAfter; }
}  // namespace defrec::cli
`);
