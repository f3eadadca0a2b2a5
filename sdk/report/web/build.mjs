// Bundles a page with the packages of npm.
// node build.mjs FOLDER_OF_NODE_MODULES FOLDER OUTPUT.html
// FOLDER: with index.html and main.js
import {readFileSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join} from 'node:path';

const [packages, folder, output] = process.argv.slice(2);
const esbuild = createRequire(join(packages, 'package.json'))('esbuild');

function licence(name) {
  const path = join(packages, 'node_modules', name);
  const about = JSON.parse(readFileSync(join(path, 'package.json'), 'utf8'));
  return {
    name,
    version: about.version,
    licence: about.license,
    text: readFileSync(join(path, 'LICENSE'), 'utf8').trim()
  };
}

const bundle = await esbuild.build({
  entryPoints: [join(folder, 'main.js')],
  bundle: true,
  minify: true,
  write: false,
  outdir: 'out',
  format: 'iife',
  target: 'es2022',
  charset: 'utf8',
  legalComments: 'inline',
  nodePaths: [join(packages, 'node_modules')],
  define: {LICENCES: JSON.stringify([licence('three'), licence('uplot')])},
});
const text = (ending) => bundle.outputFiles.find((file) => file.path.endsWith(ending)).text;
const script = text('.js');
const style = text('.css');
if (/<\/script|<!--/i.test(script) || /<\/style/i.test(style))
  throw new Error('the bundle would end its own element');

// Functions as replacements: the texts may hold "$".
const page = readFileSync(join(folder, 'index.html'), 'utf8')
                 .replace('/*STYLE*/', () => style)
                 .replace('/*SCRIPT*/', () => script);
writeFileSync(output, page);
