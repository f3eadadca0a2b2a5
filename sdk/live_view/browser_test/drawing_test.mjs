// What the page draws belongs together, in Chromium: the picture, the colour round it, its labels
// and the lists are of one frame; a picture or surface that is not of now is gray; one that is held
// keeps its colours and is marked. node drawing_test.mjs, with the arguments of common.mjs; the
// screenshots are PNGs in a folder.
import assert from 'node:assert/strict';
import {mkdirSync} from 'node:fs';
import {join} from 'node:path';

import {inTime, launch, openPage, render, scratch, screenshot, track} from './common.mjs';
import {darken} from './darken.mjs';
import {answersOf, Replay} from './replay.mjs';

const kWidth = 320, kHeight = 240, kFrames = 12, kBlack = [6, 7, 8, 9];

async function picture(page, name) {
  if (!screenshot) return;
  mkdirSync(screenshot, {recursive: true});
  await page.screenshot({path: join(screenshot, `${name}.png`)});
}

/** What the page shows once the function, run in it, returns true. */
async function lookWhen(page, isWanted, ...values) {
  await page.waitForFunction(isWanted, {polling: 50}, ...values);
  return page.evaluate(() => {
    const element = (id) => document.getElementById(id);
    const of = (id) => (element(id).hidden ? '' : element(id).textContent);
    const frame = document.querySelector('.picture-frame'),
          stage = document.querySelector('.stage');
    return {
      state: document.documentElement.dataset.state,
      error: document.querySelector('#points tr[data-id="900"] td:nth-child(3)')?.textContent,
      label: globalThis.labels.at(-1),
      isGray: getComputedStyle(element('picture')).filter.includes('grayscale'),
      isHeld: frame.classList.contains('held'),
      background: getComputedStyle(frame).backgroundImage,
      age: of('old-picture'),
      paused: of('paused'),
      pausedTop: element('paused').getBoundingClientRect().top,
      pictureBottom: element('picture').getBoundingClientRect().bottom,
      tag: element('picture-state').textContent,
      isSurfaceOld: stage.classList.contains('stale'),
      isSurfaceHeld: stage.classList.contains('held'),
      surfaceAge: of('last-seen'),
      surfaceFrame: document.documentElement.dataset.surfaceFrame
    };
  });
}

const isState = (state) => document.documentElement.dataset.state === state;

/** Pictures are decoded when the test lets them be, while it holds them. */
const holdPictures = (page) => page.evaluateOnNewDocument(() => {
  const decode = globalThis.createImageBitmap.bind(globalThis);
  globalThis.labels = [];
  globalThis.isHolding = false;
  globalThis.held = [];
  globalThis.createImageBitmap = async (...given) => {
    if (globalThis.isHolding) await new Promise((resolve) => globalThis.held.push(resolve));
    return decode(...given);
  };
  globalThis.letGo = () => {
    for (const resolve of globalThis.held.splice(0)) resolve();
  };
  const draw = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = function(text, ...place) {
    if (this.canvas.id === 'picture') globalThis.labels.push(text);
    return draw.call(this, text, ...place);
  };
});

/** A point with another expected error and state comes, and its picture does not yet. */
async function lookAtLatePicture(page, replay) {
  const point = replay.answers.tracking.header.points.at(-1);
  const wait = () => page.waitForFunction(() => globalThis.held.length > 0, {polling: 50});
  await lookWhen(page, isState, 'tracking');
  await page.evaluate(() => {
    globalThis.isHolding = true;
  });
  await wait();
  replay.state = 'degraded';
  point[9] = 2.7;
  // The picture that was waited for may be of the frame before.
  await page.evaluate(() => globalThis.letGo());
  await wait();
  const late = await lookWhen(page, () => true);
  assert.notEqual(late.state, 'degraded', 'the state does not come before the picture');
  assert.deepEqual([late.error, late.label], ['0.2 mm', '#900 \u00b10.2 mm']);
  await page.evaluate(() => {
    globalThis.isHolding = false;
    globalThis.letGo();
    globalThis.seen = [];
    const look = () => {
      const cell = document.querySelector('#points tr[data-id="900"] td:nth-child(3)');
      globalThis.seen.push([
        document.documentElement.dataset.state === 'degraded', cell.textContent === '2.7 mm',
        globalThis.labels.at(-1) === '#900 \u00b12.7 mm'
      ]);
      if (!globalThis.hasSeen) requestAnimationFrame(look);
    };
    look();
  });
  await lookWhen(page, isState, 'degraded');
  const seen = await page.evaluate(() => {
    globalThis.hasSeen = true;
    return globalThis.seen;
  });
  for (const each of seen) assert.equal(new Set(each).size, 1, `${seen}`);
  // What is red does not wait for a picture.
  await page.evaluate(() => {
    globalThis.isHolding = true;
  });
  await wait();
  replay.state = 'lost';
  await page.evaluate(() => globalThis.letGo());
  await lookWhen(page, isState, 'lost');
  await page.evaluate(() => {
    globalThis.isHolding = false;
    globalThis.letGo();
  });
  point[9] = 0.2;
  replay.state = 'tracking';
  await lookWhen(page, isState, 'tracking');
}

/** Whether 3D is drawn here; a machine that is busy may draw it too slowly. */
async function draws3D(page) {
  const drawn = await page.waitForFunction(() => {
    const {surfaceFrame, surface, plain} = document.documentElement.dataset;
    return (surfaceFrame && 'drawn') || (surface === 'off' && 'off') || (plain && 'off');
  });
  return await drawn.jsonValue() === 'drawn';
}

/** A view that stands still, or is black, though frames come. */
async function lookAtFaultyView(page, replay, is3D) {
  replay.isUnobserved = true;
  replay.fault = ['view-late', 'left'];
  replay.state = 'unusable';
  const left = await lookWhen(page, () => !document.getElementById('old-picture').hidden);
  assert.equal(left.state, 'unusable');
  assert.ok(left.isGray, 'a left view that stands still is no live picture');
  assert.match(left.age, /^Picture of \d.* s ago$/);
  await picture(page, 'left_still');
  replay.fault = ['dark, one-view', 'right'];
  const right = await lookWhen(page, () => document.getElementById('old-picture').hidden);
  assert.ok(!right.isGray, 'the left view is live');
  if (is3D) {
    assert.ok(right.isSurfaceOld, 'no depth is measured');
    assert.match(right.surfaceAge, /^Last seen \d.* s ago$/);
    assert.equal(right.surfaceFrame, left.surfaceFrame);
  }
  await picture(page, 'right_black');
  [replay.isUnobserved, replay.fault, replay.state] = [false, null, 'tracking'];
  const back = await lookWhen(
      page,
      () => document.documentElement.dataset.state === 'tracking' &&
          document.getElementById('old-picture').hidden);
  assert.ok(!back.isGray);
}

async function pause(page, on) {
  await page.click('#pause');
  return lookWhen(page, (wanted) => document.getElementById('paused').hidden !== wanted, on);
}

/** A live picture that is held can be studied, whatever happens then; an old one stays gray. */
async function lookAtHeld(page, replay) {
  const held = await pause(page, true);
  assert.ok(held.isHeld && !held.isGray);
  assert.match(held.paused, /^PAUSED – picture of \d.* s ago$/);
  assert.match(held.background, /repeating-linear-gradient/);
  assert.ok(held.pausedTop >= held.pictureBottom - 1, 'it hides nothing of the picture');
  if (held.isSurfaceHeld) assert.match(held.surfaceAge, /^PAUSED – \d.* s ago$/);
  await picture(page, 'held');
  for (const state of ['lost', 'stalled', 'tracking']) {
    replay.state = state;
    const goesOn = await lookWhen(page, isState, state);
    assert.ok(goesOn.isHeld && !goesOn.isGray, state);
    assert.match(goesOn.background, /repeating-linear-gradient/);
    await picture(page, `held_${state}`);
  }
  await pause(page, false);
  const live = await lookWhen(
      page, () => !document.querySelector('.picture-frame').classList.contains('held'));
  assert.deepEqual([live.isGray, live.background], [false, 'none']);
  replay.state = 'frozen';
  await lookWhen(page, isState, 'stalled');
  const frozen = await pause(page, true);
  assert.ok(frozen.isHeld && frozen.isGray);
  replay.state = 'tracking';
  assert.ok((await lookWhen(page, isState, 'tracking')).isGray, 'it is as old as before');
  await pause(page, false);
}

async function watchDrawing(browser, replay) {
  const errors = [], page = await openPage(browser, errors);
  await page.setViewport({width: 1280, height: 900});
  await holdPictures(page);
  await page.goto(replay.url);
  await page.bringToFront();
  const is3D = await draws3D(page);
  await lookAtLatePicture(page, replay);
  await lookAtFaultyView(page, replay, is3D);
  await lookAtHeld(page, replay);
  assert.deepEqual(errors, []);
}

const browser = await launch();
render(`${kWidth}x${kHeight}`, kFrames);
for (const view of ['left', 'right'])
  darken(join(scratch, 'sequence', view), kBlack, kWidth, kHeight);
const program = track('left', 'right', 0.5, '--out', 'drawing');
try {
  const answers = await inTime(answersOf(program));
  answers.tracking.header.points.push([900, 0, true, '', 160, 120, 0, 0, 80, 0.2]);
  await inTime(watchDrawing(browser, new Replay(answers)));
} finally {
  program.kill('SIGKILL');
  browser.process()?.kill('SIGKILL');
}
console.log('passed');
process.exit(0);
