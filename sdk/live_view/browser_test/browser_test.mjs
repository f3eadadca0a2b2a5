// The live view in Chromium: a click follows a point, targets are drawn, the record button records,
// a browser that vanishes harms nothing. node browser_test.mjs DEFREC FOLDER_OF_NODE_MODULES
// SCRATCH [SCREENSHOT.png] Exit code 77: skipped.
import assert from 'node:assert/strict';
import {spawn, spawnSync} from 'node:child_process';
import {once} from 'node:events';
import {existsSync, mkdirSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join, resolve} from 'node:path';
import {createInterface} from 'node:readline';

const kPatienceMs = 150000;  // on a busy machine
const [defrec, packages, scratch, screenshot] = process.argv.slice(2).map((path) => resolve(path));

function skip(reason) {
  console.log(`skipped: ${reason}`);
  process.exit(77);
}

const chromium = spawnSync('sh', ['-c', 'command -v chromium'], {encoding: 'utf8'}).stdout.trim();
if (!chromium) skip('chromium is not installed');
if (!existsSync(join(packages, 'node_modules')))
  skip('npm could not install the packages of this test');
const puppeteer = createRequire(join(packages, 'package.json'))('puppeteer-core');

rmSync(scratch, {recursive: true, force: true});
mkdirSync(scratch, {recursive: true});
const sequence = join(scratch, 'sequence'), out = join(scratch, 'tracked');
const size = screenshot ? '960x540' : '480x270';
const rendered = spawnSync(
    defrec, ['render', 'heartbeat', '--size', size, '--frames', '80', '--out', sequence],
    {encoding: 'utf8'});
assert.equal(rendered.status, 0, rendered.stderr);
// The last one lies beside all that is seen.
writeFileSync(
    join(scratch, 'targets.csv'), 'id,x,y,z,depth\n7,0,0,85,\n-3,6,-5,95,20\n8,900,900,80,\n');

const environment = {...process.env};
delete environment.LD_PRELOAD;  // of a sanitizer, which is not the browser's
const browser = await puppeteer.launch({
  executablePath: chromium,
  env: environment,
  args: [
    '--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
    '--disable-background-networking'
  ],
});
const program = spawn(
    defrec,
    [
      'track', '--left', 'sequence/left', '--right', 'sequence/right', '--calibration',
      'sequence/calibration.yaml', '--targets', 'targets.csv', '--out', 'tracked', '--backend',
      'cpu', '--fps', '0.5', '--realtime', '--no-overlay', '--view', '--quiet'
    ],
    {cwd: scratch, stdio: ['ignore', 'ignore', 'pipe']});
const ended = once(program, 'exit');
const failed = new Promise((_, reject) => {
  setTimeout(() => reject(new Error('the browser did not show it in time')), kPatienceMs).unref();
});

/** Whether targets are drawn on the left view, by their colour. */
function isDrawn(wanted) {
  const canvas = document.querySelector('#picture');
  const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  let count = 0;
  for (let i = 0; i < data.length; i += 4)
    count += data[i] > 180 && data[i + 1] < 160 && data[i + 2] > 200;
  return wanted ? count > 10 : count === 0;
}

async function look() {
  let url = '';
  for await (const line of createInterface(program.stderr)) {
    url = line.match(/http:\/\/127\.0\.0\.1:\d+\/\?token=[0-9a-f]{32}/)?.[0] ?? '';
    if (url) break;
  }
  assert.ok(url, 'the program prints the address');
  const page = await browser.newPage();
  page.setDefaultTimeout(kPatienceMs);
  const errors = [];
  page.on('pageerror', (error) => errors.push(error.message));
  const shown = (name) => page.evaluate((key) => document.documentElement.dataset[key], name);
  await page.setViewport({width: 1500, height: 1250});
  await page.goto(url);
  await page.waitForFunction(() => Number(document.documentElement.dataset.frame) >= 2);
  assert.equal(await shown('clicked'), '0');
  const box = await (await page.$('#picture')).boundingBox();
  await page.mouse.click(box.x + 0.45 * box.width, box.y + 0.55 * box.height);
  await page.waitForFunction(() => document.documentElement.dataset.clicked === '1');
  await page.waitForFunction(
      () => document.querySelector('#points table')?.textContent.includes('mm'));
  // In one call: $$eval finds elements in one and reads them in another, when they are replaced.
  const stages = await page.evaluate(
      () => [...document.querySelectorAll('#stages dt')].map(
          (name) => [name.textContent, parseFloat(name.nextElementSibling.textContent)]));
  assert.ok(
      stages.some(([name, ms]) => name === 'stereo' && ms > 0),
      `times of stages: ${JSON.stringify(stages)}`);
  assert.equal(new Set(stages.map(([name]) => name)).size, stages.length);
  const targets = await page.$$eval(
      '#targets-list tbody tr',
      (rows) => rows.map((row) => [...row.children].map((cell) => cell.textContent)));
  assert.deepEqual(
      targets.map(([id, depth, status]) => [id, depth, status]),
      [['7', '–', 'extrapolated'], ['-3', '20.00', 'extrapolated'], ['8', '–', 'lost']]);
  assert.ok(
      targets.slice(0, 2).every((row) => Number(row[4]) > 0),
      `expected errors: ${JSON.stringify(targets)}`);
  assert.ok(await page.evaluate(
      () => document.querySelector('#view').dataset.targets === '2' ||
          document.documentElement.dataset.plain !== undefined));
  await page.waitForFunction(isDrawn, {}, true);
  await page.click('#record');
  await page.waitForFunction(
      () => document.querySelector('#recording').textContent === 'recording_001.mp4');
  assert.ok(await page.evaluate(
      () => document.querySelector('#surface #no-surface').hidden ||
          document.documentElement.dataset.plain !== undefined));
  if (screenshot) await page.screenshot({path: screenshot});
  await page.click('#show-targets');
  await page.waitForFunction(isDrawn, {}, false);
  await page.click('#record');
  await page.waitForFunction(() => document.querySelector('#recording').textContent === '');

  const stranger = await browser.newPage();
  const refused = await stranger.goto(url.replace(/token=.*/, 'token=0'));
  assert.equal(refused.status(), 403);
  assert.deepEqual(errors, []);
  assert.equal(await shown('errors'), undefined);
  return Number(await shown('frame'));
}

try {
  const seen = await Promise.race([look(), failed]);
  browser.process().kill('SIGKILL');
  await new Promise((done) => {
    setTimeout(done, 5000);
  });
  program.kill('SIGINT');
  const [code] = await ended;
  assert.equal(code, 130);
  const rows = readFileSync(join(out, 'points.csv'), 'utf8')
                   .trim()
                   .split('\n')
                   .slice(1)
                   .map((row) => row.split(','));
  const last = Number(rows.at(-1)[0]);
  assert.ok(last > seen, `tracking went on after frame ${seen}, to ${last}`);
  const clicked = rows.filter(([, , id]) => Number(id) === 144);  // after a grid of 16 x 9
  assert.ok(clicked.length > 2);
  for (const row of clicked) assert.notEqual(row[8], 'lost');
  const [, , , x, y, z] = clicked[0].map(Number);
  assert.ok(Math.abs(x) < 20 && Math.abs(y) < 20 && z > 40 && z < 120);
  assert.ok(existsSync(join(out, 'recording_001.mp4')));
} finally {
  program.kill('SIGKILL');
  browser.process()?.kill('SIGKILL');
}
console.log('passed');
process.exit(0);
