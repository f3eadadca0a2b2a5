// Targets beneath the surface: on the left view, and in a list.
import {extrapolatedStatus, observedStatus, unknownStatus} from '../../report/web/colours.js';
import {byId, element, number, table} from '../../report/web/data.js';
import {statusCell} from '../../report/web/summary.js';
import {kRanks, textsOf} from './labels.js';
import {isTooLarge, kMostErrorMm} from './words.js';

export const targetColour = '#c6ff1a';
const kArm = 3.5;        // of a mark, pixels of the screen
const kMostNumbers = 6;  // of targets without a name of their own whose labels are shown

/** A name of digits alone, as of targets without one, would be read as a number. */
const isNumber = (id) => /^-?\d+$/.test(id);
export const nameOf = ({id}) => (isNumber(id) ? `target ${id}` : id);

/** "T3" for each, where names have no room: of target 3, or the next that no other one has. */
function numbersOf(ids) {
  const taken = new Set(ids.filter(isNumber)), numbers = [];
  let next = 1;
  for (const id of ids) {
    while (!isNumber(id) && taken.has(String(next))) ++next;
    numbers.push(`T${isNumber(id) ? id : next++}`);
  }
  return numbers;
}

/**
 * The header's. id: the name of a plan's target that has one. What is lost has neither centre nor
 * pixel; radius: of the expected error, pixels.
 */
export function readTargets({targets}) {
  const numbers = numbersOf(targets.map(([id]) => String(id)));
  return targets.map(([id, depth, status, u, v, radius, x, y, z, error], i) => ({
                       id: String(id),
                       number: numbers[i],
                       depth,
                       status,
                       u,
                       v,
                       radius,
                       error,
                       centre: status === unknownStatus ? null : [x, y, z]
                     }));
}

export const hasPlace = ({status}) => status !== unknownStatus;
export const placedTargets = (targets) => targets.filter(hasPlace);

/** The largest expected error of what is drawn, mm; -1 where nothing is. */
export const largestError = (things, isDrawn = hasPlace) =>
    things.filter(isDrawn).reduce((most, {error}) => Math.max(most, error ?? -1), -1);

const isSeen = ({centre, u, v}) => centre && u !== null && v !== null;

/**
 * A small cross, in a ring with the expected error as radius where that is larger, dashed where the
 * target is not observed. scale: of the picture; unit: a pixel of the screen.
 */
export function drawTargets(context, targets, scale, unit) {
  const seen = targets.filter(isSeen);
  const stroke = (path, colour, width) => {
    context.strokeStyle = colour;
    context.lineWidth = width * unit;
    context.stroke(path);
  };
  for (const {status, u, v, radius} of seen) {
    if (radius === null || radius * scale < kArm * unit) continue;
    const ring = new Path2D();
    ring.arc((u + 0.5) * scale, (v + 0.5) * scale, radius * scale, 0, 2 * Math.PI);
    if (status !== observedStatus) context.setLineDash([3 * unit, 3 * unit]);
    stroke(ring, targetColour, 1);
    context.setLineDash([]);
  }
  const crosses = new Path2D(), arm = kArm * unit;
  for (const {u, v} of seen) {
    const x = (u + 0.5) * scale, y = (v + 0.5) * scale;
    crosses.moveTo(x - arm, y);
    crosses.lineTo(x + arm, y);
    crosses.moveTo(x, y - arm);
    crosses.lineTo(x, y + arm);
  }
  stroke(crosses, '#0f172a', 3.5);
  stroke(crosses, targetColour, 1.5);
}

/** Labels targets with a name, and the others where they are few. of: what has them. */
export function labelTargets(labels, targets, of, scale) {
  const isFew = targets.length <= kMostNumbers;
  for (const target of targets.filter(isSeen)) {
    const x = (target.u + 0.5) * scale, y = (target.v + 0.5) * scale;
    if (!isFew && isNumber(target.id))
      labels.avoid(x, y);
    else
      labels.add(
          `${of} ${target.id}`, textsOf([nameOf(target), target.number], target.error), x, y,
          isNumber(target.id) ? kRanks.target : kRanks.namedTarget);
  }
}

/** A name, after the number by which a label calls it where there is no room for that. */
export const nameCell = (target) =>
    (isNumber(target.id) ?
         element('span', {}, nameOf(target)) :
         element('span', {}, element('span', {class: 'number'}, target.number), nameOf(target)));

/** Whether the header has all of them. */
export const shareShown = (targets, count) =>
    targets.length < count ? `${targets.length} of ${count} targets are shown, evenly chosen.` : '';

/** Worse than what is usual beneath the surface, in a frame that is followed. */
export const warningCell = (word) => statusCell(extrapolatedStatus, word);

/** What has no place is a warning only where the tissue above is followed. */
export function placeCell(status, isOfFollowed) {
  if (status === unknownStatus)
    return isOfFollowed ? warningCell('not placed') : statusCell(status, 'not placed');
  return status === extrapolatedStatus ? element('span', {}, 'placed') :
                                         statusCell(status, 'placed');
}

/** "0.6 mm" */
export const lengthCell = (value) => (Number.isFinite(value) ? `${number(value, 1)} mm` : '–');

/** An expected error, marked where it is too large for the place to be used. */
export const errorCell = (error) => element(
    'span', isTooLarge(error) ? {class: 'too-large', title: `above ${kMostErrorMm} mm`} : {},
    lengthCell(error));

/** Hidden until there is a target. count: of all that are followed. why: see showPlanList. */
export function showTargetList(targets, count, isOfFollowed, why) {
  if (count)
    for (const id of ['targets', 'target-controls', 'see-through-control']) byId(id).hidden = false;
  const rows = targets.map(
      ({id, depth, status, centre, error}) =>
          [id, lengthCell(depth), placeCell(status, isOfFollowed),
           centre ? centre.map((value) => number(value, 1)).join(', ') : '–', errorCell(error)]);
  byId('targets-count').textContent = shareShown(targets, count);
  byId('targets-why').textContent = why;
  byId('targets-list')
      .replaceChildren(
          rows.length ?
              table(['Target', 'Depth', 'Status', 'x, y, z in mm', 'Expected error'], rows) :
              element('p', {class: 'hint'}, 'None in this frame.'));
}
