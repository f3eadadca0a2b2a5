// Labels on the left view, as many as have room beside each other.
import {number} from '../../report/web/data.js';

const kHeight = 14, kBelow = 4;  // of a line; of it beneath the base line
const kMostKept = 0.1;           // of the picture, in a box that no label hides
const kMark = 6;                 // half of a mark's side, on which no other one's label lies
const kMargin = 4;               // free round a place that is new, so that a label does not jump
const kGaps = [3, 14, 30, 50, 76, 110];  // from mark to label
const kLineFrom = 8;                     // a label that is farther off has a line to its mark
const kApart = 10;                       // so much nearer than others is the mark of one without
const kFirstOfPart = 1;                  // of the gaps, so that the line to a part can be seen
const kMostOfPoint = 3;                  // gaps for a point without a name

/** Which labels come first where there is not room for all: those of the plan. */
export const kRanks = {
  part: 4,
  namedTarget: 3,
  named: 2,
  point: 1,
  target: 0
};

// On which side of its mark a label stands, in the order of preference: [across, down].
const kCorners = [[1, -1], [1, 1], [-1, -1], [-1, 1]], kSides = [[0, -1], [0, 1], [1, 0], [-1, 0]];
const kBesidePoint = [...kCorners, [1, 0], [-1, 0], [0, -1], [0, 1]];
const kBesideBox = [...kSides, ...kCorners];

const kInk = '#ffffff';

/** The expected error, which could be taken for a size without the sign. */
export const plusMinus = (error) => `\u00b1${number(error, 1)} mm`;

export class Labels {
  constructor() {
    this.begin();
    this.places = new Map();  // where each was drawn last, by its key
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

  /** Beside a mark at x, y. The higher rank comes first. brief: the text where there is no room. */
  add(key, text, x, y, rank, brief = text) {
    this.wanted.push({key, text, brief, x, y, rank});
  }

  /**
   * A label in the colour, with a line to the outline, places [x, y], of what lies in the box. No
   * label hides that unless it is a large share of the picture: then it stands beside its upper
   * end.
   */
  addBox(key, text, {box, outline, colour, brief = text}, rank, {width, height}) {
    const inside = {
      left: Math.max(0, box.left),
      right: Math.min(width, box.right),
      top: Math.max(0, box.top),
      bottom: Math.min(height, box.bottom)
    };
    const area = (inside.right - inside.left) * (inside.bottom - inside.top);
    const x = (inside.left + inside.right) / 2;
    if (!(area > 0)) return;
    const label = {key, text, brief, x, y: inside.top, rank, outline, colour};
    this.wanted.push(area < kMostKept * width * height ? {...label, box: inside} : label);
  }

  /**
   * unit: a pixel of the screen. A label that is drawn stays, and stays on its side, if it can.
   */
  draw(context, unit) {
    const before = this.places, taken = [], drawn = [], lines = [];
    this.places = new Map();
    context.font = `600 ${kHeight * unit}px system-ui, sans-serif`;
    context.lineJoin = 'round';
    const rankOf = ({key, rank}) => 2 * rank + (before.has(key) ? 1 : 0);
    const {width, height} = context.canvas;
    const seen = this.wanted.filter(({x, y}) => x >= 0 && x <= width && y >= 0 && y <= height);
    const marks = [...seen, ...this.avoided].map(
        (mark) => ({key: mark.key, rank: mark.rank, ...markOf(mark, unit)}));
    const inOrder = seen.sort((a, b) => rankOf(b) - rankOf(a));
    const isPart = ({rank}) => rank === kRanks.part;
    const parts = inOrder.filter(isPart), rest = inOrder.filter((label) => !isPart(label));
    // Whoever has no room gets what is left; a part does so before others choose.
    for (const [labels, isLast] of [[parts, false], [parts, true], [rest, false], [rest, true]])
      for (const label of labels) {
        if (this.places.has(label.key)) continue;
        const others = marks.filter(({key}) => key !== label.key);
        const find = (text, isForced) => choose(
            {...label, text}, before.get(label.key), {taken, lines, others, isForced}, context,
            unit);
        const place = isLast ? squeezeText(label, find) : find(label.text, false);
        if (!place) continue;
        taken.push(place.box);
        if (place.line) lines.push(place.line);
        drawn.push({label, ...place});
        this.places.set(label.key, place);
      }
    for (const {label, line} of drawn)
      if (line) drawLine(context, line, label.colour ?? kInk, unit);
    context.lineWidth = 3.5 * unit;
    context.strokeStyle = '#0f172a';
    for (const {label, text, box} of drawn) {
      context.fillStyle = label.colour ?? kInk;
      context.strokeText(text, box.left, box.bottom - kBelow * unit);
      context.fillText(text, box.left, box.bottom - kBelow * unit);
    }
  }
}

/**
 * The place of a label that has none yet. A name alone is better than one that hides marks; a
 * point's error is worth a line, and hides nothing.
 */
const squeezeText = ({text, brief, rank}, find) =>
    (rank === kRanks.point ? undefined : find(brief, false)) ?? find(text, true) ??
    find(brief, true);

/**
 * A place {text, box, line, side, far} of the label, or undefined. last: where it was drawn before.
 * taken, lines: labels that were drawn, which it keeps off; others: marks that it does not hide.
 * isForced: where there is no room, it may.
 */
function choose(label, last, {taken, lines, others, isForced}, context, unit) {
  const own = markOf(label, unit), length = context.measureText(label.text).width + 4 * unit;
  const placesAt = (sides, gaps) => gaps.flatMap((gap, far) => sides.map((side) => {
    const box = boxBeside(own, side, gap * unit, length, context.canvas, unit);
    return {text: label.text, side, far, box, line: lineOf(box, own, label.outline, unit)};
  }));
  const find = (places, marks, margin) => places.find(
      ({box, line}) => box.top >= 0 && box.bottom <= context.canvas.height &&
          isFree(box, [own], 0) && isFree(box, [...taken, ...marks], margin * unit) &&
          !lines.some((other) => crosses(other, box)) &&
          (line ? isClearLine(line, taken, lines) : isClearly(box, own, others, unit)));
  // Only what has a name of its own is worth a line, unless there is no room.
  const gaps = label.rank === kRanks.target || label.rank === kRanks.point ? kGaps.slice(0, 1) :
      label.outline ? kGaps.slice(kFirstOfPart) :
                      kGaps;
  const all = placesAt(label.box ? kBesideBox : kBesidePoint, gaps);
  if (isForced) {
    const farther =
        placesAt([...(last ? [last.side] : []), ...kBesidePoint], kGaps.slice(0, kMostOfPoint));
    return squeeze(label.rank, find, all, farther, others);
  }
  const stays = last ? placesAt([last.side], gaps) : [];
  return find(stays.slice(0, last?.far), others, kMargin) ??
      find(stays.slice(last?.far, last?.far + 2), others, 0) ?? find(all, others, kMargin) ??
      find(all, others, 0);
}

/** Whether the line meets no other one and no label. */
const isClearLine = (line, taken, lines) =>
    !taken.some((other) => crosses(line, other)) && !lines.some((other) => meet(line, other));

/** Whether nobody takes a label without a line for another mark's. */
const isClearly = (box, own, others, unit) => others.every(
    (other) => other.rank === kRanks.part || apart(box, other) >= apart(box, own) + kApart * unit);

/** A place where there is no room without a line, or without hiding marks; or undefined. */
function squeeze(rank, find, all, farther, others) {
  if (rank === kRanks.target) return undefined;
  const marksOf = (...ranks) => others.filter((mark) => ranks.includes(mark.rank));
  // A name is worth more than marks, and what is said of a followed point more than those of other
  // things.
  if (rank === kRanks.part)
    return find(all, marksOf(kRanks.named, kRanks.point), 0) ?? find(all, [], 0);
  if (rank !== kRanks.point) return find(all, [], 0);
  return find(farther, others, 0) ??
      find(all, marksOf(kRanks.named, kRanks.point, kRanks.part), 0) ??
      find(all, marksOf(kRanks.named, kRanks.point), 0);
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
 * [begin, end] from a label to its mark, or null where that is beside it; to an outline always, to
 * where it is nearest.
 */
function lineOf(box, mark, outline, unit) {
  const middle = [(box.left + box.right) / 2, (box.top + box.bottom) / 2];
  const gap = (place) => distance(place, nearestIn(box, place));
  const end =
      outline ? outline.reduce((a, b) => (gap(b) < gap(a) ? b : a)) : nearestIn(mark, middle);
  const begin = nearestIn(box, end);
  return outline || distance(begin, end) >= kLineFrom * unit ? [begin, end] : null;
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
