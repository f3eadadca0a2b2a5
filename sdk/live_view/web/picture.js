// The left view with the followed points, the targets and the plan; a click follows another point.
import {
  extrapolatedStatus,
  matchColour,
  observedStatus,
  stateColours,
  stateWords,
  statuses
} from '../../report/web/colours.js';
import {byId, element} from '../../report/web/data.js';
import {kRanks, Labels, plusMinus, textsOf} from './labels.js';
import {request, tell, untell} from './now.js';
import {drawPlan} from './plan.js';
import {labelOf, numberOf} from './points.js';
import {drawTargets, labelTargets, targetColour} from './targets.js';
import {statusWords} from './words.js';

const kChosenRadius = 6, kGridRadius = 2;  // pixels of the screen
// A mark's radius is at most this share of the distance between points that are spread evenly: many
// of them do not hide the tissue.
const kMarkShare = 0.15;

// Widths, pixels of the screen: of the picture, below and above which marks are smaller and larger;
// of a window whose text is larger.
const kLeastWidth = 480, kMostWidth = 1000, kMostWindow = 1800;
const kSmaller = 0.85;
const kMostPixels = 1920;  // of a picture's width that is drawn finer than it came
const kAnswerMs = 10000;   // within which a click is answered

const recognised = {
  name: 'recognised',
  colour: matchColour,
  meaning: 'a detail of the template that is seen here, with a line from where it was'
};

function showGridLegend() {
  const named = statuses.map((status, i) => ({...status, name: statusWords[i]}));
  byId('grid-meanings')
      .replaceChildren(...[...named, recognised].flatMap(
          ({name, colour, meaning}) =>
              [element(
                   'dt', {}, element('span', {class: 'swatch', style: `background: ${colour}`}),
                   name),
               element('dd', {}, meaning)]));
  const overlay = byId('overlay');
  const tell = () => {
    byId('grid-legend').hidden = !overlay.checked;
  };
  overlay.addEventListener('change', tell);
  tell();
}

/** In one line, for full screen. */
function showColours() {
  const entry = (shape, colour, text) => element(
      'span', {}, element('span', {class: `swatch ${shape}`, style: `background: ${colour}`}),
      text);
  const red = stateColours.lost, states = ['tracking', 'degraded', 'relocalised'];
  byId('colours').replaceChildren(
      ...[observedStatus, extrapolatedStatus].map(
          (status) => entry('round', statuses[status].colour, `point ${statusWords[status]}`)),
      entry('cross', targetColour, 'target, in its error'),
      ...states.map((state) => entry('', stateColours[state], stateWords[state])),
      entry('', red, 'do not use'));
}

export class Picture {
  constructor() {
    showGridLegend();
    showColours();
    this.canvas = byId('picture');
    this.context = this.canvas.getContext('2d');
    this.size = [1, 1];
    this.take(false, '');
    this.labels = new Labels();
    this.last = null;  // what show() was given
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    for (const box of ['overlay', 'show-points', 'show-targets', 'show-plan'])
      byId(box).addEventListener('change', () => this.draw());
    this.canvas.addEventListener('click', (event) => {
      if (!this.takesPoints) return tell(this.why);
      const box = this.canvas.getBoundingClientRect();
      const u = ((event.clientX - box.left) / box.width) * this.size[0] - 0.5;
      const v = ((event.clientY - box.top) / box.height) * this.size[1] - 0.5;
      this.clickedAt = performance.now();
      request('/points', {u, v}, 'It is looked up in the next picture.');
    });
    this.clickedAt = -Infinity;
    this.dropped = null;
    this.known = null;  // ids of points of users
  }

  /**
   * Whether a click follows a point: what is shown is where it was a moment ago. why: a click does
   * nothing otherwise.
   */
  take(points, why) {
    if (points || why !== this.why) untell(this.why);
    this.takesPoints = points;
    this.why = why;
    this.canvas.classList.toggle('takes-points', points);
    byId('click-hint').hidden = !points;
  }

  /**
   * Says what became of a click. dropped: clicks of all pages so far where there was no surface;
   * chosen: points of users.
   */
  answer(dropped, chosen) {
    const isAwaited = performance.now() - this.clickedAt < kAnswerMs;
    const added = chosen.find(({id}) => this.known && !this.known.has(id));
    if (isAwaited && added)
      tell(`Point ${labelOf(added)} is followed, ${plusMinus(added.error)}.`);
    else if (isAwaited && this.dropped !== null && dropped > this.dropped)
      tell('There is no surface there: no point was added.');
    this.known = new Set(chosen.map(({id}) => id));
    this.dropped = dropped;
  }

  /** No more pictures come: without one that has the grid, its box says so. */
  end() {
    const overlay = byId('overlay');
    if (this.last?.bitmaps.overlay) return;
    overlay.checked = false;
    overlay.disabled = true;
    overlay.title = 'The last picture came without the grid.';
    overlay.dispatchEvent(new Event('change'));
  }

  /**
   * Gives a small picture that is shown large more pixels, for labels that can be read; returns how
   * many for each of its own, along a side. shown: pixels of the screen.
   */
  fit(bitmap, shown) {
    const most = Math.floor(kMostPixels / bitmap.width);
    const fine = Math.max(1, Math.min(Math.ceil(shown / bitmap.width), most));
    const width = fine * bitmap.width, height = fine * bitmap.height;
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
      this.canvas.parentElement.style.setProperty('--ratio', width / height);
    }
    return fine;
  }

  /**
   * bitmaps: {left, overlay}, which are closed with the next ones; overlay: with the grid, where
   * that was asked for. points, plan: see readPoints, readPlan.
   */
  show(bitmaps, header, points, targets, plan) {
    for (const old of Object.values(this.last?.bitmaps ?? {})) old?.close();
    this.last = {bitmaps, header, points, targets, plan};
    this.draw();
  }

  /** The last picture, as large as it is shown now. */
  draw() {
    if (!this.last) return;
    const {bitmaps: {left, overlay}, header, points, targets, plan} = this.last;
    const bitmap = byId('overlay').checked ? overlay ?? left : left;
    const shown = this.canvas.clientWidth || 1;
    const fine = this.fit(bitmap, shown * (window.devicePixelRatio || 1));
    this.size = [header.width, header.height];
    this.context.drawImage(bitmap, 0, 0, this.canvas.width, this.canvas.height);
    const scale = this.canvas.width / header.width;
    // Marks keep their size on the screen where the picture is shown smaller, but on a telephone;
    // on a large screen, which is looked at from afar, they grow with it.
    const size = shown < kLeastWidth ?
        kSmaller :
        Math.max(1, shown / kMostWidth, window.innerWidth / kMostWindow);
    this.unit = fine * Math.min(3, (size * bitmap.width) / shown);
    this.labels.begin();
    if (plan && byId('show-plan').checked) {
      drawPlan(this.context, plan, scale, this.unit, this.labels);
      drawTargets(this.context, plan.targets, scale, this.unit);
      labelTargets(this.labels, plan.targets, 'plan', scale);
    }
    if (byId('show-points').checked) this.drawPoints(points, scale);
    if (byId('show-targets').checked) {
      drawTargets(this.context, targets, scale, this.unit);
      labelTargets(this.labels, targets, 'targets', scale);
    }
    this.labels.draw(this.context, this.unit);
  }

  drawPoints(points, scale) {
    const placed =
        points.filter(({u, v}) => u !== null && v !== null)
            .map((point) => ({...point, x: (point.u + 0.5) * scale, y: (point.v + 0.5) * scale}));
    this.drawMarks(placed);
    for (const point of placed)
      if (point.isChosen)
        this.labels.add(
            `point ${point.id}`, textsOf([labelOf(point), numberOf(point)], point.error), point.x,
            point.y, point.name ? kRanks.named : kRanks.point);
  }

  drawMarks(points) {
    const {context, unit} = this, {width, height} = this.canvas;
    const apart = Math.sqrt((width * height) / points.filter(({isChosen}) => isChosen).length);
    const chosenRadius =
        Math.min(kChosenRadius * unit, Math.max(kGridRadius * unit, kMarkShare * apart));
    for (const point of points) {
      context.beginPath();
      context.arc(
          point.x, point.y, point.isChosen ? chosenRadius : unit * kGridRadius, 0, 2 * Math.PI);
      context.fillStyle = statuses[point.status].colour;
      context.fill();
      context.setLineDash(point.status === observedStatus ? [] : [3 * unit, 2 * unit]);
      context.lineWidth = point.isChosen ? chosenRadius / 3 : 0.7 * unit;
      context.strokeStyle = point.isChosen ? '#ffffff' : '#0f172a';
      context.stroke();
      context.setLineDash([]);
    }
  }
}
