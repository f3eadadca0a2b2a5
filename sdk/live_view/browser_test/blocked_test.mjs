// The live view in Chromium where the page is kept from running, and where 3D is slow: the state
// does not stay. node blocked_test.mjs, with the arguments of common.mjs; the screenshots are PNGs
// in a folder.
import assert from 'node:assert/strict';
import {mkdirSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';

import {inTime, launch, openPage, render, scratch, screenshot, track} from './common.mjs';
import {answersOf, Replay} from './replay.mjs';

const kStalledMs = 3000;  // of the replay

/** The pictures that the browser composes, without the page's help: {next, stop}. */
async function watchScreen(page) {
  const session = await page.createCDPSession();
  let newest = null, take = null;
  session.on('Page.screencastFrame', ({data, sessionId}) => {
    session.send('Page.screencastFrameAck', {sessionId}).catch(() => {});
    newest = data;
    take?.();
  });
  await session.send('Page.startScreencast', {format: 'png', everyNthFrame: 1});
  return {
    async next() {
      if (!newest)
        await new Promise((resolve) => {
          take = resolve;
        });
      const picture = newest;
      newest = null;
      return picture;
    },
    stop: () => session.send('Page.stopScreencast')
  };
}

/** [red, green, blue] at places of the page, by another one; else in the banner's corner. */
const coloursOf = (page, png, places = [[4, 4]]) => page.evaluate(async (data, all) => {
  const response = await fetch(`data:image/png;base64,${data}`);
  const bitmap = await createImageBitmap(await response.blob());
  const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
  context.drawImage(bitmap, 0, 0);
  return all.map(([x, y]) => [...context.getImageData(x, y, 1, 1).data].slice(0, 3));
}, png, places);
const colourOf = async (page, png) => (await coloursOf(page, png))[0];

/** Whether any of the colours is not gray. */
const hasColour = (colours) => colours.some((each) => Math.max(...each) - Math.min(...each) > 25);

/** Places all over an element that is in sight. */
const placesOn = (page, selector) => page.$eval(selector, (node) => {
  const {left, top, width, height} = node.getBoundingClientRect();
  const shares = [0.15, 0.3, 0.45, 0.6, 0.75];
  return shares.flatMap(
      (x) => shares.map((y) => [Math.round(left + x * width), Math.round(top + y * height)]));
});

const isRed = ([red, green, blue]) => red > 150 && green < 80 && blue < 80;

/** A page on which a frame is drawn; its states are listed in shownStates, from block() on. */
async function openAt(browser, replay, errors, before) {
  const page = await openPage(browser, errors);
  await page.setViewport({width: 1280, height: 800});
  if (before) await page.evaluateOnNewDocument(before);
  await page.goto(replay.url);
  await page.bringToFront();
  await page.waitForFunction(() => document.documentElement.dataset.frame);
  await page.evaluate(() => {
    const root = document.documentElement;
    new MutationObserver(() => globalThis.shownStates?.push(root.dataset.state)).observe(root, {
      attributeFilter: ['data-state']
    });
  });
  return page;
}

/** Until the program answers, the page's script does not run. */
const block = (page) => page.evaluate(() => {
  globalThis.shownStates = [];
  const request = new XMLHttpRequest();
  request.open('GET', '/wait', false);
  request.send();
});

/**
 * The banner turns red and the page gray by itself, with its age. Afterwards the page does not take
 * an old answer for a new one, and says what happened meanwhile.
 */
async function lookAtBlocked(browser, replay) {
  const errors = [], eye = await browser.newPage();
  const page = await openAt(browser, replay, errors);
  const places = await placesOn(page, '#picture');
  const screen = await watchScreen(page);
  let before = '';
  do before = await screen.next();
  while (isRed(await colourOf(eye, before)) || !hasColour(await coloursOf(eye, before, places)));
  // The colours of the page beneath the banner.
  await page.evaluate(() => {
    document.getElementById('tools').style.background = '#fc0';
  });
  const tools = await placesOn(page, '#tools');
  const blocked = block(page);
  while (!replay.waiting.length)
    await new Promise((resolve) => {
      setTimeout(resolve, 20);
    });
  let picture = '';
  do picture = await screen.next();
  while (!isRed(await colourOf(eye, picture)));
  assert.ok(!hasColour(await coloursOf(eye, picture, places)), 'a picture that is old is gray');
  assert.ok(!hasColour(await coloursOf(eye, picture, tools)), 'the page is gray');
  if (screenshot) writeFileSync(join(screenshot, 'blocked.png'), Buffer.from(picture, 'base64'));
  await screen.stop();
  // An answer that waits for the page is older than that by now, and there is no other.
  await new Promise((resolve) => {
    setTimeout(resolve, kStalledMs);
  });
  replay.state = 'stalled';
  replay.release();
  await blocked;
  await page.waitForFunction(() => document.documentElement.dataset.state === 'stalled');
  assert.deepEqual(
      (await page.evaluate(() => shownStates)).filter((state) => state !== 'stalled'), [],
      'an old answer is no state of now');
  // The program has said that there is no newer frame.
  await page.waitForFunction(
      () => document.querySelector('#changes .chip').textContent === 'No new picture');
  replay.missed = ['lost', 'relocalised'];
  replay.state = 'tracking';
  await page.waitForFunction(() => document.documentElement.dataset.state === 'tracking');
  const words = await page.$$eval('#changes .chip', (chips) => chips.map((c) => c.textContent));
  assert.deepEqual(
      words.slice(0, 5), ['Tracking', 'Found again', 'Lost', 'No new picture', 'Tracking']);
  assert.deepEqual(errors, []);
  await page.close();
}

/**
 * Each picture in 3D takes longer than a second: 3D goes off, and says so; a button brings it
 * back.
 */
async function lookAtSlow(browser, replay) {
  const errors = [];
  const page = await openAt(browser, replay, errors, () => {
    const look = WebGL2RenderingContext.prototype.clientWaitSync;
    let begun = null;
    WebGL2RenderingContext.prototype.clientWaitSync = function(...args) {
      begun ??= performance.now();
      if (performance.now() - begun < (globalThis.drawMs ?? 1500)) return this.TIMEOUT_EXPIRED;
      begun = null;
      return look.apply(this, args);
    };
  });
  if (await page.evaluate(() => document.documentElement.dataset.plain !== undefined)) return;
  const why = () => page.$eval('#surface-off', (note) => note.checkVisibility() && note.innerText);
  await page.waitForFunction(() => document.documentElement.dataset.surface === 'off');
  assert.match(await why(), /3D is off: too slow on this computer\.\s+Switch 3D on/);
  assert.equal(await page.$eval('#show-surface', ({checked}) => checked), false);
  if (screenshot) await page.screenshot({path: join(screenshot, 'slow.png')});
  replay.state = 'lost';
  await page.waitForFunction(() => document.documentElement.dataset.state === 'lost');
  replay.state = 'tracking';
  await page.waitForFunction(() => document.documentElement.dataset.state === 'tracking');
  await page.evaluate(() => {
    globalThis.drawMs = 0;
  });
  await page.$eval('#surface-on', (button) => button.click());
  await page.waitForFunction(() => document.documentElement.dataset.surface === 'on');
  assert.equal(await why(), false);
  await page.$eval('#show-surface', (box) => box.click());
  assert.match(await why(), /^3D is off\.\s+Switch 3D on/);
  assert.deepEqual(errors, []);
  await page.close();
}

const browser = await launch();
render('320x240', 12);
if (screenshot) mkdirSync(screenshot, {recursive: true});
const program = track('left', 'right', 0.5, '--out', 'blocked');
try {
  const replay = new Replay(await inTime(answersOf(program, ['tracking'])));
  await inTime(lookAtBlocked(browser, replay));
  await inTime(lookAtSlow(browser, replay));
} finally {
  program.kill('SIGKILL');
  browser.process()?.kill('SIGKILL');
}
console.log('passed');
process.exit(0);
