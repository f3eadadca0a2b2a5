// The live view in Chromium says in each state what holds: tracking, degraded, lost, found again,
// not found yet, no new picture, no connection, ended; on a narrow page, in two browsers. The
// program's answers are kept and given to the pages again, so that each state lasts as long as it
// is looked at. node states_test.mjs, with the arguments of common.mjs; the screenshots are PNGs in
// a folder.
import assert from 'node:assert/strict';
import {mkdirSync} from 'node:fs';
import {join} from 'node:path';

import {inTime, launch, openPage, render, scratch, screenshot, track} from './common.mjs';
import {darken} from './darken.mjs';
import {answersOf, Replay} from './replay.mjs';

const kWidth = 320, kHeight = 240, kFrames = 12, kBlack = [6, 7, 8, 9];
const kRed = 'rgb(200, 30, 30)', kAmber = 'rgb(180, 83, 9)', kGreen = 'rgb(22, 101, 52)';

/**
 * The page, looked at while it shows the state. In one call: on a busy machine frames come late,
 * and the page says so a moment later.
 */
const look = async (page, state) =>
    (await page.waitForFunction((wanted) => {
      if (document.documentElement.dataset.state !== wanted) return false;
      const element = (id) => document.getElementById(id);
      const size = (node) => parseFloat(getComputedStyle(node).fontSize);
      // Colours are those between two flashes.
      for (const each of document.getAnimations())
        if (each.animationName) each.currentTime = 0;
      return {
        word: element('state-word').textContent,
        say: element('state-say').textContent.replaceAll('\u00a0', ' '),
        colour: getComputedStyle(element('state')).backgroundColor,
        frame: getComputedStyle(document.querySelector('.picture-frame')).backgroundColor,
        tag: element('picture-state').checkVisibility() ? element('picture-state').textContent : '',
        isLargest: [...document.querySelectorAll('body *')].every(
            (node) => size(node) <= size(element('state-word'))),
        sideways: document.documentElement.scrollWidth - document.documentElement.clientWidth,
        text: document.body.innerText,
        isStale: document.querySelector('.stage').classList.contains('stale'),
        isPictureGray: getComputedStyle(element('picture')).filter.includes('grayscale'),
        points: element('state-points').hidden ?
            '' :
            element('state-points').textContent.replaceAll('\u00a0', ' '),
        paused: element('paused').hidden ? '' : element('paused').textContent,
        pausedInBanner: element('state-paused').textContent,
        since: element('state-since').textContent,
        title: document.title,
        residual: element('residual').textContent,
        lastSeen: element('last-seen').hidden ? '' : element('last-seen').textContent,
        pictureOpacity: getComputedStyle(element('picture')).opacity,
        sidewaysLists: [...document.querySelectorAll('.scroll')]
                           .filter((box) => box.scrollWidth > box.clientWidth)
                           .map((box) => box.parentElement.id),
        pointsWeight: element('state-points').style.fontWeight,
        isFlashing: document.body.classList.contains('flashing'),
        takesPoints: element('click-hint').checkVisibility(),
        oldPicture: element('old-picture').hidden ? '' : element('old-picture').textContent,
        canAsk:
            [...document.querySelectorAll('#record, #pause, #points input, #points button')].map(
                ({disabled}) => !disabled)
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
  'given-up': 'Lost',
  unusable: 'One view only',
  stalled: 'No new picture',
  disconnected: 'No connection',
  ended: 'Ended',
};

/** isHeld: the picture is paused, and not of the state, which goes on. */
async function lookAt(replay, pages, state, isHeld = false) {
  replay.state = state;
  const [found] = await Promise.all(pages.map((page) => look(page, state)));
  assert.equal(found.word, kWords[state]);
  assert.ok(found.isLargest, `${state}: nothing on the page is larger than the state`);
  assert.equal(found.sideways, 0, state);
  assert.equal(found.tag, kWords[state]);
  if (!isHeld) assert.equal(found.frame, found.colour, state);
  await picture(pages[0], state);
  return found;
}

/** A picture that no other one follows is drawn as fine as it is shown in a window of any size. */
async function lookAtResized(page, width) {
  const {height} = page.viewport();
  for (const each of [width, page.viewport().width]) {
    await page.setViewport({width: each, height});
    await page.waitForFunction((size, picture) => {
      const canvas = document.getElementById('picture');
      if (innerWidth !== size || canvas.width < canvas.clientWidth) return false;
      // A canvas that got another size is transparent where nothing was drawn since.
      const {data} = canvas.getContext('2d').getImageData(canvas.width - 9, 9, 1, 1);
      return data[3] === 255 && canvas.width - canvas.clientWidth < picture;
    }, {}, each, kWidth);
  }
}

/** The contrast of a text with what is behind it, by WCAG 2. */
const contrastOf = (page, selector) => page.evaluate((wanted) => {
  const node = document.querySelector(wanted);
  const levels = (colour) => colour.match(/[\d.]+/g).map(Number);
  const luminance = (rgb) => {
    const [red, green, blue] = rgb.slice(0, 3).map(
        (level) => (
            level / 255 <= 0.04045 ? level / 255 / 12.92 : ((level / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
  };
  let behind = node;
  const back = () => levels(getComputedStyle(behind).backgroundColor);
  while (back()[3] === 0) behind = behind.parentElement;
  const [dark, bright] =
      [levels(getComputedStyle(node).color), back()].map(luminance).sort((a, b) => a - b);
  return (bright + 0.05) / (dark + 0.05);
}, selector);

/** A click that does nothing says why. */
async function clickPicture(page, message) {
  const said = await page.$eval('#picture', (canvas) => {
    canvas.click();
    return document.getElementById('message').textContent;
  });
  assert.match(said, message);
}

// Reasons and views of frames in which nothing is observed, and what is said of them.
const kFaults = [
  [
    ['dark, no-texture, one-view', 'right'],
    /: the right picture is black\. What.to.do: check lens, cable and input of that view\./
  ],
  [
    ['view-late', 'right'],
    /: the right picture stands still\. What.to.do: check that video input\./
  ],
  [['view-late', 'left'], /: the left picture stands still\. What.to.do: check that video input\./],
];

/** What is not measured is not to be used, and tells it as a loss does. */
async function lookAtUnusable(page, replay) {
  replay.isUnobserved = true;
  replay.fault = ['dark, one-view', 'right'];
  const oneView = await lookAt(replay, [page], 'unusable');
  assert.match(
      oneView.say, /^Do not use positions: one view does not.* Why: the right picture is black\./);
  assert.deepEqual([oneView.colour, oneView.isFlashing, oneView.takesPoints], [kRed, true, false]);
  await clickPicture(page, /^No point was added: positions are not measured/);
  replay.fault = ['occluded', ''];
  await page.waitForFunction(
      () => document.getElementById('state-word').textContent === 'Tissue not seen');
  replay.fault = null;
  replay.isUnobserved = false;
  await lookAt(replay, [page], 'tracking');
}

/** The page is paused: the picture is that of before, while the state goes on. */
async function lookAtPaused(page, replay) {
  const again = await lookAt(replay, [page], 'relocalised', true);
  assert.ok(!again.isPictureGray, 'a picture that was live is studied in its colours');
  assert.match(again.paused, /^PAUSED – picture of \d.* s ago$/);
  assert.match(again.say, /followed again\. Press Go on, then compare one landmark by eye\./);
  assert.deepEqual(
      [again.pausedInBanner, again.title],
      ['Picture paused', 'Found again · picture paused – defrec']);
  assert.match(again.since, /^Found again for \d/);
  assert.match(again.text, /Now \(the picture is paused\)/);
  // What was said of a click ends with what was why.
  const said = await page.evaluate(() => {
    document.getElementById('picture').click();
    const {textContent} = document.getElementById('message');
    document.getElementById('pause').click();
    return [textContent, document.getElementById('message').textContent];
  });
  assert.deepEqual(said, ['No point was added: the picture is paused.', '']);
  await page.waitForFunction(
      () => !document.querySelector('.picture-frame').classList.contains('held'));
  const goesOn = await lookAt(replay, [page], 'tracking');
  assert.match(goesOn.since, /^for \d/);
  assert.deepEqual([goesOn.isPictureGray, goesOn.pausedInBanner, goesOn.paused], [false, '', '']);
  assert.doesNotMatch(goesOn.text, /\(the picture is paused\)/);
  await page.click('#pause');
}

/** A video that stands still is not of now, also while the picture is paused. */
async function lookAtFrozen(page, replay) {
  replay.isUnobserved = true;
  const unobserved = await lookAt(replay, [page], 'degraded');
  assert.match(unobserved.say, /^Nothing of the tissue is seen now\. Do not rely/);
  assert.match(unobserved.points, /^Points: \d lost$/);
  assert.ok(!unobserved.takesPoints, 'a click would follow what is not measured');
  for (const [fault, expected] of kFaults) {
    await lookAt(replay, [page], 'lost');
    replay.fault = fault;
    const {say} = await lookAt(replay, [page], 'degraded');
    assert.match(say, expected);
    // The left picture alone is enough to follow tissue.
    assert.equal(/^Nothing of the tissue is seen/.test(say), fault[1] === 'left');
  }
  replay.fault = null;
  replay.isUnobserved = false;
  await lookAt(replay, [page], 'tracking');
  replay.state = 'repeated';
  const repeated = await look(page, 'degraded');
  assert.match(
      repeated.say,
      /^The same picture comes again: all positions are of the last new one, \d.* s ago\. Why: /);
  assert.match(repeated.say, / Why: repeated pictures\.$/);
  assert.equal(repeated.points, 'Points: not of this picture');
  for (const {say} of [unobserved, repeated]) assert.doesNotMatch(say, /followed/);
  for (const isPaused of [false, true]) {
    await lookAt(replay, [page], 'tracking', isPaused);
    replay.state = 'frozen';
    const frozen = await look(page, 'stalled');
    await picture(page, isPaused ? 'frozen_paused' : 'frozen');
    assert.equal(frozen.word, kWords.stalled);
    assert.match(
        frozen.say, /the video stands still\. The same.* What to do: check the video source\./);
    assert.doesNotMatch(frozen.say, /followed/);
    assert.equal(frozen.colour, kRed);
    if (!isPaused) assert.equal(frozen.frame, kRed);
    assert.ok(frozen.isPictureGray && frozen.isFlashing && !frozen.takesPoints);
    assert.match(frozen.text, /Of the last picture, not of now/);
    await page.click('#pause');
    await page.waitForFunction(
        (wasPaused) => wasPaused === document.getElementById('paused').hidden, {}, isPaused);
  }
  replay.state = 'frozen';
  // It counts from the picture that came first, though others like it came since.
  await page.waitForFunction(() => {
    const [, age] =
        document.getElementById('old-picture').textContent.match(/^Picture of (\d+\.\d) s ago$/) ??
        [];
    return document.documentElement.dataset.state === 'stalled' && parseFloat(age) > 1.5;
  });
  // One that is old already is not younger where it is paused.
  const [age, paused] = await page.evaluate(() => {
    const told = (id) => {
      const [, minutes = 0, s] =
          document.getElementById(id).textContent.match(/(?:(\d+) min )?([\d.]+) s ago$/);
      return 60 * minutes + Number(s);
    };
    const before = told('old-picture');
    document.getElementById('pause').click();
    return [before, told('paused')];
  });
  assert.ok(age > 1.5 && paused >= age, `${age} s old, and ${paused} s where it is paused`);
  await page.click('#pause');
  const back = await lookAt(replay, [page], 'tracking');
  assert.deepEqual([back.oldPicture, back.isPictureGray], ['', false]);
}

async function lookAtStates(page, other, replay, isPlain) {
  const tracking = await lookAt(replay, [page, other], 'tracking');
  assert.equal(tracking.isPictureGray, false);
  assert.equal(tracking.points, 'Points: 1 seen, errors up to 0.2 mm');
  assert.equal(tracking.pointsWeight, '400');
  await page.waitForFunction(() => Number(document.documentElement.dataset.frame) > 1001);
  // A machine that is busy may draw 3D too slowly.
  const isDrawn = !isPlain && await (await page.waitForFunction(() => {
                                const {surfaceFrame, surface} = document.documentElement.dataset;
                                return surfaceFrame ? 'drawn' : surface;
                              })).jsonValue() === 'drawn';
  assert.match(await page.$eval('#stages', (times) => times.textContent), /Measure depth/);
  assert.equal(tracking.isStale, false);
  assert.doesNotMatch(tracking.text, /not of now/);
  await page.click('#alarm-flash');

  const lost = await lookAt(replay, [page, other], 'lost');
  assert.match(lost.say, /not followed.*Why: both pictures are black\. What to do: check light/);
  assert.equal((await look(other, 'lost')).colour, kRed);
  await clickPicture(page, /^No point was added: the tissue is not followed/);
  assert.ok(lost.isFlashing);
  assert.match(lost.points, /^Points: \d+ lost$/);
  assert.doesNotMatch(lost.text, /No surface yet/);
  assert.match(tracking.residual, /^\d\.\d+ mm$/);
  assert.equal(lost.residual, '–');
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
  const givenUp = await lookAt(replay, [page], 'given-up');
  assert.match(givenUp.say, /is given up, and a new template is being taken\. Do not rely/);
  assert.ok(givenUp.isFlashing && !givenUp.takesPoints);
  assert.equal(givenUp.colour, kRed);
  await clickPicture(page, /^No point was added: the tissue is not followed/);
  replay.extrapolated = 3.14;
  const degraded = await lookAt(replay, [page], 'degraded');
  assert.match(
      degraded.say,
      /Do not use points above ±3 mm\. Why: #901 ±3\.1 mm; something lies in front/);
  assert.deepEqual(
      await page.$$eval('.too-large', (cells) => cells.map(({textContent}) => textContent)),
      ['3.1 mm'], 'the row is marked');
  for (const value of ['light', 'dark']) {
    await page.emulateMediaFeatures([{name: 'prefers-color-scheme', value}]);
    const contrast = await contrastOf(page, '.too-large');
    assert.ok(contrast >= 4.5, `${value}: ${contrast}`);
  }
  assert.equal(degraded.points, 'Points: 1 seen, 1 extrapolated, errors up to 3.1 mm');
  assert.equal(degraded.pointsWeight, '800', 'what is not seen counts');
  replay.found = 'relocalised';
  await page.waitForFunction(
      () => document.getElementById('state-say').textContent.startsWith('The tissue was lost'));
  const unsure = await lookAt(replay, [page], 'degraded');
  replay.found = '';
  assert.match(
      unsure.say, /was lost, and is followed again.*Errors may be larger.*Why: .*something/);
  replay.extrapolated = null;
  assert.deepEqual(degraded.sidewaysLists, [], 'lists fit a narrow page');
  await page.click('#pause');
  await page.waitForFunction(() => !document.getElementById('paused').hidden);
  assert.ok(
      !(await look(page, 'degraded')).takesPoints,
      'a click on a picture that is paused would follow tissue that is elsewhere now');
  await clickPicture(page, /^No point was added: the picture is paused/);
  // The state goes on while the picture is paused.
  const pausedLost = await lookAt(replay, [page], 'lost', true);
  assert.ok(!pausedLost.isPictureGray);
  assert.match(pausedLost.paused, /^PAUSED – picture of \d/);
  assert.ok(pausedLost.isFlashing);
  assert.equal(pausedLost.pictureOpacity, '1', 'a frame that flashes leaves the picture alone');
  await lookAtPaused(page, replay);
  await lookAtResized(page, 700);
  await page.click('#pause');
  await lookAtUnusable(page, replay);
  await lookAtFrozen(page, replay);
  const stalled = await lookAt(replay, [page], 'stalled');
  assert.match(stalled.say, /What to do: check the camera, recorder and cables; close other pr/);
  assert.ok(stalled.isPictureGray, 'the picture that is no longer of now is gray');
  assert.equal(stalled.points, '');
  assert.match(stalled.oldPicture, /^Picture of \d.* ago$/);
  assert.ok(!stalled.takesPoints);
  assert.ok(stalled.isFlashing);
  assert.equal(stalled.colour, kRed);
  assert.match(stalled.text, /Of the last picture, not of now/);
  await lookAt(replay, [page], 'tracking');
  for (const isBehindProxy of [false, true]) {
    replay.isBehindProxy = isBehindProxy;
    const {colour, canAsk, say} = await lookAt(replay, [page], 'disconnected');
    assert.equal(colour, kRed);
    assert.match(say, /What to do: use no position; look at the terminal/);
    assert.deepEqual(canAsk, [false, false, false, false], 'nobody hears what is asked');
    const waiting = await lookAt(replay, [page], 'stalled');
    assert.deepEqual(waiting.canAsk, [true, true, true, true], 'it answers, without a frame');
    const back = await lookAt(replay, [page], 'tracking');
    assert.deepEqual(back.canAsk, [true, true, true, true]);
    assert.equal(back.oldPicture, '');
  }
  await page.click('#full-screen');
  await page.waitForFunction(() => document.body.classList.contains('full'));
  // As plain at the picture as above it.
  for (const [state, colour] of [['tracking', kGreen], ['degraded', kAmber], ['lost', kRed]]) {
    const full = await lookAt(replay, [page], state);
    assert.deepEqual([full.frame, full.tag], [colour, kWords[state]]);
  }
  replay.state = 'tracking';
  await look(page, 'tracking');
  await page.waitForFunction(() => document.getElementById('strip').dataset.end === 'now');
  const ended = await lookAt(replay, [page, other], 'ended');
  await page.waitForFunction(
      () => /^ended \d.* s ago$/.test(document.getElementById('strip').dataset.end));
  assert.match(ended.say, /Nothing is followed.*outputs are being written/);
  assert.match(ended.text, /All lists: of the last picture, not of now/);
  assert.deepEqual(ended.canAsk, [false, false, false, false]);
  await lookAtResized(page, 1200);
  replay.state = 'disconnected';  // the program has gone, and the page goes on saying "Ended"
  await page.waitForFunction(
      () => document.getElementById('state-say')
                .textContent.includes('The program has finished; report.html'));
  assert.equal((await look(page, 'ended')).word, kWords.ended);
  // The last picture came to a page in full screen, without the grid.
  await page.click('#full-screen');
  await page.waitForFunction(() => !document.body.classList.contains('full'));
  assert.deepEqual(
      await page.$eval('#overlay', ({checked, disabled}) => [checked, disabled]), [false, true]);
  const changes =
      await page.$$eval('#changes .chip', (chips) => chips.map(({textContent}) => textContent));
  assert.ok(changes.length > 5);
  assert.ok(changes.every((word, i) => word !== changes[i + 1]), `${changes}`);
}

/** On a small screen the word stays in sight, and little else does. */
async function scroll(page) {
  const seen = await page.evaluate(() => {
    scrollTo(0, document.body.scrollHeight);
    const {top, bottom} = document.getElementById('state-word').getBoundingClientRect();
    const middle = document.elementFromPoint(innerWidth / 2, innerHeight / 8);
    const covers = Boolean(middle.closest('#state'));
    scrollTo(0, 0);
    return {top, share: bottom / innerHeight, covers};
  });
  assert.equal(seen.top, 0);
  assert.ok(seen.share < 0.12, `the state covers ${seen.share} of the screen`);
  assert.ok(!seen.covers);
}

/** Where requests fail but those of frames, frames go on; the rest comes once they do not. */
async function lookAtCut(browser, replay) {
  const errors = [], page = await openPage(browser, errors);
  await page.setViewport({width: 390, height: 600});
  for (const isBehindProxy of [false, true]) {
    replay.isBehindProxy = isBehindProxy;
    replay.isCut = true;
    await page.goto(replay.url);
    const first = await (await page.waitForFunction(() => document.documentElement.dataset.frame))
                      .jsonValue();
    const {found, surfaceFrame} =
        await (await page.waitForFunction((frame) => {
          const {dataset} = document.documentElement;
          return Number(dataset.frame) > Number(frame) + 2 && {...dataset};
        }, {}, first)).jsonValue();
    assert.deepEqual([found, surfaceFrame], [undefined, undefined]);
    replay.isCut = false;
    await page.waitForFunction(() => {
      const {found: checks, surfaceFrame: drawn, surface, plain} = document.documentElement.dataset;
      return checks === '' && (drawn || surface === 'off' || plain !== undefined);
    });
  }
  assert.deepEqual(errors, []);
  await page.close();
}

/** An answer that cannot be read or shown is no end. */
async function lookAtGarbled(browser, replay) {
  const errors = [], page = await openPage(browser, errors);
  await page.setViewport({width: 390, height: 600});
  await page.goto(replay.url);
  await look(page, 'tracking');
  for (const garbled of ['all', 'pictures']) {
    const before = await page.evaluate(() => Number(document.documentElement.dataset.errors ?? 0));
    replay.garbled = garbled;
    const frame = await (await page.waitForFunction((count) => {
                    const {errors: failures, frame: last} = document.documentElement.dataset;
                    return Number(failures) > count && last;
                  }, {polling: 50}, before)).jsonValue();
    await page.waitForFunction((last) => {
      const {frame: now, state} = document.documentElement.dataset;
      return Number(now) > Number(last) && state === 'tracking';
    }, {polling: 50}, frame);
  }
  assert.deepEqual(errors, []);
  await page.close();
}

/** A page behind another one tells by title and sound that the video stands still. */
async function lookAtHidden(browser, replay) {
  const errors = [], page = await openPage(browser, errors);
  await page.setViewport({width: 390, height: 600});
  await page.goto(replay.url);
  await page.bringToFront();
  await look(page, 'tracking');
  await page.click('#alarm-sound');
  await page.waitForFunction(() => document.getElementById('sound-waits').textContent === '');
  const front = await openPage(browser, errors);
  await front.bringToFront();
  await page.waitForFunction(() => document.hidden, {polling: 50});
  // It goes on with frames meanwhile, without 3D.
  const {frame} = await page.evaluate(() => ({...document.documentElement.dataset}));
  await page.waitForFunction(
      (last) => Number(document.documentElement.dataset.frame) > Number(last) + 2, {polling: 50},
      frame);
  assert.equal(await page.title(), 'Tracking – defrec');
  replay.state = 'stalled';
  await page.waitForFunction(
      () => document.title === 'No new picture – defrec' &&
          Number(document.documentElement.dataset.beeps) >= 1,
      {polling: 50});
  assert.ok(await page.evaluate(() => document.hidden));
  replay.state = 'tracking';
  await page.waitForFunction(() => document.title === 'Tracking – defrec', {polling: 50});
  assert.deepEqual(errors, []);
  await front.close();
  await page.close();
}

/** Where the picture is does not depend on the state, nor on what is said of it. */
async function lookAtPlaces(browser, replay) {
  const errors = [], page = await openPage(browser, errors);
  await page.goto(replay.url);
  for (const [width, height] of [[1280, 800], [390, 844]]) {
    await page.setViewport({width, height});
    const tops = {};
    for (const state of ['tracking', 'degraded', 'relocalised', 'lost', 'unusable', 'stalled']) {
      replay.extrapolated = state === 'degraded' ? 8.5 : null;
      replay.fault = state === 'unusable' ? ['dark, one-view', 'right'] : null;
      replay.state = state;
      await look(page, state);
      tops[state] = await page.$eval('#picture', (canvas) => canvas.getBoundingClientRect().top);
      await picture(page, `place_${width}_${state}`);
    }
    assert.equal(new Set(Object.values(tops)).size, 1, `${width}: ${JSON.stringify(tops)}`);
  }
  [replay.state, replay.extrapolated, replay.fault] = ['tracking', null, null];
  assert.deepEqual(errors, []);
  await page.close();
}

/**
 * A picture says its age before it is too old to be used; the strip and the list tell the outage
 * that follows, and the tissue after it is found again.
 */
async function lookAtOutage(browser, replay) {
  const errors = [], page = await openPage(browser, errors);
  await page.setViewport({width: 1000, height: 700});
  await page.goto(replay.url);
  replay.outageMs = 8000;
  await look(page, 'tracking');
  replay.state = 'stalled';
  const aging = await (await page.waitForFunction(() => {
                  const age = document.getElementById('old-picture');
                  return !age.hidden && [document.documentElement.dataset.state, age.textContent];
                }, {polling: 50})).jsonValue();
  assert.equal(aging[0], 'tracking');
  assert.match(aging[1], /^Picture of \d.* ago$/);
  await look(page, 'stalled');
  await page.waitForFunction(
      () => document.getElementById('strip').dataset.spans.endsWith('stalled') &&
          document.querySelector('#changes .chip').textContent === 'No new picture');
  assert.match(
      await page.$eval('#strip', ({dataset}) => dataset.end), /^now$/, 'the outage is of now');
  [replay.outageMs, replay.gapMs, replay.found] = [3000, 12000, 'resumed'];
  replay.state = 'relocalised';
  const resumed = await look(page, 'relocalised');
  assert.equal(resumed.word, 'Found again');
  assert.match(resumed.say, /^No new picture came for a while.* Compare one landmark by eye\./);
  await picture(page, 'resumed');
  const rows = await page.$$eval(
      '#changes tbody tr', (lines) => lines.slice(0, 2).map(({textContent}) => textContent));
  assert.match(rows[0], /Found again/);
  assert.match(rows[1], /No new pictureno picture came for 12 s/);
  [replay.state, replay.found] = ['tracking', ''];
  assert.deepEqual(errors, []);
  await page.close();
}

/** One button removes all points that never had a place, also in full screen. */
async function removeUnplaced(page, replay) {
  const button = '#remove-unplaced:not([hidden])';
  for (const isFull of [false, true]) {
    if (isFull) {
      await page.setViewport({width: 1280, height: 800});
      await page.click('#full-screen');
      await page.waitForFunction(() => document.body.classList.contains('full'));
    }
    [replay.neverPlaced, replay.state] = [[902, 903, 904, 905], 'degraded'];
    await page.waitForFunction(
        () => document.getElementById('remove-unplaced').textContent ===
            'Remove points without a place (4)');
    const {say} = await look(page, 'degraded');
    assert.match(say, /4 points have no place: click on them again, then remove the old ones\./);
    await picture(page, `remove_${isFull}`);
    const asked = await page.$eval(button, (each) => {
      each.click();
      const message = document.getElementById('message').textContent;
      const told = [each.textContent, each.classList.contains('asks'), message];
      each.click();
      const lists = document.getElementById('lists');
      const {right} = each.getBoundingClientRect();
      return [...told, right <= innerWidth && lists.scrollWidth <= lists.clientWidth];
    });
    assert.deepEqual(
        asked, ['Remove 4?', true, 'Press again to remove 4 points without a place.', true]);
    await page.waitForFunction(() => document.getElementById('remove-unplaced').hidden);
    assert.deepEqual(replay.neverPlaced, []);
    replay.state = 'tracking';
    await look(page, 'tracking');
  }
  await page.click('#full-screen');
  await page.waitForFunction(() => !document.body.classList.contains('full'));
}

/** What was not found yet was not lost. */
async function lookAtUnfound(browser, replay) {
  const errors = [], page = await openPage(browser, errors);
  const isPlain = () => page.evaluate(() => document.documentElement.dataset.plain !== undefined);
  for (const [state, words] of [['unfound', /^No surface yet$/], ['lost', /^Lost: there is no/]]) {
    replay.state = state;
    await page.goto(replay.url);
    await look(page, state);
    if (await isPlain()) break;
    const said = await page.$eval('#no-surface', ({textContent}) => textContent);
    // A browser without 3D says so there.
    if (!/WebGL/.test(said)) assert.match(said, words);
  }
  replay.state = 'tracking';
  assert.deepEqual(errors, []);
  await page.close();
}

/** Points that never had a place say why. */
async function lookAtNeverPlaced(browser, replay) {
  const errors = [], page = await openPage(browser, errors);
  await page.setViewport({width: 390, height: 844});
  await page.goto(replay.url);
  replay.neverPlaced = [902];
  await page.waitForFunction(
      () => document.querySelector('#points tr[data-id="902"]')
                ?.textContent.includes('lostnot seen when it was given: click on it again, then'));
  assert.deepEqual((await look(page, 'tracking')).sidewaysLists, []);
  replay.state = 'degraded';
  const never = await look(page, 'degraded');
  assert.match(
      never.say,
      /#902 has no place: click on it again, then remove.*one\. Why: #902 not seen when given;/);
  assert.ok(never.takesPoints);
  await picture(page, 'never_placed');
  replay.state = 'tracking';
  // Names are as long as the program takes them, and what is longer is told.
  const told = await page.$eval('#points tr[data-id="902"] input', (field) => {
    field.value = 'ä'.repeat(40);
    field.dispatchEvent(new Event('input'));
    const {textContent: fits} = document.getElementById('message');
    field.value += 'b';
    field.dispatchEvent(new Event('input'));
    return [fits, document.getElementById('message').textContent];
  });
  assert.deepEqual(told, ['', 'A name has at most 80 bytes: make it shorter.']);
  await removeUnplaced(page, replay);
  assert.deepEqual(errors, []);
  await page.close();
}

/** What was chosen for the alarm holds when the page is loaded again. */
async function lookAtChoices(browser, replay) {
  const errors = [], page = await openPage(browser, errors);
  await page.setViewport({width: 390, height: 600});
  // As where a browser keeps nothing, and where sound waits for a click.
  for (const isKept of [false, true]) {
    const script = await page.evaluateOnNewDocument((keeps) => {
      if (!keeps)
        Object.defineProperty(globalThis, 'sessionStorage', {
          get() {
            throw new DOMException('', 'SecurityError');
          }
        });
      globalThis.AudioContext = class extends EventTarget {
        state = 'suspended';
        resume() {
          if (navigator.userActivation.isActive) this.state = 'running';
          this.dispatchEvent(new Event('statechange'));
          return new Promise(() => {});
        }
      };
    }, isKept);
    await page.goto(replay.url);
    await look(page, 'tracking');
    for (const id of ['sound', 'flash']) await page.click(`#alarm-${id}`);
    const chosen = () => page.evaluate(
        () =>
            [...['sound', 'flash'].map((id) => document.getElementById(`alarm-${id}`).checked),
             document.getElementById('sound-waits').textContent]);
    assert.deepEqual(await chosen(), [true, true, '']);
    await page.reload();
    await look(page, 'tracking');
    assert.deepEqual(
        await chosen(),
        isKept ? [true, true, 'No sound until you click on this page.'] : [false, false, '']);
    await picture(page, `choices_${isKept}`);
    await page.click('h1');
    assert.equal((await chosen())[2], '');
    await page.removeScriptToEvaluateOnNewDocument(script.identifier);
  }
  assert.deepEqual(errors, []);
  await page.close();
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
  await lookAt(replay, [page], 'tracking');
  await scroll(page);
  await lookAtStates(page, other, replay, isPlain);
  assert.deepEqual(errors, []);
}

const browser = await launch();
render(`${kWidth}x${kHeight}`, kFrames);
for (const view of ['left', 'right'])
  darken(join(scratch, 'sequence', view), kBlack, kWidth, kHeight);
const program = track('left', 'right', 0.5, '--out', 'states');
try {
  const answers = await inTime(answersOf(program));
  answers.tracking.header.points.push([900, 0, true, '', 160, 120, 0, 0, 80, 0.2]);
  answers.lost.header.points.push([900, 2, true, '']);
  answers.lost.header.moments.at(-1)[3] += ', frozen';  // as black pictures are alike
  const replay = new Replay(answers);
  await inTime(lookAtCut(browser, replay));
  await inTime(lookAtGarbled(browser, replay));
  await inTime(lookAtHidden(browser, replay));
  await inTime(lookAtChoices(browser, replay));
  await inTime(lookAtPlaces(browser, replay));
  await inTime(lookAtNeverPlaced(browser, replay));
  await inTime(lookAtUnfound(browser, replay));
  await inTime(lookAtOutage(browser, replay));
  await inTime(watchStates(browser, replay));
} finally {
  program.kill('SIGKILL');
  browser.process()?.kill('SIGKILL');
}
console.log('passed');
process.exit(0);
