// The live view in Chromium says in each state what holds: tracking, degraded, lost, found again,
// not found yet, no new picture, no connection, ended; on a narrow page, in two browsers. The
// program's answers are kept and given to the pages again, so that each state lasts as long as it
// is looked at. node states_test.mjs, with the arguments of common.mjs; the screenshots are PNGs in
// a folder.
import assert from 'node:assert/strict';
import {mkdirSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {deflateSync} from 'node:zlib';

import {inTime, launch, openPage, render, scratch, screenshot, track} from './common.mjs';
import {answersOf, Replay} from './replay.mjs';

const kWidth = 320, kHeight = 240, kFrames = 12, kBlack = [6, 7, 8, 9];
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

/**
 * The page, looked at while it shows the state. In one call: on a busy machine frames come late,
 * and the page says so a moment later.
 */
const look = async (page, state) =>
    (await page.waitForFunction((wanted) => {
      if (document.documentElement.dataset.state !== wanted) return false;
      const element = (id) => document.getElementById(id);
      const size = (node) => parseFloat(getComputedStyle(node).fontSize);
      return {
        word: element('state-word').textContent,
        say: element('state-say').textContent.replaceAll('\u00a0', ' '),
        colour: getComputedStyle(element('state')).backgroundColor,
        isLargest: [...document.querySelectorAll('body *')].every(
            (node) => size(node) <= size(element('state-word'))),
        sideways: document.documentElement.scrollWidth - document.documentElement.clientWidth,
        text: document.body.innerText,
        isStale: document.querySelector('.stage').classList.contains('stale'),
        isPictureGray: getComputedStyle(element('picture')).filter.includes('grayscale'),
        points: element('state-points').hidden ? '' : element('state-points').textContent,
        lastSeen: element('last-seen').hidden ? '' : element('last-seen').textContent,
        isFlashing: document.body.classList.contains('flashing'),
        takesPoints: element('click-hint').checkVisibility()
      };
    }, {polling: 50}, state)).jsonValue();

async function picture(page, name) {
  if (!screenshot) return;
  mkdirSync(screenshot, {recursive: true});
  await page.screenshot({path: join(screenshot, `${name}.png`)});
}

const kWords = {
  tracking: 'Tracking',
  degraded: 'Less sure',
  lost: 'Lost',
  relocalised: 'Found again',
  found: 'Found',
  unfound: 'Not found yet',
  stalled: 'No new picture',
  disconnected: 'No connection',
  ended: 'Ended',
};

async function lookAt(replay, pages, state) {
  replay.state = state;
  const [found] = await Promise.all(pages.map((page) => look(page, state)));
  assert.equal(found.word, kWords[state]);
  assert.ok(found.isLargest, `${state}: nothing on the page is larger than the state`);
  assert.equal(found.sideways, 0, state);
  await picture(pages[0], state);
  return found;
}

async function lookAtStates(page, other, replay, isPlain) {
  const tracking = await lookAt(replay, [page, other], 'tracking');
  assert.equal(tracking.isPictureGray, false);
  assert.match(tracking.points, /^$|followed$/);
  await page.waitForFunction(() => Number(document.documentElement.dataset.frame) > 1001);
  // A machine that is busy may draw 3D too slowly.
  const isDrawn = !isPlain && await (await page.waitForFunction(() => {
                                const {surfaceFrame, surface} = document.documentElement.dataset;
                                return surfaceFrame ? 'drawn' : surface;
                              })).jsonValue() === 'drawn';
  assert.match((await look(page, 'tracking')).text, /Measure depth/);
  assert.equal(tracking.isStale, false);
  assert.doesNotMatch(tracking.text, /not of now/);
  await page.click('#alarm-flash');

  const lost = await lookAt(replay, [page, other], 'lost');
  assert.match(lost.say, /not followed.*a picture is black.*What to do: check light/);
  assert.equal((await look(other, 'lost')).colour, kRed);
  assert.ok(lost.isFlashing);
  assert.doesNotMatch(lost.text, /No surface yet/);
  assert.doesNotMatch(lost.text, /0\.00 mm/);
  if (isDrawn) {
    assert.ok(lost.isStale);
    assert.match(lost.lastSeen, /^Last seen \d/);
  }

  const again = await lookAt(replay, [page, other], 'relocalised');
  assert.equal(again.isFlashing, false);
  assert.match(again.say, /was lost.*by eye\. Noticed now: some of the tissue does not look/);
  const unfound = await lookAt(replay, [page], 'unfound');
  assert.ok(unfound.isFlashing);
  const found = await lookAt(replay, [page], 'found');
  for (const {say} of [unfound, found]) assert.doesNotMatch(say, /lost|again/);
  for (const {say} of [again, found]) assert.doesNotMatch(say, /Why/);
  assert.ok(found.takesPoints);
  assert.ok(!unfound.takesPoints && !lost.takesPoints);
  assert.match((await lookAt(replay, [page], 'degraded')).say, /Why: something lies in front/);
  await page.click('#pause');
  await page.waitForFunction(() => !document.getElementById('paused').hidden);
  await lookAt(replay, [page], 'lost');  // the state goes on while the picture is paused
  await lookAt(replay, [page], 'tracking');
  await page.click('#pause');
  const stalled = await lookAt(replay, [page], 'stalled');
  assert.ok(stalled.isPictureGray, 'the picture that is no longer of now is gray');
  assert.equal(stalled.points, '');
  assert.ok(stalled.isFlashing);
  assert.equal(stalled.colour, kRed);
  assert.match(stalled.text, /Of the last picture, not of now/);
  await lookAt(replay, [page], 'tracking');
  for (const isBehindProxy of [false, true]) {
    replay.isBehindProxy = isBehindProxy;
    assert.equal((await lookAt(replay, [page], 'disconnected')).colour, kRed);
    await lookAt(replay, [page], 'tracking');
  }
  const ended = await lookAt(replay, [page, other], 'ended');
  assert.match(ended.say, /Nothing is followed/);
  assert.match(ended.text, /Of the last picture, not of now/);
  assert.ok(await page.$eval('#record', ({disabled}) => disabled));
  replay.state = 'disconnected';  // the program has gone, and the page goes on saying "Ended"
  await new Promise((resolve) => {
    setTimeout(resolve, 1500);
  });
  await look(page, 'ended');
}

async function watchStates(browser, replay) {
  const errors = [];
  const page = await openPage(browser, errors), other = await openPage(browser, errors);
  await other.setViewport({width: 800, height: 300});
  await other.goto(replay.url);
  await page.setViewport({width: 390, height: 700});
  await page.goto(replay.url);
  await page.bringToFront();
  const isPlain = await page.evaluate(() => document.documentElement.dataset.plain !== undefined);
  await lookAtStates(page, other, replay, isPlain);
  assert.deepEqual(errors, []);
}

const browser = await launch();
render(`${kWidth}x${kHeight}`, kFrames);
for (const view of ['left', 'right']) darken(view, kBlack);
const program = track('left', 'right', 2, '--out', 'states');
try {
  const replay = new Replay(await inTime(answersOf(program)));
  await inTime(watchStates(browser, replay));
} finally {
  program.kill('SIGKILL');
  browser.process()?.kill('SIGKILL');
}
console.log('passed');
process.exit(0);
