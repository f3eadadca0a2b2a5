// The live view in Chromium shows what is wrong with video and calibration: exchanged views, and
// nothing of a good recording. node checks_test.mjs, with the arguments of common.mjs; the
// screenshots are PNGs in a folder.
import assert from 'node:assert/strict';
import {mkdirSync} from 'node:fs';
import {join} from 'node:path';

import {
  addressOf,
  inTime,
  kWaitMs,
  launch,
  openPage,
  prolong,
  render,
  scratch,
  screenshot,
  track
} from './common.mjs';

const kRendered = 13;  // as many are looked at in this size
const kFramesPerSecond = screenshot ? 0.2 : 0.5;
// A run lasts longer than a wait of the second page. No longer than that: where the views are
// exchanged the search of a template goes through all of it.
const kFrames = kRendered + 1.2 * kWaitMs / 1000 * kFramesPerSecond;

const browser = await launch();
render('1280x720', kRendered);
prolong(kFrames);
const programs = [];

/** Begins a run, and returns the address of its view. */
function begin(left, right, out) {
  programs.push(track(left, right, kFramesPerSecond, '--out', out));
  return addressOf(programs.at(-1));
}

/** What was found, by the ids, once the page shows it. */
async function foundIn(page) {
  const isShown = () => document.documentElement.dataset.found !== undefined;
  await page.waitForFunction(isShown, {polling: 200});
  return page.evaluate(() => document.documentElement.dataset.found);
}

const stateOf = (page) => page.$eval('#checks-state', (state) => state.textContent);

/** [id, mark, text, whether it is seen] of each finding. */
const listOf = (page) => page.$$eval(
    '#checks li',
    (items) => items.map(
        (item) => [item.dataset.id, item.dataset.mark, item.textContent, item.checkVisibility()]));

async function takePictures(page, name) {
  if (!screenshot) return;
  mkdirSync(screenshot, {recursive: true});
  for (const width of [390, 1280])
    for (const scheme of ['light', 'dark']) {
      await page.setViewport({width, height: 900});
      await page.emulateMediaFeatures([{name: 'prefers-color-scheme', value: scheme}]);
      await page.screenshot({path: join(screenshot, `${name}_${width}_${scheme}.png`)});
    }
}

async function lookAtGood(page) {
  assert.equal(await foundIn(page), '');
  assert.equal(await stateOf(page), `At the start (first ${kRendered} frames): nothing was found.`);
  const list = await listOf(page);
  assert.ok(list.length > 10);
  for (const [id, mark, , isSeen] of list) {
    assert.ok(['fine', 'unknown'].includes(mark), `${id}: ${mark}`);
    assert.equal(isSeen, false, id);
  }
  assert.equal(list.find(([id]) => id === 'order')[1], 'fine');
  await takePictures(page, 'good');
  await page.click('#checks-rest-title');
  for (const [id, , , isSeen] of await listOf(page)) assert.equal(isSeen, true, id);
  await takePictures(page, 'good_open');
}

async function lookAtExchanged(page) {
  assert.equal(await foundIn(page), 'order');
  assert.equal(await stateOf(page), `At the start (first ${kRendered} frames): 1 problem.`);
  const list = await listOf(page);
  const [, mark, text, isSeen] = list[0];
  assert.equal(mark, 'error');
  assert.ok(isSeen);
  assert.equal(
      await page.$eval('#checks-link', (link) => !link.hidden && link.textContent),
      '1 problem in video or calibration');
  for (const part
           of ['Problem', 'order of the views', 'the views look exchanged',
               'What to do:', 'give the recording of --left as --right'])
    assert.ok(text.includes(part), `"${part}" in "${text}"`);
  for (const [id, , , isOpen] of list.slice(1)) assert.equal(isOpen, false, id);
  // It cannot be told while the views are exchanged.
  assert.equal(list.find(([id]) => id === 'pose')[1], 'unknown');
  await takePictures(page, 'exchanged');
}

/** Markup in a finding is text. */
async function lookAtMarkup(page, url) {
  const markup = '<img src=x onerror="document.title=1"> & "quotes"';
  const finding = {
    id: markup,
    title: markup,
    verdict: 'found',
    severity: 'error',
    what: markup,
    remedy: markup
  };
  await page.setRequestInterception(true);
  page.on('request', (request) => {
    if (!request.url().endsWith('/checks')) return request.continue();
    return request.respond({
      status: 200,
      contentType: 'application/json',
      body: JSON.stringify({frames: 12, findings: [finding, {...finding, id: 'exposure'}]})
    });
  });
  await page.goto(url);
  assert.equal(await foundIn(page), `${markup} exposure`);
  // Pictures of tissue that is followed are not black any more.
  await page.waitForFunction(
      () => document.getElementById('checks-link').textContent ===
          '1 problem in video or calibration');
  assert.equal(await page.$('#checks img'), null);
  assert.equal((await listOf(page))[0][2].split(markup).length, 4);
  assert.notEqual(await page.title(), '1');
}

/** Its surface is small as well, which takes the least time to draw without a GPU. */
async function openSmallPage(errors) {
  const page = await openPage(browser, errors);
  await page.setViewport({width: 390, height: 600});
  return page;
}

/** One page after the other: those behind are drawn slowly. */
async function look() {
  const errors = [];
  const url = await begin('left', 'right', 'good');
  const good = await openSmallPage(errors);
  const page = await (await good.goto(url)).text();
  assert.ok(page.includes('The first frames are being looked at.'));
  await inTime(lookAtGood(good));
  await good.close();
  const strange = await openSmallPage(errors);
  await inTime(lookAtMarkup(strange, url));
  await strange.close();
  programs[0].kill('SIGKILL');
  const exchanged = await openSmallPage(errors);
  await exchanged.goto(await begin('right', 'left', 'exchanged'));
  await inTime(lookAtExchanged(exchanged));
  assert.deepEqual(errors, []);
}

try {
  await look();
} finally {
  for (const program of programs) program.kill('SIGKILL');
  browser.process()?.kill('SIGKILL');
}
console.log('passed');
process.exit(0);
