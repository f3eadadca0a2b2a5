// The left view with the followed points, the targets and the plan; a click follows another point.
import {matchColour, observedStatus, statuses} from '../../report/web/colours.js';
import {byId, element, number} from '../../report/web/data.js';
import {request} from './now.js';
import {drawPlan} from './plan.js';
import {labelOf} from './points.js';
import {drawTargets} from './targets.js';

const kChosenRadius = 6, kGridRadius = 2, kLabelHeight = 14;

function showGridLegend() {
  const entries = [...statuses, {name: 'recognised', colour: matchColour}];
  byId('grid-legend')
      .replaceChildren(...entries.map(
          ({name, colour}) => element(
              'span', {}, element('span', {class: 'swatch', style: `background: ${colour}`}),
              name)));
  const overlay = byId('overlay');
  const tell = () => {
    byId('grid-legend').hidden = !overlay.checked;
  };
  overlay.addEventListener('change', tell);
  tell();
}

export class Picture {
  constructor() {
    showGridLegend();
    this.canvas = byId('picture');
    this.context = this.canvas.getContext('2d');
    this.size = [1, 1];
    this.hasEnded = false;
    this.labelled = new Set();  // ids of the points whose labels were drawn last
    this.canvas.addEventListener('click', (event) => {
      if (this.hasEnded) return;
      const box = this.canvas.getBoundingClientRect();
      const u = ((event.clientX - box.left) / box.width) * this.size[0] - 0.5;
      const v = ((event.clientY - box.top) / box.height) * this.size[1] - 0.5;
      request('/points', {u, v});
    });
  }

  /** points, plan: see readPoints, readPlan. */
  show(bitmap, header, points, targets, plan) {
    if (this.canvas.width !== bitmap.width || this.canvas.height !== bitmap.height) {
      this.canvas.width = bitmap.width;
      this.canvas.height = bitmap.height;
    }
    this.size = [header.width, header.height];
    this.context.drawImage(bitmap, 0, 0);
    const scale = bitmap.width / header.width;
    // Marks keep their size on the screen where the picture is shown smaller or larger.
    this.unit = Math.min(3, Math.max(0.7, bitmap.width / (this.canvas.clientWidth || 1)));
    if (plan && byId('show-plan').checked) {
      drawPlan(this.context, plan, scale, this.unit);
      drawTargets(this.context, plan.targets, scale);
    }
    if (byId('show-points').checked) this.drawPoints(points, scale);
    if (byId('show-targets').checked) drawTargets(this.context, targets, scale);
  }

  drawPoints(points, scale) {
    const placed =
        points.filter(({u, v}) => u !== null && v !== null)
            .map((point) => ({...point, x: (point.u + 0.5) * scale, y: (point.v + 0.5) * scale}));
    this.drawMarks(placed);
    this.drawLabels(placed.filter(({isChosen}) => isChosen));
  }

  drawMarks(points) {
    const {context, unit} = this;
    for (const point of points) {
      context.beginPath();
      context.arc(
          point.x, point.y, unit * (point.isChosen ? kChosenRadius : kGridRadius), 0, 2 * Math.PI);
      context.fillStyle = statuses[point.status].colour;
      context.fill();
      context.setLineDash(point.status === observedStatus ? [] : [3 * unit, 2 * unit]);
      context.lineWidth = (point.isChosen ? 2 : 0.7) * unit;
      context.strokeStyle = point.isChosen ? '#ffffff' : '#0f172a';
      context.stroke();
      context.setLineDash([]);
    }
  }

  /** Labels that have room: those with names first, then those that were drawn last time. */
  drawLabels(points) {
    const {context, unit} = this, taken = [];
    const rank = ({id, name}) => (name ? 2 : 0) + (this.labelled.has(id) ? 1 : 0);
    const ranked = points.map((point) => ({...point, rank: rank(point)}));
    ranked.sort((a, b) => b.rank - a.rank);
    this.labelled = new Set();
    context.font = `600 ${kLabelHeight * unit}px system-ui, sans-serif`;
    context.lineJoin = 'round';
    context.lineWidth = 3.5 * unit;
    context.strokeStyle = '#0f172a';
    context.fillStyle = '#ffffff';
    const gap = 10 * unit, height = kLabelHeight * unit;
    for (const point of ranked) {
      const text = `${labelOf(point)}  ${number(point.error, 1)} mm`;
      const length = context.measureText(text).width, y = point.y - 8 * unit;
      const left =
          point.x + gap + length < this.canvas.width ? point.x + gap : point.x - gap - length;
      const isTaken = taken.some(
          (other) => left < other.left + other.length && other.left < left + length &&
              Math.abs(y - other.y) < height);
      if (isTaken) continue;
      taken.push({left, length, y});
      this.labelled.add(point.id);
      context.strokeText(text, left, y);
      context.fillText(text, left, y);
    }
  }
}
