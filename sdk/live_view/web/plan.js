// A plan: the outlines of its parts and its targets on the left view, and in a list.
import {partColour} from '../../report/web/colours.js';
import {byId, element, number, table} from '../../report/web/data.js';
import {statusCell} from '../../report/web/summary.js';
import {kRanks} from './labels.js';
import {readTargets} from './targets.js';

const kUnknownColour = '#9ca3af';
const kSilhouette = 0, kUnknown = 1;  // and 2: where the image ends

/** null without a plan. Outlines: closed lines of [u, v, radius, kind]. */
export function readPlan({plan}) {
  if (!plan) return null;
  const parts = plan.parts.map(
      ([name, status, error, outlines], i) =>
          ({name, status, error, outlines, colour: partColour(i)}));
  return {parts, targets: readTargets(plan)};
}

/** scale: of the picture. unit: a pixel of the screen. */
function drawPart(context, {name, error, outlines, colour}, scale, unit, labels) {
  const at = ([u, v]) => [(u + 0.5) * scale, (v + 0.5) * scale];
  const halo = new Path2D(), whole = new Path2D(), open = new Path2D();
  for (const outline of outlines)
    outline.forEach((point, i) => {
      const next = outline[(i + 1) % outline.length], kinds = [point[3], next[3]];
      const [x, y] = at(point);
      if (point[3] === kSilhouette) {
        halo.moveTo(x, y);
        halo.arc(x, y, Math.max(1, point[2] * scale), 0, 2 * Math.PI);
      }
      if (!kinds.every((kind) => kind === kSilhouette) && !kinds.includes(kUnknown)) return;
      const line = kinds.includes(kUnknown) ? open : whole;
      line.moveTo(x, y);
      line.lineTo(...at(next));
    });
  context.globalAlpha = 0.3;
  context.fillStyle = colour;
  context.fill(halo);
  context.globalAlpha = 1;
  context.lineWidth = 2 * unit;
  context.strokeStyle = colour;
  context.stroke(whole);
  context.strokeStyle = kUnknownColour;
  context.setLineDash([5 * unit, 5 * unit]);
  context.stroke(open);
  context.setLineDash([]);
  const [top] = outlines.flat().sort((a, b) => a[1] - b[1]);
  labels.add(`part ${name}`, `${name}  ${number(error, 1)} mm`, ...at(top), kRanks.part);
}

/** Only what is known of the parts; the targets are drawn as others are, with their labels. */
export function drawPlan(context, plan, scale, unit, labels) {
  for (const part of plan.parts)
    if (part.outlines.length) drawPart(context, part, scale, unit, labels);
  for (const {id, centre, u, v, error} of plan.targets)
    if (centre && u !== null && v !== null)
      labels.add(
          `target ${id}`, `${id}  ${number(error, 1)} mm`, (u + 0.5) * scale, (v + 0.5) * scale,
          kRanks.target);
}

/** Hidden until there is a plan. */
export function showPlanList(plan) {
  if (!plan) return;
  for (const id of ['plan', 'plan-control']) byId(id).hidden = false;
  const rows = [
    ...plan.parts.map(
        ({name,
          status,
          error,
          outlines}) => [name, statusCell(status), outlines.length ? number(error) : '–', '–']),
    ...plan.targets.map(
        ({id, status, error, centre}) =>
            [String(id), statusCell(status), number(error),
             centre ? centre.map((value) => number(value, 1)).join(', ') : '–'])
  ];
  byId('plan-list')
      .replaceChildren(
          rows.length ?
              table(['Part or target', 'Status', 'Expected error, mm', 'x, y, z in mm'], rows) :
              element('p', {class: 'hint'}, 'None in this frame.'));
}
