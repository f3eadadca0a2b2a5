// Where labels stand on the left view, without a browser: beside their marks, with a line where
// they do not, on the same side from one picture to the next; names before numbers.
// node labels_test.mjs FOLDER_OF_NODE_MODULES, that of the page.
import assert from 'node:assert/strict';
import {createRequire} from 'node:module';
import {join} from 'node:path';
import {fileURLToPath} from 'node:url';

const esbuild = createRequire(join(process.argv[2], 'package.json'))('esbuild');
const bundle = await esbuild.build({
  entryPoints: [fileURLToPath(new URL('../web/labels.js', import.meta.url))],
  bundle: true,
  write: false,
  format: 'esm'
});
const source = Buffer.from(bundle.outputFiles[0].contents).toString('base64');
const {kRanks, Labels} = await import(`data:text/javascript;base64,${source}`);

const kWidth = 640, kHeight = 360, kLetter = 8;

/** What is drawn: texts {text, x, y} by their left end and base line, and lines of two ends. */
class Context {
  constructor(letter = kLetter, canvas = {width: kWidth, height: kHeight}, unit = 1) {
    this.canvas = canvas;
    [this.letter, this.height] = [letter, 14 * unit];
    this.texts = new Map();
    this.lines = [];
    this.colours = [];  // of strokes
  }
  measureText(text) {
    return {width: this.letter * text.length};
  }
  strokeText() {}
  fillText(text, x, y) {
    const right = x + this.letter * text.length;
    this.texts.set(text, {x, y, right, top: y - this.height, colour: this.fillStyle});
  }
  beginPath() {}
  stroke() {
    this.colours.push(this.strokeStyle);
  }
  moveTo(x, y) {
    this.lines.push([[x, y]]);
  }
  lineTo(x, y) {
    this.lines.at(-1).push([x, y]);
  }
}

function draw(labels, fill) {
  const context = new Context();
  labels.begin();
  fill(labels, context.canvas);
  labels.draw(context, 1);
  return context;
}

const apart = (from, to, otherFrom, otherTo) => Math.max(0, otherFrom - to, from - otherTo);
const distance = (text, {left, right, top, bottom}) =>
    Math.hypot(apart(text.x, text.right, left, right), apart(text.top, text.y, top, bottom));
const boxRound = (x, y, half) =>
    ({left: x - half, right: x + half, top: y - half, bottom: y + half});
const overlap = (a, b) => distance(a, {left: b.x, right: b.right, top: b.top, bottom: b.y}) === 0;

function meet([a, b], [c, d]) {
  const side = ([x, y], [u, v], [p, q]) => (u - x) * (q - y) - (v - y) * (p - x);
  return side(a, b, c) * side(a, b, d) < 0 && side(c, d, a) * side(c, d, b) < 0;
}

/** Whether a line, but for its ends, runs through a text. */
const runsThrough = ([[x, y], [u, v]], text) => Array.from({length: 99}, (_, i) => (i + 1) / 100)
                                                    .some(
                                                        (t) => overlap(
                                                            {
                                                              x: x + t * (u - x),
                                                              right: x + t * (u - x),
                                                              top: y + t * (v - y),
                                                              y: y + t * (v - y)
                                                            },
                                                            text));

// A part with points of all kinds about it.
const tumour = boxRound(300, 200, 30), kViolet = '#ec5cf6';
const partOf = (box) => ({
  box,
  outline:
      [[box.left, box.top], [box.right, box.top], [box.right, box.bottom], [box.left, box.bottom]],
  colour: kViolet
});
const crowd = (labels, canvas) => {
  labels.addBox('tumour', ['tumour 0.6 mm, 5.6 mm deep'], partOf(tumour), kRanks.part, canvas);
  labels.add('centre', ['centre 0.6 mm'], 300, 200, kRanks.namedTarget);
  labels.add('landmark', ['landmark A 0.1 mm'], 335, 165, kRanks.named);
  for (let i = 0; i < 30; ++i)
    labels.add(
        `${i}`, [`#${i}`], 300 + (30 + 2 * i) * Math.cos(i), 200 + (30 + 2 * i) * Math.sin(i),
        kRanks.point);
};
const crowded = draw(new Labels(), crowd);
const of = (name) => [...crowded.texts].find(([text]) => text.startsWith(name))?.[1];
for (const [name, mark] of [
         ['tumour', tumour], ['landmark', boxRound(335, 165, 6)],
         ['centre', boxRound(300, 200, 6)]]) {
  assert.ok(of(name), `${name} has a label`);
  const way = distance(of(name), mark);
  assert.ok(way < 115, `${name} is ${way} px from its mark`);
  const hasLine = crowded.lines.some(
      ([, [x, y]]) => x >= mark.left && x <= mark.right && y >= mark.top && y <= mark.bottom);
  if (way > 14) assert.ok(hasLine, `${name}, ${way} px from its mark, has a line to it`);
}
const texts = [...crowded.texts.values()];
for (const [i, text] of texts.entries())
  assert.ok(!texts.slice(i + 1).some((other) => overlap(text, other)), 'labels overlap');

for (const line of crowded.lines)
  assert.ok(
      texts.filter((text) => runsThrough(line, text)).length < 1, 'a line runs through a label');

// A followed point keeps its label where the part's would have room in its place alone.
const beside = draw(new Labels(), (labels, canvas) => {
  labels.addBox('tumour', ['tumour 0.6 mm, 5.6 mm deep'], partOf(tumour), kRanks.part, canvas);
  for (const [x, y] of [[300, 232], [300, 160], [262, 200], [338, 200]])
    labels.add(`${x} ${y}`, [`#${x}${y}`], x, y, kRanks.point);
});
assert.equal(beside.texts.size, 5);

// It keeps it also in the middle of a part, among targets.
const among = draw(new Labels(), (labels, canvas) => {
  labels.addBox('tumour', ['tumour'], partOf(tumour), kRanks.part, canvas);
  labels.add('5', ['#5'], 300, 200, kRanks.point);
  for (let i = 0; i < 24; ++i) labels.avoid(300 + 14 * Math.cos(i), 200 + 14 * Math.sin(i));
});
assert.ok(among.texts.has('#5'));

// On a small picture that of a part comes before those of points.
const small = new Context(), smallLabels = new Labels(), scan = boxRound(150, 108, 16);
small.canvas = {
  width: 330,
  height: 185
};
smallLabels.addBox('scan', ['scan 1.9 mm, 9.6 mm deep'], partOf(scan), kRanks.part, small.canvas);
const points = [[67, 20], [24, 48], [296, 68], [252, 100], [200, 128], [153, 152]];
for (const [x, y] of points) smallLabels.add(`${x}`, [`#${x} 0.1 mm`], x, y, kRanks.point);
for (let i = 0; i < 16; ++i)
  smallLabels.avoid(150 + 40 * Math.cos(0.4 * i), 108 + 40 * Math.sin(0.4 * i));
smallLabels.draw(small, 1);
const scanText = small.texts.get('scan 1.9 mm, 9.6 mm deep');
assert.ok(scanText, 'the part has a label');
for (const [x, y] of points)
  assert.ok(distance(scanText, boxRound(x, y, 6)) > 0, 'no mark of a point is hidden');
assert.ok(small.texts.size > 4, `${small.texts.size} labels`);

// Labels that have room touch their marks and need no line, but for those of parts.
const alone = draw(new Labels(), (labels, canvas) => {
  labels.addBox('tumour', ['tumour'], partOf(tumour), kRanks.part, canvas);
  labels.add('vessel', ['vessel'], 500, 60, kRanks.named);
  labels.add('edge', ['at the edge'], kWidth - 10, 300, kRanks.named);
});
assert.equal(alone.texts.size, 3);
assert.equal(alone.lines.length, 1, 'a part always has a line, to its outline');
const [[, partEnd]] = alone.lines;
assert.ok(partOf(tumour).outline.some(([x, y]) => x === partEnd[0] && y === partEnd[1]));
assert.ok(alone.colours.includes(kViolet));
assert.equal(alone.texts.get('tumour').colour, kViolet);
assert.equal(alone.texts.get('vessel').colour, '#ffffff');
assert.ok(distance(alone.texts.get('tumour'), tumour) < 20);
assert.ok(alone.texts.get('at the edge').right <= kWidth);

// A label belongs to the nearest mark, or has a line to its own; lines do not cross.
const places = [[206, 253], [334, 233], [503, 338], [634, 181], [560, 291], [573, 287], [345, 250]];
const near = draw(new Labels(), (labels) => {
  for (const [i, [x, y]] of places.entries())
    labels.add(`${i}`, [`#${i} 0.1 mm`], x, y, i < 5 ? kRanks.point : kRanks.namedTarget);
});
assert.equal(near.texts.size, places.length);
for (const [name, text] of near.texts) {
  const own = Number(name[1]);
  const ways = places.map(([x, y]) => distance(text, boxRound(x, y, 6)));
  const [u, v] = places[own];
  const hasLine = near.lines.some(([, [x, y]]) => Math.hypot(x - u, y - v) < 10);
  const isNearest = ways.every((way, i) => i === own || way > ways[own] + 5);
  assert.ok(isNearest || hasLine, `${name}: ${ways[own]} of ${ways}`);
}
const pairs = [[[280, 150], [320, 200]], [[320, 150], [280, 200]]];
for (const lines of [near.lines, crowded.lines])
  for (const [i, line] of lines.entries())
    for (const other of lines.slice(i + 1))
      assert.ok(!meet(line, other), `${line} and ${other} cross`);
assert.ok(meet(...pairs), 'lines that cross are noticed');

// Where there is no room for a name its number stands there, with the error.
const narrow = new Context(), narrowLabels = new Labels();
narrow.canvas = {
  width: 150,
  height: 90
};
for (const [i, y] of [14, 45, 76].entries())
  narrowLabels.add(`${i}`, [`a long name ${i} 0.1 mm`, `T${i} 0.1`], 75, y, kRanks.namedTarget);
narrowLabels.draw(narrow, 1);
assert.deepEqual([...narrow.texts.keys()].sort(), ['T0 0.1', 'T1 0.1', 'T2 0.1']);

// A plan among points on a picture of 640x360 pixels that is shown in some widths: each mark keeps
// a label with its error, and lines keep off the marks of others.
const kPoints = [
  ['Tumour margin N', 300, 177], ['Vessel clip', 408, 210], ['Landmark liver edge', 207, 233],
  ['P3', 145, 126], ['P4', 522, 106], ['P5', 334, 310], ['', 412, 325]
];
const kTargets =
    [['tumour centre', 346, 190], ['deep margin', 347, 188], ['vein branch', 214, 122]];
const kParts = [
  ['tumour', 348, 190, 50, '\u00b10.7 mm', '2.9 mm deep'],
  ['portal vein', 214, 122, 31, '\u00b10.8 mm', '7.5 mm deep']
];
const circle = (x, y, radius) => Array.from(
    {length: 40},
    (_,
     i) => [x + radius * Math.cos((i * Math.PI) / 20), y + radius * Math.sin((i * Math.PI) / 20)]);

/** by: how far it is moved to the right. */
function addScene(labels, canvas, by) {
  for (const [name, x, y, radius, error, depth] of kParts)
    labels.addBox(
        name, [`${name} ${error}, ${depth}`, `${name} ${error}`, error],
        {box: boxRound(x + by, y, radius), outline: circle(x + by, y, radius), colour: kViolet},
        kRanks.part, canvas);
  for (const [i, [name, x, y]] of kTargets.entries())
    labels.add(
        name, [`${name} \u00b10.7 mm`, `T${i + 1} \u00b10.7 mm`], x + by, y, kRanks.namedTarget);
  for (const [i, [name, x, y]] of kPoints.entries())
    labels.add(
        `#${i}`, [`${name || `#${i}`} \u00b10.1 mm`, `#${i} \u00b10.1 mm`], x + by, y,
        name ? kRanks.named : kRanks.point);
}

/** marks: [x, y] of points and targets. */
function checkScene({texts: shown, lines}, marks, unit) {
  const told = [...shown.keys()];
  assert.equal(told.length, kParts.length + kTargets.length + kPoints.length, `${told}`);
  for (const text of told) assert.match(text, /\u00b1\d\.\d mm/);
  for (const [x, y] of marks)
    for (const [name, text] of shown)
      assert.ok(distance(text, boxRound(x, y, 5 * unit)) > 0, `${name} hides the mark ${x}, ${y}`);
  for (const [begin, end] of lines) {
    const way = ([x, y]) => Math.hypot(end[0] - x, end[1] - y);
    const [ownX, ownY] = marks.reduce((a, b) => (way(b) < way(a) ? b : a));
    for (const [x, y] of marks)
      if (Math.hypot(x - ownX, y - ownY) > 9 * unit) {
        const half = 6 * unit;
        const mark = {x: x - half, right: x + half, top: y - half, y: y + half};
        assert.ok(!runsThrough([begin, end], mark), `${begin} to ${end} runs over ${x}, ${y}`);
      }
  }
}

for (const shown of [340, 420, 600, 950]) {
  const unit = 640 / shown, moved = new Labels();
  for (const by of [0, 3, -4, 12, 30, 0, -20]) {
    const context = new Context(kLetter * unit, {width: 640, height: 360}, unit);
    moved.begin();
    addScene(moved, context.canvas, by);
    moved.draw(context, unit);
    checkScene(context, [...kPoints, ...kTargets].map(([, x, y]) => [x + by, y]), unit);
    if (shown === 950)
      for (const [name] of [...kParts, ...kTargets, ...kPoints])
        assert.ok([...context.texts.keys()].some((text) => text.startsWith(name)), name);
  }
}

// A label that said less says more once there has been room for that for a while.
const grows = new Labels();
const single = (all) =>
    all.add('a', ['a long name \u00b10.1 mm', '#1 \u00b10.1 mm'], 300, 200, kRanks.named);
draw(grows, single);
grows.forms.set('a', 1);
assert.ok(draw(grows, single).texts.has('#1 \u00b10.1 mm'), 'it does not flicker');
for (let i = 0; i < 30; ++i) draw(grows, single);
assert.ok(draw(grows, single).texts.has('a long name \u00b10.1 mm'));

// A name takes the place of a number that was drawn before.
const numbers = new Labels();
const number = (labels) => labels.add('1', ['#1 and more'], 100, 112, kRanks.point);
draw(numbers, number);
const both = draw(numbers, (labels) => {
  number(labels);
  labels.add('name', ['a name'], 100, 100, kRanks.named);
});
const {x: nameX, y: nameY} = both.texts.get('a name');
assert.ok(nameX > 100 && nameY < 100, 'the name stands where it does alone');

// A mark that comes and goes beside it does not turn a label about for longer than it stands there.
const labels = new Labels(), sides = new Set();
for (let frame = 0; frame < 40; ++frame) {
  const y = 200 + 5 * Math.sin(frame), x = 300 + 5 * Math.cos(1.7 * frame);
  const {texts: shown} = draw(labels, (all, canvas) => {
    all.addBox('tumour', ['tumour'], partOf(boxRound(x, y, 30)), kRanks.part, canvas);
    all.add('point', [''], 300, 140 + (frame % 2), kRanks.target);
  });
  sides.add(Math.sign(shown.get('tumour').y - y));
}
assert.equal(sides.size, 1, 'the label keeps its side');
console.log('passed');
