// Labels on the left view, as many as have room beside each other.
import {number} from '../../report/web/data.js';
import {isTooLarge} from './words.js';

const kHeight = 14, kBelow = 4;  // of a line; of it beneath the base line
const kMostKept = 0.1;           // of the picture, in a box that no label hides
const kMark = 6;                 // half of a mark's side, on which no other one's label lies
const kCross = 3;                // of a target: so near to its middle a line ends
const kMargin = 4;               // free round a place that is new, so that a label does not jump
const kGaps = [3, 14, 30, 50, 76, 110, 150, 200];  // from mark to label
const kLineFrom = 8;     // a label that is farther off has a line to its mark
const kBesideLine = 3;   // free between a line and another mark
const kApart = 10;       // so much nearer than others is the mark of one without
const kFirstOfPart = 1;  // of the gaps, so that the line to a part can be seen
const kNear = 160;       // where a label has no room, those so near to it say less
const kMostPasses = 4;   // of placing labels again that say less
const kMany = 40;        // labels, for which no other places are looked for than beside their marks
const kRoomyDraws = 20;  // one after the other with room for more, before a label says more

/** Which labels come first where there is not room for all: those of the plan. */
export const kRanks = {
  part: 4,
  namedTarget: 3,
  named: 2,
  point: 1,
  target: 0
};

// On which side of its mark a label stands, in the order of preference: [across, down]; a half:
// with an edge of the label at that of the mark.
const kCorners = [[1, -1], [1, 1], [-1, -1], [-1, 1]], kSides = [[0, -1], [0, 1], [1, 0], [-1, 0]];
const kBesidePoint = [...kCorners, [1, 0], [-1, 0], [0, -1], [0, 1]];
const kBesideBox = [...kSides, ...kCorners];
const kHalf = [0.5, -0.5], kWhole = [1, -1];
const kBetween = kHalf.flatMap((half) => kWhole.flatMap((whole) => [[half, whole], [whole, half]]));

// What a label may lie on, and its line run over, where there is no room otherwise. It hides no
// marks of points and of targets with a label; at last a line to what has a name may run over them.
const kHidden = [[], [kRanks.part], [kRanks.part, undefined]], kLastLevel = kHidden.length;
const kNearby = 14, kMostGap = 0.16;  // of the gaps; as a share of the picture's width

// How a place is looked for, until there is one: less: how much shorter the text is than it may be;
// level: of kHidden; reach: of the line.
const kAttempts = [
  ...[0, 1, 2].flatMap((less) => ['near', 'middle'].map((reach) => ({less, level: 0, reach}))),
  ...[1, 2, 3].flatMap((level) => [0, 1, 2].map((less) => ({less, level, reach: 'far'})))
];
const kNearAttempts = kAttempts.filter(({reach}) => reach === 'near');

const kInk = '#ffffff';
const kTooLarge = '\u26a0\ufe0e\u00a0';  // a warning sign before an expected error

/** The expected error, which could be taken for a size without the sign. */
export const plusMinus = (error) =>
    `${isTooLarge(error) ? kTooLarge : ''}\u00b1${number(error, 1)} mm`;

/** What a label says, from long to short. */
export const textsOf = ([name, number], error) => {
  const short = `${number} ${plusMinus(error)}`;
  return [`${name} ${plusMinus(error)}`, short, short.replace(' mm', '')];
};

export class Labels {
  constructor() {
    this.begin();
    this.forget();
  }

  /** Where each label was drawn last, which form of it, and how often there was room for more. */
  forget() {
    [this.places, this.forms, this.roomy] = [new Map(), new Map(), new Map()];
  }

  /** A picture without labels. */
  begin() {
    this.wanted = [];
    this.avoided = [];
  }

  /** A mark at x, y that no label hides. */
  avoid(x, y) {
    this.avoided.push({x, y});
  }

  /**
   * Beside a mark at x, y. The higher rank comes first. texts: what it says, and what where there
   * is no room for that, from long to short.
   */
  add(key, texts, x, y, rank) {
    this.wanted.push({key, texts, x, y, rank});
  }

  /**
   * A label in the colour, with a line to the outline, places [x, y], of what lies in the box. No
   * label hides that unless it is a large share of the picture: then it stands beside its upper
   * end.
   */
  addBox(key, texts, {box, outline, colour}, rank, {width, height}) {
    const inside = {
      left: Math.max(0, box.left),
      right: Math.min(width, box.right),
      top: Math.max(0, box.top),
      bottom: Math.min(height, box.bottom)
    };
    const area = (inside.right - inside.left) * (inside.bottom - inside.top);
    const x = (inside.left + inside.right) / 2;
    if (!(area > 0)) return;
    const label = {key, texts, x, y: inside.top, rank, outline, colour};
    this.wanted.push(area < kMostKept * width * height ? {...label, box: inside} : label);
  }

  /**
   * unit: a pixel of the screen. A label that is drawn stays, and stays on its side, if it can.
   */
  draw(context, unit) {
    const {width, height} = context.canvas, size = width / unit;
    if (size !== this.size) this.forget();
    this.size = size;
    context.font = `600 ${kHeight * unit}px system-ui, sans-serif`;
    context.lineJoin = 'round';
    const seen = this.wanted.filter(({x, y}) => x >= 0 && x <= width && y >= 0 && y <= height);
    const marks = [...seen, ...this.avoided].map(
        (mark) =>
            ({key: mark.key, rank: mark.rank, centre: [mark.x, mark.y], ...markOf(mark, unit)}));
    const rankOf = ({key, rank}) => 2 * rank + (this.places.has(key) ? 1 : 0);
    let inOrder = seen.sort((a, b) => rankOf(b) - rankOf(a)), drawn = new Map();
    const forms = new Map(inOrder.map(({key}) => [key, this.forms.get(key) ?? 0]));
    for (let pass = 0; pass < (inOrder.length > kMany ? 1 : kMostPasses); ++pass) {
      drawn = placeAll(inOrder, forms, {marks, before: this.places}, context, unit);
      const without = inOrder.filter(({key, rank}) => !drawn.has(key) && rank !== kRanks.target);
      if (!without.length) break;
      shorten(inOrder, forms, without, drawn, unit);
      inOrder = [...without, ...inOrder.filter((label) => !without.includes(label))];
    }
    this.keep(inOrder, drawn, marks, context, unit);
    drawAll(drawn.values(), context, unit);
  }

  /** Remembers the places; a label that has had room for more for a while says more again. */
  keep(labels, drawn, marks, context, unit) {
    this.places = drawn;
    this.forms = new Map([...drawn].map(([key, {form}]) => [key, form]));
    for (const label of labels) {
      const {key} = label, form = this.forms.get(key);
      if (!form || labels.length > kMany) continue;
      const rest = [...drawn].filter(([other]) => other !== key).map(([, place]) => place);
      const longer = choose(
          label, form - 1, drawn.get(key),
          {...surroundings(rest), others: marks.filter((mark) => mark.key !== key)},
          {level: 0, reach: 'middle'}, context, unit);
      const draws = longer ? (this.roomy.get(key) ?? 0) + 1 : 0;
      this.roomy.set(key, draws % kRoomyDraws);
      if (draws === kRoomyDraws) this.forms.set(key, form - 1);
    }
  }
}

/** What labels that have a place take of the picture. */
const surroundings = (drawn) =>
    ({taken: drawn.map(({box}) => box), lines: drawn.flatMap(({line}) => (line ? [line] : []))});

/** {key: {label, form, ...place}} of the labels that have room; forms: the longest of each. */
function placeAll(labels, forms, {marks, before}, context, unit) {
  const drawn = new Map();
  const tryAll = (some, attempt) => {
    for (const label of some) {
      const {key, texts} = label, form = Math.min(forms.get(key) + attempt.less, texts.length - 1);
      if (drawn.has(key)) continue;
      const others = marks.filter((mark) => mark.key !== key);
      const around = {...surroundings([...drawn.values()]), others};
      const place = choose(label, form, before.get(key), around, attempt, context, unit);
      if (place) drawn.set(key, {label, form, ...place});
    }
  };
  const isPart = ({rank}) => rank === kRanks.part;
  const isNamed = ({rank}) => !isPart({rank}) && rank >= kRanks.named;
  const attempts = labels.length > kMany ? kNearAttempts : kAttempts;
  // What has a name takes what is left before others choose.
  for (const isOfKind of [isPart, isNamed, ({rank}) => rank < kRanks.named])
    for (const attempt of attempts) tryAll(labels.filter(isOfKind), attempt);
  return drawn;
}

/** Lets labels near one that has no room say less; a part keeps its name if it can. */
function shorten(labels, forms, without, drawn, unit) {
  for (const {x, y} of without)
    for (const {key, rank, texts, ...other} of labels) {
      if (distance([x, y], [other.x, other.y]) > kNear * unit) continue;
      const form = Math.max(forms.get(key), drawn.get(key)?.form ?? 0);
      const last = rank === kRanks.part ? Math.min(1, texts.length - 1) : texts.length - 1;
      if (form < last) forms.set(key, form + 1);
    }
}

/**
 * A place {text, box, line, side, far} of the label, or undefined. last: where it was drawn before.
 * around: {taken, lines, others}: labels that were drawn and their lines, which it keeps off, and
 * marks; attempt: see kAttempts.
 */
function choose(label, form, last, {taken, lines, others}, {level, reach}, context, unit) {
  const own = markOf(label, unit), text = label.texts[form];
  const length = context.measureText(text).width + 4 * unit;
  const isLast = level === kLastLevel && label.rank >= kRanks.named;
  const marks = others.filter(({rank}) => !kHidden[Math.min(level, kLastLevel - 1)].includes(rank));
  const placesAt = (sides, gaps) => gaps.flatMap((gap) => {
    const far = kGaps.indexOf(gap), all = far > 0 ? [...sides, ...kBetween] : sides;
    return all.map((side) => {
      const box = boxBeside(own, side, gap * unit, length, context.canvas, unit);
      return {text, side, far, box, line: lineOf(box, label, unit)};
    });
  });
  const find = (places, margin) => places.find(
      ({box, line}) => box.top >= 0 && box.bottom <= context.canvas.height &&
          isFree(box, [own], 0) && isFree(box, [...taken, ...marks], margin * unit) &&
          !lines.some((other) => crosses(other, box)) &&
          (line ? isClearLine(line, label, {taken, lines, marks: isLast ? [] : marks}, unit) :
                  isClearly(box, own, others, unit)));
  const middle = Math.max(kGaps[2], (kMostGap * context.canvas.width) / unit);
  const most = {near: kNearby, middle, far: Infinity}[reach];
  const near = kGaps.filter((gap) => gap <= most);
  const gaps = label.rank === kRanks.target ? near.slice(0, 1) :
      label.outline                         ? near.slice(kFirstOfPart) :
                                              near;
  const all = placesAt(label.box ? kBesideBox : kBesidePoint, gaps);
  const stays = last ? all.filter(({side}) => String(side) === String(last.side)) : [];
  return find(stays.filter(({far}) => far < last.far), kMargin) ??
      find(stays.filter(({far}) => far === last.far || far === last.far + 1), 0) ??
      find(all, kMargin) ?? find(all, 0);
}

/** Whether the line meets no other one, no label, and no mark but its own. */
function isClearLine(line, {x, y}, {taken, lines, marks}, unit) {
  const [, end] = line;
  return !taken.some((other) => crosses(line, other)) &&
      !lines.some((other) => meet(line, other)) && marks.every(({rank, centre, ...mark}) => {
        if (rank === kRanks.part) return true;
        // A line between marks that lie on each other leads to the one that is its own.
        if (distance([x, y], centre) < (kMark + kBesideLine) * unit)
          return distance(end, [x, y]) < distance(end, centre);
        return !crosses(line, grown(mark, kBesideLine * unit));
      });
}

const grown = ({left, right, top, bottom}, by) =>
    ({left: left - by, right: right + by, top: top - by, bottom: bottom + by});

/** Whether nobody takes a label without a line for another mark's. */
const isClearly = (box, own, others, unit) => others.every(
    (other) => other.rank === kRanks.part || apart(box, other) >= apart(box, own) + kApart * unit);

function drawAll(drawn, context, unit) {
  const labels = [...drawn];
  for (const {label, line} of labels)
    if (line) drawLine(context, line, label.colour ?? kInk, unit);
  context.lineWidth = 3.5 * unit;
  context.strokeStyle = '#0f172a';
  for (const {label, text, box} of labels) {
    context.fillStyle = label.colour ?? kInk;
    context.strokeText(text, box.left, box.bottom - kBelow * unit);
    context.fillText(text, box.left, box.bottom - kBelow * unit);
  }
}

/** What the label belongs to. */
const markOf = ({x, y, box}, unit) => box ?? {
  left: x - kMark * unit,
  right: x + kMark * unit,
  top: y - kMark * unit,
  bottom: y + kMark * unit
};

/** Inside the picture's width. */
function boxBeside(mark, [across, down], gap, length, {width}, unit) {
  const height = (kHeight + kBelow) * unit;
  const place = (way, from, to, size) => way === 0 ? (from + to - size) / 2 :
      way === 0.5                                  ? from :
      way === -0.5                                 ? to - size :
      way > 0                                      ? to + gap :
                                                     from - gap - size;
  const left =
      Math.max(Math.min(place(across, mark.left, mark.right, length), width - length), 2 * unit);
  const top = place(down, mark.top, mark.bottom, height);
  return {left, right: left + length, top, bottom: top + height};
}

const between = (value, from, to) => Math.max(from, Math.min(value, to));

/** The place of the box that is nearest to another one. */
const nearestIn =
    (box, [x, y]) => [between(x, box.left, box.right), between(y, box.top, box.bottom)];
const distance = ([x, y], [u, v]) => Math.hypot(x - u, y - v);

/**
 * [begin, end] from a label to the edge of its mark, or null where that is beside it; to an outline
 * always, to where it is nearest.
 */
function lineOf(box, {x, y, rank, outline}, unit) {
  const gap = (place) => distance(place, nearestIn(box, place));
  const aim = outline ? outline.reduce((a, b) => (gap(b) < gap(a) ? b : a)) : [x, y];
  const begin = nearestIn(box, aim);
  if (outline) return [begin, aim];
  const isTarget = rank === kRanks.target || rank === kRanks.namedTarget;
  const edge = (isTarget ? kCross : kMark) * unit, way = distance(begin, aim);
  if (way < kLineFrom * unit + edge) return null;
  const along = (k) => aim[k] + ((begin[k] - aim[k]) * edge) / way;
  return [begin, [along(0), along(1)]];
}

const apart = (a, b) => Math.hypot(
    Math.max(0, a.left - b.right, b.left - a.right),
    Math.max(0, a.top - b.bottom, b.top - a.bottom));

/** Whether two lines have a place in common. */
function meet([a, b], [c, d]) {
  const turn = ([x, y], [u, v], [p, q]) => Math.sign((u - x) * (q - y) - (v - y) * (p - x));
  return turn(a, b, c) !== turn(a, b, d) && turn(c, d, a) !== turn(c, d, b);
}

/** Whether a line runs through a box. */
function crosses([[x, y], [u, v]], box) {
  let from = 0, to = 1;
  for (const [at, way, low, high] of [
           [x, u - x, box.left, box.right], [y, v - y, box.top, box.bottom]]) {
    if (way === 0 && (at < low || at > high)) return false;
    if (way === 0) continue;
    const ends = [(low - at) / way, (high - at) / way];
    from = Math.max(from, Math.min(...ends));
    to = Math.min(to, Math.max(...ends));
  }
  return from <= to;
}

/** From a label to its mark. */
function drawLine(context, [begin, end], ink, unit) {
  context.beginPath();
  context.moveTo(...begin);
  context.lineTo(...end);
  for (const [colour, width] of [['#0f172a', 4], [ink, 2]]) {
    context.strokeStyle = colour;
    context.lineWidth = width * unit;
    context.stroke();
  }
}

const isFree = (box, taken, margin) => taken.every(
    (other) => box.right + margin < other.left || other.right < box.left - margin ||
        box.bottom + margin <= other.top || other.bottom <= box.top - margin);
