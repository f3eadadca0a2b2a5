// What the page says of a frame, and the strip of states, without a browser.
// node words_test.mjs FOLDER_OF_NODE_MODULES, that of the page.
import assert from 'node:assert/strict';
import {createRequire} from 'node:module';
import {join} from 'node:path';
import {fileURLToPath} from 'node:url';

const esbuild = createRequire(join(process.argv[2], 'package.json'))('esbuild');
async function load(name) {
  const bundle = await esbuild.build({
    entryPoints: [fileURLToPath(new URL(`../web/${name}`, import.meta.url))],
    bundle: true,
    write: false,
    format: 'esm'
  });
  const source = Buffer.from(bundle.outputFiles[0].contents).toString('base64');
  return import(`data:text/javascript;base64,${source}`);
}
const {causesInWords, doubtsToDo, readMoment, states, whyNotPlaced} = await load('words.js');
const {Strip} = await load('strip.js');
const {plusMinus} = await load('labels.js');

const plain = (text) => text.replaceAll('\u00a0', ' ');
const none = [[], [], 0];
const doubts = {
  large: none,
  targets: none,
  lost: none,
  never: none
};
const less = (given, reasons = '', isHeld = false, heldReasons = '') =>
    readMoment([7, 0, 'degraded', reasons, 20, 0.7, '', '', isHeld, heldReasons, given, 0]);
const causes = (moment, ofMany = false) => causesInWords(moment, ofMany).map(plain);

// Points are named where their errors are why; in the list of changes each has the same words in
// all frames.
const large = {
  ...doubts,
  large: [['P4', '#5', 'P6'], [4.04, 3.6, 3.2], 5]
};
assert.deepEqual(causes(less(large)), ['P4 ±4.0 mm, #5 ±3.6 mm, P6 ±3.2 mm and 2 more']);
const ofMany = 'P4, #5, P6, further points'.split(', ');
assert.deepEqual(
    causes(less(large), true), ofMany.map((name) => `large expected error of ${name}`));
assert.deepEqual(
    causes(less({...doubts, large: [['P4', 'P6'], [4, 3.2], 2]}, 'point-error, occluded')),
    ['P4 ±4.0 mm and P6 ±3.2 mm', 'something lies in front of the tissue']);
assert.equal(plain(doubtsToDo(large)), 'Do not use points above ±3 mm.');

// So are their labels marked.
// By the digits that stand there.
assert.equal(plain(plusMinus(3.06)), '\u26a0\ufe0e ±3.1 mm');
assert.equal(plusMinus(3.04), '±3.0 mm');

// As targets are.
const targets = {
  ...doubts,
  targets: [['target 17'], [3.3], 1]
};
assert.deepEqual(causes(less(targets)), ['target 17 ±3.3 mm']);
assert.deepEqual(causes(less(targets), true), ['large expected errors of targets']);
assert.equal(plain(doubtsToDo(targets)), 'Do not use targets above ±3 mm.');

// Points without a place.
const never = {
  ...doubts,
  never: [['a', 'b', 'c'], [], 6]
};
assert.equal(
    doubtsToDo(never), '6 points have no place: click on them again, then remove the old ones.');
assert.equal(
    doubtsToDo({...doubts, never: [['a'], [], 1]}),
    'a has no place: click on it again, then remove the old one.');
assert.deepEqual(causes(less(never)), ['a, b, c and 3 more not seen when given']);
for (const ofMany of [false, true])
  assert.deepEqual(
      causes(less({...doubts, removed: 6}, '', true, 'point-error'), ofMany),
      ['points that are removed now']);
const lost = {
  ...doubts,
  lost: [['P4', 'P5'], [], 2]
};
assert.deepEqual(causes(less(lost)), ['P4 and P5 have no place']);
assert.equal(doubtsToDo(lost), '');

// Less sure is never without a reason.
assert.deepEqual(causes(less(null)), ['less is observed than usual']);
assert.deepEqual(
    causes(less(null, '', true, 'occluded')), ['something lies in front of the tissue']);
assert.deepEqual(causes(less(null, 'frozen')), ['repeated pictures']);

// In a video that stands still the tissue above is not what a plan lacks.
assert.match(whyNotPlaced([{all: 1, placed: 0, partly: 0}], 'frozen', false), /same picture/);
for (const state of ['stalled', 'disconnected', 'refused'])
  assert.match(states[state].say, /What.to.do: /);

// The strip: [ms before the right end, likewise, state].
const strip = new Strip();
const add = (state, ms, gapMs = 0) => strip.add({state, ms, gapMs});
add('tracking', 0);
add('tracking', 100);
assert.deepEqual(strip.spans(0, 1000), [[100, 0, 'tracking']]);
add('relocalised', 5100, 5000);
assert.deepEqual(
    strip.spans(0, 1000),
    [[5100, 5000, 'tracking'], [5000, 4000, 'tracking'], [4000, 0, 'stalled']]);
assert.deepEqual(
    strip.spans(3000, 1000).slice(-2), [[3000, 2000, 'relocalised'], [2000, 0, 'stalled']]);
add('tracking', 60000, 54900);
assert.deepEqual(strip.spans(0, 1000), [[20000, 0, 'stalled']], 'no more than 20 s');
add('tracking', 0);
assert.deepEqual(strip.spans(0, 1000), [], 'a recording begins again');
console.log('passed');
