// A plan: the outlines of its parts and its targets on the left view, and in a list.
import {partColour} from '../../report/web/colours.js';
import {byId, element, number, table} from '../../report/web/data.js';
import {kRanks, plusMinus} from './labels.js';
import {
  errorCell,
  hasPlace,
  largestError,
  lengthCell,
  nameCell,
  placeCell,
  readTargets,
  shareShown,
  warningCell
} from './targets.js';

const kUnknownColour = '#9ca3af';
const kFill = 0.2, kHalo = 0.3;       // shares of a part's colour
const kLighter = 0.35;                // of the way to white
const kSilhouette = 0, kUnknown = 1;  // and 2: where the image ends

/**
 * null without a plan. Outlines: closed lines of [u, v, radius, kind]. depth: of what is nearest to
 * the surface, mm; way: from there to the surface, x, y, z each; both null where nothing of the
 * part is known beneath the surface.
 */
export function readPlan({plan}) {
  if (!plan) return null;
  const parts = plan.parts.map(([name, status, error, outlines, way], i) => ({
                                 name,
                                 status,
                                 error,
                                 outlines,
                                 depth: way?.[0] ?? null,
                                 way: way?.slice(1) ?? null,
                                 colour: partColour(i)
                               }));
  return {
    parts,
    targets: readTargets(plan),
    targetCount: plan.target_count,
    targetsPlaced: plan.targets_placed
  };
}

/** A part without a place of its own may be known, and drawn, where its vertices are. */
export const isPartlyKnown = (part) => !hasPlace(part) && part.outlines.length > 0;

/** For the banner. */
export const partsKnown = (parts) => ({
  all: parts.length,
  placed: parts.filter(hasPlace).length,
  partly: parts.filter(isPartlyKnown).length,
  largest: largestError(parts, (part) => part.outlines.length > 0)
});

/** "9.6 mm deep"; what comes out of the surface has a negative depth. */
function depthInWords({depth}) {
  if (depth === null) return '';
  return depth < 0 ? `${number(-depth, 1)} mm above the surface` : `${number(depth, 1)} mm deep`;
}

/** "#rrggbb", for text that can be read on tissue, and where the picture turns gray. */
const lighter = (colour) => `#${
        [1, 3, 5]
            .map((at) => parseInt(colour.slice(at, at + 2), 16))
            .map(
                (level) =>
                    Math.round(level + kLighter * (255 - level)).toString(16).padStart(2, '0'))
            .join('')}`;

/** scale: of the picture. unit: a pixel of the screen. */
function drawPart(context, part, scale, unit, labels) {
  const {name, error, outlines, colour} = part;
  const at = ([u, v]) => [(u + 0.5) * scale, (v + 0.5) * scale];
  const inside = new Path2D(), halo = new Path2D(), whole = new Path2D(), open = new Path2D();
  for (const outline of outlines) {
    outline.forEach((point, i) => {
      const next = outline[(i + 1) % outline.length], kinds = [point[3], next[3]];
      const [x, y] = at(point);
      inside[i === 0 ? 'moveTo' : 'lineTo'](x, y);
      if (point[3] === kSilhouette) {
        halo.moveTo(x, y);
        halo.arc(x, y, Math.max(1, point[2] * scale), 0, 2 * Math.PI);
      }
      if (!kinds.every((kind) => kind === kSilhouette) && !kinds.includes(kUnknown)) return;
      const line = kinds.includes(kUnknown) ? open : whole;
      line.moveTo(x, y);
      line.lineTo(...at(next));
    });
    inside.closePath();
  }
  context.fillStyle = colour;
  context.globalAlpha = kFill;
  context.fill(inside, 'evenodd');
  context.globalAlpha = kHalo;
  context.fill(halo);
  context.globalAlpha = 1;
  // A dark edge, since in an old picture, which is gray, the colour may be that of the tissue.
  for (const [edge, width] of [['#0f172a', 4], [colour, 2]]) {
    context.lineWidth = width * unit;
    context.strokeStyle = edge;
    context.stroke(whole);
  }
  context.strokeStyle = kUnknownColour;
  context.setLineDash([5 * unit, 5 * unit]);
  context.stroke(open);
  context.setLineDash([]);
  const places = outlines.flat().map(at);
  const side = (k, most) => places.reduce((a, place) => most(a, place[k]), places[0][k]);
  const box = {
    left: side(0, Math.min),
    right: side(0, Math.max),
    top: side(1, Math.min),
    bottom: side(1, Math.max)
  };
  // Error and depth of what is known are not those of the part. Its colour tells which it is.
  const about = isPartlyKnown(part) ? ['partly known'] : [plusMinus(error), depthInWords(part)];
  const texts = [`${name} ${about.filter(Boolean).join(', ')}`, `${name} ${about[0]}`, about[0]];
  labels.addBox(
      `part ${name}`, texts, {box, outline: places, colour: lighter(colour)}, kRanks.part,
      context.canvas);
}

/** Only what is known of the parts. */
export function drawPlan(context, plan, scale, unit, labels) {
  for (const part of plan.parts)
    if (part.outlines.length) drawPart(context, part, scale, unit, labels);
}

const partStatus = (part, isOfFollowed) =>
    isPartlyKnown(part) ? warningCell('partly known') : placeCell(part.status, isOfFollowed);

/** In the part's colour where it is drawn in that, and only its edge where it is not drawn. */
export const partSwatch = (part) => element('span', {
  class: hasPlace(part) || isPartlyKnown(part) ? 'swatch' : 'swatch hollow',
  style: `--swatch: ${part.colour}`
});

/** Hidden until there is a plan. why: not all have a place, in a followed frame. */
export function showPlanList(plan, isOfFollowed, why) {
  if (!plan) return;
  for (const id of ['plan', 'plan-control', 'see-through-control']) byId(id).hidden = false;
  byId('plan-targets').hidden = plan.targetCount === 0;
  byId('plan-list').hidden = plan.parts.length === 0;
  byId('plan-count').textContent = shareShown(plan.targets, plan.targetCount);
  byId('plan-why').textContent = why;
  const heads = ['Status', 'Expected error', 'Depth'];
  byId('plan-list')
      .replaceChildren(table(
          ['Part', ...heads],
          plan.parts.map(
              (part) =>
                  [element('span', {}, partSwatch(part), part.name), partStatus(part, isOfFollowed),
                   errorCell(part.outlines.length ? part.error : null), lengthCell(part.depth)])));
  byId('plan-targets-list')
      .replaceChildren(table(
          ['Target', ...heads, 'x, y, z in mm'],
          plan.targets.map(
              (target) =>
                  [nameCell(target), placeCell(target.status, isOfFollowed),
                   errorCell(target.error), lengthCell(target.centre ? target.depth : null),
                   target.centre ? target.centre.map((value) => number(value, 1)).join(', ') :
                                   '–'])));
}
