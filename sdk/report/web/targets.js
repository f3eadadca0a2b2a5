// Targets beneath the surface: expected error over their depth, and a list of them in a frame.
import {unknownStatus} from './colours.js';
import {byId, element, isPlaced, number, table} from './data.js';
import {beneathStatusCell} from './summary.js';
import {svg, tickLabel, ticks} from './svg.js';

const kPlotWidth = 460, kPlotHeight = 300, kLeft = 48, kRight = 14, kTop = 10, kBottom = 42;
const kMaxDepths = 12;  // more are shown in ranges

function share(sorted, part) {
  return sorted[Math.round(part * (sorted.length - 1))];
}

/** The expected errors of all frames, by depth: one group for each depth or for ranges of it. */
function byDepth(labels, moments) {
  const depths = [...new Set(labels.map(({depth}) => depth).filter((depth) => depth !== null))];
  const step =
      depths.length > kMaxDepths ? ticks(Math.min(...depths), Math.max(...depths)).step : 0;
  const groups = new Map();
  labels.forEach(({depth}, i) => {
    if (depth === null) return;
    const low = step ? step * Math.floor(depth / step) : depth;
    if (!groups.has(low))
      groups.set(
          low,
          {name: step ? `${low} to ${low + step}` : `${depth}`, depth: low + step / 2, errors: []});
    for (const {targets} of moments)
      if (targets[i] && isPlaced(targets[i])) groups.get(low).errors.push(targets[i].error);
  });
  const filled = [...groups.values()].filter(({errors}) => errors.length);
  for (const {errors} of filled) errors.sort((a, b) => a - b);
  return filled.sort((a, b) => a.depth - b.depth);
}

function depthPlot(groups) {
  const low = groups[0].depth, high = groups.at(-1).depth;
  const margin = 0.05 * (high - low || 1);
  const top = Math.max(...groups.map(({errors}) => errors.at(-1))) * 1.08 || 1;
  const x = (depth) =>
      kLeft + ((depth - low + margin) / (high - low + 2 * margin)) * (kPlotWidth - kLeft - kRight);
  const y = (error) => kPlotHeight - kBottom - (error / top) * (kPlotHeight - kTop - kBottom);
  const plot = svg('svg', {
    class: 'depth-plot',
    viewBox: `0 0 ${kPlotWidth} ${kPlotHeight}`,
    role: 'img',
    'aria-label': 'Expected error over depth'
  });
  const line = (name, x1, y1, x2, y2) => svg('line', {class: name, x1, y1, x2, y2});
  const text = (at, height, anchor, label) =>
      svg('text', {x: at, y: height, 'text-anchor': anchor}, label);
  for (const error of ticks(0, top).values)
    plot.append(
        line('grid', kLeft, y(error), kPlotWidth - kRight, y(error)),
        text(kLeft - 6, y(error) + 4, 'end', tickLabel(error)));
  for (const depth of ticks(low - margin, high + margin).values)
    plot.append(
        line('grid', x(depth), kTop, x(depth), kPlotHeight - kBottom),
        text(x(depth), kPlotHeight - kBottom + 16, 'middle', tickLabel(depth)));
  plot.append(text(
      (kLeft + kPlotWidth - kRight) / 2, kPlotHeight - 8, 'middle',
      'depth beneath the surface, mm'));
  plot.append(
      svg('text', {
        x: -(kTop + kPlotHeight - kBottom) / 2,
        y: 12,
        'text-anchor': 'middle',
        transform: 'rotate(-90)'
      },
          'expected error, mm'));
  for (const {name, depth, errors} of groups) {
    const median = share(errors, 0.5);
    plot.append(
        line('range', x(depth), y(errors[0]), x(depth), y(errors.at(-1))),
        line('most', x(depth), y(share(errors, 0.05)), x(depth), y(share(errors, 0.95))),
        svg('circle', {class: 'median', cx: x(depth), cy: y(median), r: 4},
            svg('title', {},
                `${name} mm deep: median ${number(median)} mm, ${number(errors[0])} to ${
                    number(errors.at(-1))} mm`)));
  }
  return plot;
}

function list(labels, targets) {
  const order = labels.map((_, i) => i)
                    .sort(
                        (a, b) => (labels[a].depth ?? Infinity) - (labels[b].depth ?? Infinity) ||
                            labels[a].id - labels[b].id);
  const made =
      table(['Id', 'Depth, mm', 'Status', 'Expected, mm', 'x, y, z, mm'], order.map((i) => {
        const {id, depth} = labels[i];
        const target = targets[i] && isPlaced(targets[i]) ? targets[i] : null;
        return [
          `${id}`, depth === null ? '–' : `${+ depth.toFixed(2)}`,
          beneathStatusCell(target?.status ?? unknownStatus), number(target?.error),
          target ? Array.from(target.centre, (v) => number(v, 1)).join(', ') : '–'
        ];
      }));
  made.className = 'followed places';
  return made;
}

/** Hidden where there is no target. select: shows the moment nearest to a frame in the list. */
export function showTargets({surface}) {
  if (!surface?.targets) return {select() {}};
  const {count, labels} = surface.targets;
  const moments = surface.moments;
  byId('targets').hidden = false;
  byId('targets-hint').textContent =
      'The plot shows the median expected error over depth, the middle 90 % (thick) and ' +
      'the range (thin) over the frames of this page.' +
      (labels.length < count ?
           ` ${labels.length} of ${count} targets are shown, evenly chosen; targets.csv has all.` :
           '');
  const groups = byDepth(labels, moments);
  byId('targets-plot')
      .replaceChildren(
          groups.length ? depthPlot(groups) :
                          element(
                              'p', {class: 'hint'},
                              'No target with a known depth has a position in any frame.'));
  const show = (moment) => {
    byId('targets-frame').textContent = `The list is of frame ${moment.frame}.`;
    byId('targets-list').replaceChildren(list(labels, moment.targets));
  };
  show(moments.findLast(({targets}) => targets.length) ?? moments[0]);
  return {
    select(frame) {
      show(moments.reduce(
          (a, b) => (Math.abs(b.frame - frame) < Math.abs(a.frame - frame) ? b : a)));
    },
  };
}
