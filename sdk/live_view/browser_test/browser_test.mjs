// The live view in Chromium: a click follows a point, targets are drawn, the record button records,
// a browser that vanishes harms nothing. node browser_test.mjs, with the arguments of common.mjs;
// the screenshot is a PNG.
import assert from 'node:assert/strict';
import {once} from 'node:events';
import {existsSync, readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';

import {
  addressOf,
  inTime,
  kPatienceMs,
  launch,
  openPage,
  prolong,
  render,
  scratch,
  screenshot,
  track
} from './common.mjs';

const browser = await launch();
const out = join(scratch, 'tracked');
// The run lasts longer than the patience with it.
render(screenshot ? '960x540' : '480x270', 40);
prolong(kPatienceMs / 1000);
// The last one lies beside all that is seen.
writeFileSync(
    join(scratch, 'targets.csv'), 'id,x,y,z,depth\n7,0,0,85,\n-3,6,-5,95,20\n8,900,900,80,\n');
const program = track('left', 'right', 1, '--targets', 'targets.csv', '--out', 'tracked');
const ended = once(program, 'exit');

/** Whether targets are drawn on the left view, by their colour. */
function isDrawn(wanted) {
  const canvas = document.querySelector('#picture');
  const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  let count = 0;
  for (let i = 0; i < data.length; i += 4)
    count += data[i] > 170 && data[i + 1] > 230 && data[i + 2] < 90;
  return wanted ? count > 10 : count === 0;
}

/**
 * A click at that place of the window, on what lies on top there, once the picture takes clicks:
 * not while a frame is late.
 */
const clickAt = (page, x, y) => page.waitForFunction((left, top) => {
  if (!document.querySelector('#picture').classList.contains('takes-points')) return false;
  const click = new MouseEvent('click', {clientX: left, clientY: top, bubbles: true});
  return document.elementFromPoint(left, top).dispatchEvent(click);
}, {}, x, y);

/** Once the page has said that, even if only for a moment, since listen(). */
const heard = (page, pattern) => page.waitForFunction(
    (source) => messages.some((text) => new RegExp(source).test(text)), {}, pattern.source);

const listen = (page) => page.evaluate(() => {
  globalThis.messages = [];
  new MutationObserver((records) => {
    for (const {addedNodes} of records) messages.push(...[...addedNodes].map((n) => n.textContent));
  }).observe(document.querySelector('#message'), {childList: true});
});

async function look(url) {
  const errors = [];
  const page = await openPage(browser, errors);
  const shown = (name) => page.evaluate((key) => document.documentElement.dataset[key], name);
  await page.setViewport({width: 1500, height: 1250});
  await page.goto(url);
  await page.waitForFunction(() => Number(document.documentElement.dataset.frame) >= 2);
  assert.equal(await shown('clicked'), '0');
  const box = await (await page.$('#picture')).boundingBox();
  await listen(page);
  await clickAt(page, box.x + 0.45 * box.width, box.y + 0.55 * box.height);
  await heard(page, /^Point #\d+ is followed, ±\d+\.\d mm\.$/);
  await page.waitForFunction(() => document.documentElement.dataset.clicked === '1');
  await page.waitForFunction(
      () => document.querySelector('#points table')?.textContent.includes('mm'));
  // The template does not reach the corners of the picture, which are round on the page.
  await clickAt(page, box.x + 5, box.y + 5);
  await heard(page, /no surface there/);
  assert.equal(await shown('clicked'), '1');
  assert.match(
      await page.$eval('#state-points', (line) => line.textContent),
      /^Points: 1 (seen|extrapolated), errors.up.to.\d+\.\d.mm$/);
  await page.type('#points input', 'vessel');
  await page.keyboard.press('Tab');
  await page.waitForFunction(
      () => document.querySelector('#points input').value === 'vessel' &&
          document.activeElement !== document.querySelector('#points input'));
  // In one call: $$eval finds elements in one and reads them in another, when they are replaced.
  const stages = await page.evaluate(
      () => [...document.querySelectorAll('#stages [data-stage]')].map(
          (row) => [row.dataset.stage, parseFloat(row.querySelector('dd').textContent)]));
  assert.ok(
      stages.some(([name, ms]) => name === 'stereo' && ms > 0),
      `times of stages: ${JSON.stringify(stages)}`);
  assert.equal(new Set(stages.map(([name]) => name)).size, stages.length);
  const targets = await page.$$eval(
      '#targets-list tbody tr',
      (rows) => rows.map((row) => [...row.children].map((cell) => cell.textContent)));
  assert.deepEqual(
      targets.map(([id, depth, status]) => [id, depth, status]),
      [['7', '–', 'placed'], ['-3', '20.0 mm', 'placed'], ['8', '–', 'not placed']]);
  assert.ok(
      targets.slice(0, 2).every((row) => parseFloat(row[4]) > 0),
      `expected errors: ${JSON.stringify(targets)}`);
  // A machine that is busy may draw 3D too slowly.
  await page.waitForFunction(
      () => document.querySelector('#view').dataset.targets === '2' ||
          document.documentElement.dataset.surface === 'off' ||
          document.documentElement.dataset.plain !== undefined);
  await page.waitForFunction(isDrawn, {}, true);
  await page.click('#record');
  await page.waitForFunction(
      () => document.querySelector('#recording').textContent === 'recording_001.mp4');
  assert.ok(await page.evaluate(
      () => document.querySelector('#surface #no-surface').hidden ||
          document.documentElement.dataset.surface === 'off' ||
          document.documentElement.dataset.plain !== undefined));
  if (screenshot) await page.screenshot({path: screenshot});
  await page.click('#show-targets');
  await page.waitForFunction(isDrawn, {}, false);
  await page.click('#record');
  await page.waitForFunction(() => document.querySelector('#recording').textContent === '');
  assert.equal(await page.$eval('#points input', (input) => input.value), 'vessel');
  // By the keyboard, and not at once.
  await page.focus('#points button');
  const asked = () => page.$eval(
      '#points button',
      (button) =>
          [document.activeElement === button, getComputedStyle(button, '::before').content,
           button.getAttribute('aria-label')]);
  await page.keyboard.press('Enter');
  const [isFocused, word, label] = await asked();
  assert.deepEqual([isFocused, word], [true, '"Remove?"']);
  assert.match(label, /^Remove point \d+\? Press again/);
  assert.equal(await shown('clicked'), '1');
  await page.waitForFunction(
      () => !document.querySelector('#points button').classList.contains('asks'));
  assert.equal((await asked())[1], '"Remove"');
  await page.keyboard.press('Enter');
  await page.keyboard.press('Enter');
  await heard(page, /^Point vessel removed\.$/);
  await page.waitForFunction(() => document.documentElement.dataset.clicked === '0');
  assert.equal(await page.$('#points input'), null);

  const stranger = await browser.newPage();
  const refused = await stranger.goto(url.replace(/token=.*/, 'token=0'));
  assert.equal(refused.status(), 403);
  assert.deepEqual(errors, []);
  assert.equal(await shown('errors'), undefined);
  return Number(await shown('frame'));
}

/** Once a frame later than that is tracked. */
async function nextFrame(url, frame) {
  const {origin, searchParams} = new URL(url);
  const headers = {'X-Token': searchParams.get('token')};
  let status = 204;
  while (status === 204) ({status} = await fetch(`${origin}/frame?after=${frame}`, {headers}));
  assert.equal(status, 200);
}

try {
  const url = await addressOf(program);
  const seen = await inTime(look(url));
  browser.process().kill('SIGKILL');
  await inTime(nextFrame(url, seen));
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
  assert.ok(!rows.some(([, , id]) => Number(id) === 145), 'beside the surface there is no point');
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
