// The live view in Chromium says in each state what holds: tracking, degraded, lost, found again,
// no connection, ended; on a narrow page, in two browsers. node states_test.mjs, with the arguments
// of common.mjs; the screenshots are PNGs in a folder.
import assert from 'node:assert/strict';
import {mkdirSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {deflateSync} from 'node:zlib';

import {
  addressOf,
  inTime,
  launch,
  openPage,
  render,
  scratch,
  screenshot,
  track
} from './common.mjs';

const kWidth = 320, kHeight = 240;
// The pages are open before the first black frame comes, also on a busy machine.
const kFrames = 62;
const kBlack = [30, 31, 32, 33, 34, 35, 36, 37], kOneView = [46, 47, 48, 49, 50, 51];
const kRed = 'rgb(200, 30, 30)';

function crc32(bytes) {
  let crc = ~0;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; ++bit) crc = crc & 1 ? (crc >>> 1) ^ 0xedb88320 : crc >>> 1;
  }
  return ~crc >>> 0;
}

/** A black picture as a PNG. */
function blackPicture() {
  const chunk = (name, data) => {
    const body = Buffer.concat([Buffer.from(name), data]);
    const head = Buffer.alloc(4), tail = Buffer.alloc(4);
    head.writeUInt32BE(data.length);
    tail.writeUInt32BE(crc32(body));
    return Buffer.concat([head, body, tail]);
  };
  const head = Buffer.alloc(13);
  head.writeUInt32BE(kWidth, 0);
  head.writeUInt32BE(kHeight, 4);
  head.set([8, 2], 8);  // bits, colour
  return Buffer.concat([
    Buffer.from('\x89PNG\r\n\x1a\n', 'latin1'), chunk('IHDR', head),
    chunk('IDAT', deflateSync(Buffer.alloc((3 * kWidth + 1) * kHeight))),
    chunk('IEND', Buffer.alloc(0))
  ]);
}

function darken(view, frames) {
  for (const frame of frames)
    writeFileSync(
        join(scratch, 'sequence', view, `${String(frame).padStart(6, '0')}.png`), blackPicture());
}

/** What the page says at one moment. */
const look = (page) => page.evaluate(() => {
  const element = (id) => document.getElementById(id);
  const size = (node) => parseFloat(getComputedStyle(node).fontSize);
  return {
    word: element('state-word').textContent,
    say: element('state-say').textContent,
    colour: getComputedStyle(element('state')).backgroundColor,
    isLargest: [...document.querySelectorAll('body *')].every(
        (node) => size(node) <= size(element('state-word'))),
    sideways: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    text: document.body.innerText,
    isStale: document.querySelector('.stage').classList.contains('stale'),
    lastSeen: element('last-seen').hidden ? '' : element('last-seen').textContent,
    isFlashing: document.body.classList.contains('flashing')
  };
});

const stateIs = (page, state) => page.waitForFunction(
    (wanted) => document.documentElement.dataset.state === wanted, {polling: 50}, state);

async function picture(page, name) {
  if (!screenshot) return;
  mkdirSync(screenshot, {recursive: true});
  await page.screenshot({path: join(screenshot, `${name}.png`)});
}

async function lookAtStates(page, other) {
  await stateIs(page, 'tracking');
  await page.waitForFunction(() => Number(document.documentElement.dataset.frame) >= 1);
  const tracking = await look(page);
  assert.equal(tracking.word, 'Tracking');
  assert.ok(tracking.isLargest, 'nothing on the page is larger than the state');
  assert.equal(tracking.sideways, 0);
  assert.equal(tracking.isStale, false);
  assert.match(tracking.text, /Measure depth/);
  await page.click('#alarm-flash');
  await picture(page, 'tracking');

  await Promise.all([page, other].map((each) => stateIs(each, 'lost')));
  const lost = await look(page);
  assert.equal(lost.word, 'Lost');
  assert.match(lost.say, /not followed.*a picture is black/);
  assert.ok(lost.colour === kRed || lost.isFlashing, `red: ${lost.colour}`);
  assert.equal(lost.sideways, 0);
  assert.doesNotMatch(lost.text, /No surface yet/);
  assert.doesNotMatch(lost.text, /0\.00 mm/);
  assert.ok(lost.isFlashing);
  if (await page.evaluate(() => document.documentElement.dataset.plain === undefined)) {
    assert.ok(lost.isStale);
    assert.match(lost.lastSeen, /^Last seen \d/);
  }
  await picture(page, 'lost');

  // It lasts a frame, which a slow browser may miss; the list of changes has all.
  await page.waitForFunction(
      () => document.getElementById('changes').textContent.includes('Found again'));
  assert.equal((await look(page)).isFlashing, false);

  await stateIs(page, 'degraded');
  const degraded = await look(page);
  assert.equal(degraded.word, 'Less sure');
  assert.match(degraded.say, /Why: /);
  await picture(page, 'degraded');

  await Promise.all([page, other].map(
      (each) => each.waitForFunction(
          () => ['ended', 'disconnected'].includes(document.documentElement.dataset.state))));
  const ended = await look(page);
  assert.ok(['Ended', 'No connection'].includes(ended.word), ended.word);
  assert.doesNotMatch(ended.say, /is followed\.$/);
  assert.equal(ended.sideways, 0);
  await picture(page, 'ended');
}

async function watchRun(browser, program) {
  const errors = [], url = await addressOf(program);
  const page = await openPage(browser, errors), other = await openPage(browser, errors);
  await other.setViewport({width: 800, height: 300});
  await other.goto(url);
  await page.setViewport({width: 390, height: 700});
  await page.goto(url);
  await page.bringToFront();
  await lookAtStates(page, other);
  assert.deepEqual(errors, []);
}

/** A page of a program that is killed says that nobody answers. */
async function watchKilled(browser, program) {
  const errors = [], page = await openPage(browser, errors);
  await page.setViewport({width: 390, height: 700});
  await page.goto(await addressOf(program));
  await stateIs(page, 'tracking');
  await page.click('#pause');
  await page.waitForFunction(() => !document.getElementById('paused').hidden);
  program.kill('SIGKILL');
  await stateIs(page, 'disconnected');
  const killed = await look(page);
  assert.equal(killed.word, 'No connection');
  assert.equal(killed.colour, kRed);
  await picture(page, 'disconnected');
  assert.deepEqual(errors, []);
}

const browser = await launch();
render(`${kWidth}x${kHeight}`, kFrames);
darken('left', kBlack);
darken('right', [...kBlack, ...kOneView]);
const programs = [];
try {
  programs.push(track('left', 'right', 0.7, '--out', 'states'));
  await inTime(watchRun(browser, programs[0]));
  programs.push(track('left', 'right', 0.7, '--out', 'killed'));
  await inTime(watchKilled(browser, programs[1]));
} finally {
  for (const program of programs) program.kill('SIGKILL');
  browser.process()?.kill('SIGKILL');
}
console.log('passed');
process.exit(0);
