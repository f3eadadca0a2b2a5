// Targets beneath the surface: on the left view, and in a list.
import {observedStatus, unknownStatus} from '../../report/web/colours.js';
import {byId, element, number, table} from '../../report/web/data.js';
import {statusCell} from '../../report/web/summary.js';

export const targetColour = '#f472ff';
const kTargetArm = 3;
const kMinTargetRadius = 6;

/**
 * The header's. id: the name of a plan's target that has one. What is lost has neither centre nor
 * pixel; radius: of the expected error, pixels.
 */
export const readTargets = ({targets}) =>
    targets.map(([id, depth, status, u, v, radius, x, y, z, error]) => ({
                  id,
                  depth,
                  status,
                  u,
                  v,
                  radius,
                  error,
                  centre: status === unknownStatus ? null : [x, y, z]
                }));

export const placedTargets = (targets) => targets.filter(({centre}) => centre);

/**
 * A cross in a ring with the expected error as radius, dashed where the target is not observed.
 * scale: of the picture.
 */
export function drawTargets(context, targets, scale) {
  for (const {status, u, v, radius} of placedTargets(targets)) {
    if (u === null || v === null) continue;
    const x = (u + 0.5) * scale, y = (v + 0.5) * scale;
    const cross = new Path2D();
    cross.moveTo(x - kTargetArm, y);
    cross.lineTo(x + kTargetArm, y);
    cross.moveTo(x, y - kTargetArm);
    cross.lineTo(x, y + kTargetArm);
    const ring = new Path2D();
    if (radius !== null) ring.arc(x, y, Math.max(radius * scale, kMinTargetRadius), 0, 2 * Math.PI);
    for (const [colour, width, dashes] of [
             ['#0f172a', 4.5, []], [targetColour, 2, status === observedStatus ? [] : [5, 3]]]) {
      context.strokeStyle = colour;
      context.lineWidth = width;
      context.stroke(cross);
      context.setLineDash(dashes);
      context.stroke(ring);
      context.setLineDash([]);
    }
  }
}

/** Hidden until there is a target. count: of all that are followed. */
export function showTargetList(targets, count) {
  if (count)
    for (const id of ['targets', 'target-controls', 'see-through-control']) byId(id).hidden = false;
  const rows = targets.map(
      ({id, depth, status, centre, error}) =>
          [String(id), number(depth), statusCell(status),
           centre ? centre.map((value) => number(value, 1)).join(', ') : '–', number(error)]);
  byId('targets-count').textContent =
      targets.length < count ? `${targets.length} of ${count} are shown, evenly chosen.` : '';
  byId('targets-list')
      .replaceChildren(
          rows.length ?
              table(
                  ['Target', 'Depth, mm', 'Status', 'x, y, z in mm', 'Expected error, mm'], rows) :
              element('p', {class: 'hint'}, 'None in this frame.'));
}
