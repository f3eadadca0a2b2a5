// Labels on the left view, as many as have room beside each other.
import {number} from '../../report/web/data.js';

const kHeight = 14, kBelow = 4;  // of a line; of it beneath the base line
const kMostKept = 0.1;           // of the picture, in a box that no label hides
const kMark = 6;                 // half of a mark's side, on which no other one's label lies

/** Which labels come first where there is not room for all. */
export const kRanks = {
  part: 3,
  named: 2,
  target: 1,
  point: 0
};

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
    this.kept = [];  // boxes
  }

  /** A mark at x, y that no label hides. */
  avoid(x, y) {
    this.avoided.push({x, y});
  }

  /** What lies in the box, unless that is a large share of the picture, is hidden by no label. */
  avoidBox(box, {width, height}) {
    const area = (box.right - box.left) * (box.bottom - box.top);
    if (area < kMostKept * width * height) this.kept.push(box);
  }

  /** Beside a mark at x, y. The higher rank comes first. */
  add(key, text, x, y, rank) {
    this.wanted.push({key, text, x, y, rank});
  }

  /**
   * unit: a pixel of the screen. A label that is drawn stays, and stays where it is, if
   * it can.
   */
  draw(context, unit) {
    const before = this.places, taken = [];
    this.places = new Map();
    context.font = `600 ${kHeight * unit}px system-ui, sans-serif`;
    context.lineJoin = 'round';
    context.lineWidth = 3.5 * unit;
    context.strokeStyle = '#0f172a';
    context.fillStyle = '#ffffff';
    const rankOf = ({key, rank}) => 2 * rank + (before.has(key) ? 1 : 0);
    const {width, height} = context.canvas;
    const seen = this.wanted.filter(({x, y}) => x >= 0 && x <= width && y >= 0 && y <= height);
    const marks = [
      ...this.kept,
      ...[...seen, ...this.avoided].map(({key, x, y}) => ({key, ...boxRound(x, y, kMark * unit)}))
    ];
    for (const label of seen.sort((a, b) => rankOf(b) - rankOf(a))) {
      const places = this.boxes(label, context, unit), last = before.get(label.key) ?? 0;
      const others = marks.filter(({key}) => key !== label.key);
      const free = [last, 0, 1, 2, 3].filter(
          (i) => isInside(places[i], context.canvas) && isFree(places[i], taken));
      // The name of a part is worth more than marks of points.
      const place = free.find((i) => isFree(places[i], others)) ??
          (label.rank === kRanks.part ? free[0] : undefined);
      if (place === undefined) continue;
      taken.push(places[place]);
      this.places.set(label.key, place);
      const {left, bottom} = places[place];
      context.strokeText(label.text, left, bottom - kBelow * unit);
      context.fillText(label.text, left, bottom - kBelow * unit);
    }
  }

  /** On the right above, below; on the left above, below. */
  boxes({text, x, y}, context, unit) {
    const length = context.measureText(text).width, gap = 9 * unit;
    const height = (kHeight + kBelow) * unit, above = y - 4 * unit, below = above + gap + height;
    const lefts = [x + gap, x - gap - length].map(
        (left) => Math.max(Math.min(left, context.canvas.width - length - 2 * unit), 2 * unit));
    return lefts.flatMap(
        (left) => [above, below].map(
            (bottom) => ({left, right: left + length + 8 * unit, top: bottom - height, bottom})));
  }
}

const boxRound = (x, y, half) =>
    ({left: x - half, right: x + half, top: y - half, bottom: y + half});
const isInside = (box, {height}) => box.top >= 0 && box.bottom <= height;
const isFree = (box, taken) => taken.every(
    (other) => box.right < other.left || other.right < box.left || box.bottom <= other.top ||
        other.bottom <= box.top);
