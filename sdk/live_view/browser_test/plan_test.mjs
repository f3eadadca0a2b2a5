// A plan in Chromium: its part, targets and depths in the left view, in 3D, in the banner and in
// the list while it is followed, and nothing of it once the tissue is lost; and the palette of full
// screen. node plan_test.mjs, with the arguments of common.mjs; the screenshots are PNGs in a
// folder.
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {mkdirSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {fileURLToPath} from 'node:url';

import {defrec, inTime, launch, openPage, render, scratch, screenshot, track} from './common.mjs';
import {darken} from './darken.mjs';
import {answersOf, Replay} from './replay.mjs';

// Two frames at least are of state found and have the error of a view that is not late.
const kWidth = 320, kHeight = 240, kFrames = 14, kOneView = [6, 7, 8, 9], kBlack = [10, 11, 12, 13];
const kTargets = 16;
const kLeastContrast = 60;  // gray levels; 255 from black to white
const samples = fileURLToPath(new URL('../../../samples', import.meta.url));

function run(...options) {
  const done = spawnSync(defrec, options, {cwd: scratch, encoding: 'utf8'});
  assert.equal(done.status, 0, done.stderr);
}

/** As docs/program/plan.md does. */
function makePlan() {
  const video = [
    '--left', 'sequence/left', '--right', 'sequence/right', '--calibration',
    'sequence/calibration.yaml'
  ];
  run('track', ...video, '--frames', '0:2', '--no-overlay', '--save-template', 'organ.template',
      '--out', 'first');
  const pairs = [[-5, 3, 81], [20, 0, 85], [0, 20, 85], [-20, -10, 84]];
  writeFileSync(join(scratch, 'pairs.csv'), [
    'id,model_x,model_y,model_z,x,y,z,error_mm', ...pairs.map((p, i) => [i, ...p, ...p, 0.3])
  ].join('\n'));
  run('register', '--model', join(samples, 'tumour.obj'), '--unit', 'mm', '--template',
      'organ.template', '--pairs', 'pairs.csv', '--pairs-only', '--targets',
      join(samples, 'plan.csv'), '--plan', 'tumour.plan', '--out', 'registered');
}

/** What the page shows of the plan, once a frame is drawn whose state was shown before. */
async function look(page, state) {
  const frame = await (await page.waitForFunction((wanted) => {
                  const {state: shown, frame: drawn} = document.documentElement.dataset;
                  return shown === wanted && (drawn ?? '0');
                }, {polling: 50}, state)).jsonValue();
  return (await page.waitForFunction((wanted, before) => {
           const root = document.documentElement, element = (id) => document.getElementById(id);
           const rows = [...document.querySelectorAll('#plan tbody tr, #plan-targets tbody tr')];
           const more = document.querySelector('#plan-targets .more');
           if (root.dataset.state !== wanted || !(Number(root.dataset.frame) > before))
             return false;
           const is3D = root.dataset.plain === undefined && root.dataset.surface !== 'off';
           if (is3D && element('view').dataset.plan === undefined) return false;
           const canvas = element('picture');
           const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
           const count = (colour) => {
             let pixels = 0;
             for (let i = 0; i < data.length; i += 4)
               pixels += colour.every((value, k) => Math.abs(data[i + k] - value) < 24);
             return pixels;
           };
           return {
             banner: element('state-beneath').textContent.replaceAll('\u00a0', ' '),
             say: element('state-say').textContent,
             why: element('plan-why').textContent,
             badge: element('unplaced').checkVisibility() ? element('unplaced').textContent : '',
             weight: element('state-beneath').style.fontWeight,
             rows: rows.map((row) => [...row.children].map((cell) => cell.textContent)),
             part: count([236, 92, 246]),
             targets: count([198, 255, 26]),
             label: globalThis.label,
             is3D,
             triangles: Number(element('view').dataset.plan ?? 0),
             marks: Number(element('view').dataset.targets ?? 0),
             legend: element('legend').textContent,
             swatches:
                 document
                     .querySelectorAll(':is(#plan-list, #plan-targets-list) .swatch:not(.hollow)')
                     .length,
             more: more.checkVisibility() ? more.textContent : '',
             isStale: document.querySelector('.stage').classList.contains('stale')
           };
         }, {polling: 100}, state, Number(frame))).jsonValue();
}

async function picture(page, name) {
  if (!screenshot) return;
  mkdirSync(screenshot, {recursive: true});
  await page.screenshot({path: join(screenshot, `${name}.png`), fullPage: true});
}

async function lookAtPlan(page, replay) {
  const followed = await look(page, 'found');
  await picture(page, 'found');
  const [, placed, largest] = followed.banner.match(/^(.*), errors up to (\d\.\d) mm$/);
  assert.equal(placed, `Plan: 1 of 1 part, ${kTargets} of ${kTargets} targets placed`);
  assert.equal(Number(largest), Math.max(...followed.rows.map(([, , mm]) => parseFloat(mm))));
  assert.equal(followed.weight, '400');
  assert.match(followed.label, /^tumour \u00b1\d\.\d mm, \d+\.\d mm deep$/);
  const [part, ...targets] = followed.rows;
  const [name, status, error, depth] = part;
  // Beneath the surface that is the rule, and has no colour beside the part's own.
  assert.deepEqual([name, status], ['tumour', 'placed']);
  assert.equal(followed.swatches, 1);
  assert.ok(parseFloat(error) > 0 && parseFloat(error) < 3, error);
  assert.deepEqual(
      targets.map(([target]) => target), Array.from({length: kTargets}, (_, i) => `target ${i}`));
  const depths = targets.map((row) => parseFloat(row[3]));
  assert.ok(depths.every((mm) => mm > 1 && mm < 40), `depths: ${depths}`);
  // Target 8 lies 1.5 mm from the middle of the ball, whose radius is 4 mm.
  const deeper = depths[8] - parseFloat(depth);
  assert.ok(deeper > 2.3 && deeper < 4.1, `${depths[8]} and ${depth} mm deep`);
  assert.ok(followed.part > 30, `pixels of the part: ${followed.part}`);
  assert.ok(
      followed.targets > kTargets && followed.targets < 60 * kTargets,
      `pixels of the targets: ${followed.targets}`);
  if (followed.is3D) {
    assert.equal(followed.triangles, 80);
    assert.equal(followed.marks, kTargets);
    // What is drawn in 3D may be of an earlier frame: the depth stands in the list and the label.
    assert.match(followed.legend, /^tumour/);
    assert.doesNotMatch(followed.legend, /\d/);
  }

  assert.deepEqual([followed.why, followed.badge], ['', '']);
  [replay.state, replay.of] = ['degraded', 'one-view'];
  const oneView = await look(page, 'degraded');
  await picture(page, 'one_view');
  assert.equal(oneView.banner, `Plan: 0 of 1 part, 0 of ${kTargets} targets placed`);
  assert.match(oneView.say, /^Plan not placed: only one view shows the tissue/);
  assert.doesNotMatch(oneView.say, /Nothing of the tissue is seen/);
  assert.equal(oneView.say.match(/not measure depth/g).length, 1, oneView.say);
  assert.match(oneView.say, /depth\. Do not rely on any position\./);
  assert.match(oneView.say, /Why: the right picture is black/);
  assert.match(oneView.say, /What.to.do: check lens, cable and input of that view/);
  assert.equal(oneView.badge, 'Plan not placed');
  assert.match(oneView.why, /^Not placed: only one view shows the tissue/);
  for (const row of oneView.rows) assert.equal(row[1], 'not placed');
  assert.equal(oneView.swatches, kTargets + 1, 'a warning each, and no colour of the part');
  // It is of now, also where 3D is slow and shows a frame before.
  if (oneView.is3D) assert.equal(oneView.legend, 'tumour: not placed');

  [replay.state, replay.isGivenUp] = ['found', true];
  const givenUp = await look(page, 'found');
  assert.match(
      givenUp.say, /^Plan not placed: all places belong to a template that was given up\./);
  assert.match(givenUp.why, /^Not placed: all places belong to a template that was given up\.$/);
  replay.isGivenUp = false;

  // What is known of some vertices is not known of the part.
  [replay.state, replay.of] = ['tracking', 'partly'];
  const partly = await look(page, 'tracking');
  await picture(page, 'partly');
  assert.ok(partly.banner.startsWith(
      `Plan: 1 of 1 part partly known, ${kTargets} of ${kTargets} targets placed, errors up to `));
  assert.equal(partly.weight, '800');
  assert.match(partly.why, /^1 part partly known: too little/);
  assert.deepEqual(partly.rows[0].slice(0, 2), ['tumour', 'partly known']);
  assert.equal(partly.label, 'tumour partly known');
  assert.ok(partly.part > 30);
  assert.equal(partly.badge, '');
  if (partly.is3D) assert.match(partly.legend, /^tumour: partly known/);
  assert.doesNotMatch(partly.say, /not placed/);

  [replay.state, replay.of] = ['lost', null];
  const lost = await look(page, 'lost');
  await picture(page, 'lost');
  assert.equal(lost.banner, `Plan: 0 of 1 part, 0 of ${kTargets} targets placed`);
  assert.equal(lost.weight, '800');
  assert.deepEqual([lost.part, lost.targets], [0, 0], 'pixels of the plan');
  for (const [, lostStatus, lostError, lostDepth, place = '–'] of lost.rows)
    assert.deepEqual([lostStatus, lostError, lostDepth, place], ['not placed', '–', '–', '–']);
  assert.doesNotMatch(lost.say, /not placed/);
  assert.equal(lost.why, '');
  assert.equal(lost.badge, 'Plan not placed');
  if (lost.is3D) {
    assert.ok(lost.isStale);
    await page.waitForFunction(() => {
      const {textContent} = document.getElementById('legend');
      return textContent === 'tumour: not placed' && document.querySelector('#legend .hollow');
    });
  }

  replay.state = 'found';
  await look(page, 'found');
  await page.click('#show-plan');
  await page.waitForFunction(() => {
    const {dataset} = document.getElementById('view');
    return document.documentElement.dataset.surface === 'off' || dataset.plan === undefined ||
        (dataset.plan === '0' && dataset.targets === '0');
  });
}

/** Where the picture is does not depend on what the banner says. */
async function lookAtPlace(page, replay, name) {
  const places = [];
  for (const state of ['tracking', 'degraded', 'lost']) {
    replay.state = state;
    await look(page, state);
    await picture(page, `${name}_${state}`);
    places.push(await page.$eval('#picture', (canvas) => {
      const {left, top, width, height} = canvas.getBoundingClientRect();
      return {left, top, width, height};
    }));
  }
  for (const place of places.slice(1)) assert.deepEqual(place, places[0], name);
  replay.state = 'found';
  await look(page, 'found');
}

/** A list says how many rows are beneath its edge; a click goes there. */
async function lookAtMore(page) {
  const {width, height} = page.viewport();
  const more = () => page.$eval('#plan-targets .more', (note) => !note.hidden && note.textContent);
  assert.equal(await more(), false, 'all rows have room');
  await page.setViewport({width, height: 500});
  await page.waitForFunction(
      () => /more below$/.test(
          document.querySelector('#plan-targets .more:not([hidden])')?.textContent));
  const rows = parseInt((await more()).slice(2), 10);
  assert.ok(rows > 3 && rows < kTargets, `${rows} more`);
  await page.$eval('#plan-targets .more', (note) => note.click());
  await page.waitForFunction(() => document.querySelector('#plan-targets .more').hidden);
  await page.setViewport({width, height});
}

/**
 * How much the surface differs from what is behind it, in the middle of the 3D view: gray levels
 * of 255 on the screen.
 */
async function contrastOf3D(page, eye) {
  const stage = await page.$('.stage');
  const data = await stage.screenshot({encoding: 'base64'});
  return eye.evaluate(async (png) => {
    const bitmap =
        await createImageBitmap(await (await fetch(`data:image/png;base64,${png}`)).blob());
    const {width, height} = bitmap;
    const context = new OffscreenCanvas(width, height).getContext('2d');
    context.drawImage(bitmap, 0, 0);
    const gray = (x, y) => {
      const [red, green, blue] = context.getImageData(Math.round(x * width), y, 1, 1).data;
      return (red + green + blue) / 3;
    };
    let sum = 0, count = 0;
    for (let y = Math.round(0.4 * height); y < 0.6 * height; ++y)
      for (let x = 0.4; x < 0.6; x += 0.02, ++count) sum += Math.abs(gray(x, y) - gray(0.02, y));
    return sum / count;
  }, data);
}

/** Pixels of the 3D view that are violet as the part is, and the brightest level of their red. */
async function partIn3D(page, eye) {
  const stage = await page.$('.stage');
  const data = await stage.screenshot({encoding: 'base64'});
  return eye.evaluate(async (png) => {
    const bitmap =
        await createImageBitmap(await (await fetch(`data:image/png;base64,${png}`)).blob());
    const {width, height} = bitmap;
    const context = new OffscreenCanvas(width, height).getContext('2d');
    context.drawImage(bitmap, 0, 0);
    const {data: levels} = context.getImageData(0, 0, width, height);
    let pixels = 0, brightest = 0;
    for (let i = 0; i < levels.length; i += 4) {
      const [red, green, blue] = levels.slice(i, i + 3);
      if (Math.min(red, blue) < green + 20) continue;
      ++pixels;
      brightest = Math.max(brightest, red);
    }
    return {pixels, brightest};
  }, data);
}

/** A part that is not of now keeps a tint of its colour, darker, and alike in all palettes. */
async function lookAtOldPart(page, replay, eye) {
  const is3D = () => page.evaluate(() => {
    const {surface, surfaceFrame, plain} = document.documentElement.dataset;
    return Boolean(surfaceFrame) && surface !== 'off' && plain === undefined;
  });
  const isDim = (wanted) => page.waitForFunction(
      (dim) => document.documentElement.dataset.surface === 'off' ||
          document.getElementById('view').classList.contains('dimmed') === dim,
      {polling: 50}, wanted);
  if (!(await is3D())) return;
  await isDim(false);
  await page.waitForFunction(
      () => document.documentElement.dataset.surface === 'off' ||
          Number(document.getElementById('view').dataset.plan) > 0,
      {polling: 50});
  const live = await partIn3D(page, eye);
  replay.state = 'lost';
  await look(page, 'lost');
  await isDim(true);
  const old = {};
  for (const value of ['light', 'dark']) {
    await page.emulateMediaFeatures([{name: 'prefers-color-scheme', value}]);
    old[value] = await partIn3D(page, eye);
  }
  await page.emulateMediaFeatures([{name: 'prefers-color-scheme', value: 'light'}]);
  if (await is3D()) {
    const told = JSON.stringify({live, ...old});
    assert.ok(old.light.pixels > 0.3 * live.pixels, told);
    assert.ok(old.light.brightest < 0.85 * live.brightest, told);
    assert.deepEqual(old.dark, old.light, told);
  }
  replay.state = 'found';
  await look(page, 'found');
}

/** Also where it is dark, and gray because it is not of now. */
async function lookAtStale(page, replay, eye) {
  const isPlain = await page.evaluate(() => document.documentElement.dataset.plain !== undefined);
  if (isPlain) return;
  await page.setViewport({width: 800, height: 600});
  // Anew, where a machine that is busy drew it too slowly.
  await page.evaluate(() => {
    delete document.documentElement.dataset.surfaceFrame;
    document.getElementById('surface-on').click();
  });
  await page.waitForFunction(() => {
    const {surfaceFrame, surface} = document.documentElement.dataset;
    return surfaceFrame || surface === 'off';
  });
  replay.state = 'lost';
  await look(page, 'lost');
  await page.bringToFront();
  const contrast = await contrastOf3D(page, eye);
  if (await page.evaluate(() => document.documentElement.dataset.surface !== 'off'))
    assert.ok(contrast > kLeastContrast, `the surface differs by ${contrast} gray levels`);
  replay.state = 'found';
  await look(page, 'found');
}

async function lookAtFullScreen(page, replay, eye) {
  const ink = () => page.$eval('#points', (points) => getComputedStyle(points).color);
  assert.equal(await ink(), 'rgb(23, 32, 44)');
  await page.click('#full-screen');
  await page.waitForFunction(() => document.body.classList.contains('full'));
  await picture(page, 'full');
  assert.equal(await ink(), 'rgb(232, 237, 244)');
  assert.equal(await page.$eval('#overlay', ({checked}) => checked), false);
  await page.setViewport({width: 1280, height: 720});
  await lookAtPlace(page, replay, 'place_full');
  await lookAtStale(page, replay, eye);
  for (const [width, height, share] of [[1280, 800, 0.62], [844, 390, 0.5], [2560, 1440, 0.62]]) {
    await page.setViewport({width, height});
    // The page may not have laid out itself yet.
    await page.waitForFunction((least) => {
      const {left, right, top, bottom} = document.getElementById('picture').getBoundingClientRect();
      const {scrollWidth, scrollHeight} = document.documentElement;
      const above = document.getElementById('strip').getBoundingClientRect().bottom;
      return scrollWidth <= innerWidth && scrollHeight <= innerHeight && left >= 0 &&
          right <= innerWidth && top >= above && bottom <= innerHeight &&
          (right - left > least * innerWidth || bottom - top > least * innerHeight);
    }, {}, share);
    // In one call: $eval finds rows in one and reads them in another, when they are replaced.
    const [error, place] = await page.evaluate(() => {
      const {children} = document.querySelector('#plan-targets tbody tr');
      return [children[2], children[4]].map((cell) => cell.checkVisibility());
    });
    assert.deepEqual([error, place], [true, false]);
    const lists = await page.evaluate(() => {
      const box = document.getElementById('lists'), edge = box.getBoundingClientRect();
      const part = document.querySelector('#plan tbody tr').getBoundingClientRect();
      return {
        sideways: box.scrollWidth - box.clientWidth,
        hasPart: part.top >= edge.top && part.bottom <= edge.bottom
      };
    });
    assert.deepEqual(lists, {sideways: 0, hasPart: true}, `${width}x${height}`);
    await picture(page, `full_${width}x${height}`);
    // Also where the banner says most.
    [replay.state, replay.of] = ['degraded', 'one-view'];
    await look(page, 'degraded');
    const banner = await page.$eval('#state', ({offsetHeight}) => offsetHeight / innerHeight);
    assert.ok(banner < 0.3, `${width}x${height}: the banner takes ${banner} of the screen`);
    [replay.state, replay.of] = ['found', null];
    await look(page, 'found');
  }
  await page.click('#full-screen');
  await page.waitForFunction(() => !document.body.classList.contains('full'));
  assert.equal(await page.$eval('#overlay', ({checked}) => checked), true);
}

async function watchPlan(browser, replay) {
  const errors = [];
  const eye = await openPage(browser, errors), page = await openPage(browser, errors);
  await page.emulateMediaFeatures([{name: 'prefers-color-scheme', value: 'light'}]);
  await page.setViewport({width: 1280, height: 900});
  // Targets that have no name and are many have no label: it is that of the part.
  await page.evaluateOnNewDocument(() => {
    const draw = CanvasRenderingContext2D.prototype.fillText;
    CanvasRenderingContext2D.prototype.fillText = function(text, ...place) {
      if (this.canvas.id === 'picture') globalThis.label = text;
      return draw.call(this, text, ...place);
    };
  });
  await page.goto(replay.url);
  await page.bringToFront();
  await lookAtPlan(page, replay);
  await page.click('#show-plan');
  await lookAtOldPart(page, replay, eye);
  await lookAtPlace(page, replay, 'place');
  await lookAtMore(page);
  await lookAtFullScreen(page, replay, eye);
  assert.deepEqual(errors, []);
}

const browser = await launch();
render(`${kWidth}x${kHeight}`, kFrames);
makePlan();
darken(join(scratch, 'sequence', 'right'), kOneView, kWidth, kHeight);
for (const view of ['left', 'right'])
  darken(join(scratch, 'sequence', view), kBlack, kWidth, kHeight);
const program = track(
    'left', 'right', 1, '--from-template', 'organ.template', '--plan', 'tumour.plan', '--out',
    'tracked');
try {
  const answers = await inTime(answersOf(program, ['found', 'one-view', 'lost']));
  const {header, sections} = answers.found, [[name, , ...rest]] = header.plan.parts;
  const partly = {
    header: {...header, plan: {...header.plan, parts: [[name, 2, ...rest]]}},
    sections
  };
  const replay = new Replay({...answers, partly, tracking: answers.found});
  replay.state = 'found';
  await inTime(watchPlan(browser, replay));
} finally {
  program.kill('SIGKILL');
  browser.process()?.kill('SIGKILL');
}
console.log('passed');
process.exit(0);
