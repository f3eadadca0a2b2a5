// The points that the user chose, or a plan's parts and targets: a list of them, their ways over
// the template's image, and of one the expected error and the displacement over time.
import {extrapolatedStatus, placedBeneath, statuses, unknownStatus} from './colours.js';
import {byId, element, number, percent} from './data.js';
import {isGapBetween, noPicture} from './spans.js';
import {beneathStatusCell, statusCell} from './summary.js';
import {svg, tickLabel, ticks} from './svg.js';

const kWidth = 460, kHeight = 170, kMargin = {
  left: 48,
  right: 12,
  top: 10,
  bottom: 34
};
const axisColours = ['#2563eb', '#d97706', '#16a05e'];
const lostColour = '#dc2626';

const nameOf = ({id, name}) => name || `${id}`;

/** "Point", or of a plan "Part" or "Target". The ids of parts are negative (points_of_plan). */
const kindOf = (section, {id}) => section === 'points' ? 'Point' : id < 0 ? 'Part' : 'Target';
const statusAt = (moment, i) => moment.status[i] ?? unknownStatus;
const colourOf = (section, status) => section === 'plan' && status === extrapolatedStatus ?
    placedBeneath.colour :
    statuses[status].colour;
const isKnown = (moment, i) => statusAt(moment, i) !== unknownStatus;

function errorAt(points, moment, i) {
  return isKnown(moment, i) ? moment.error[i] * points.error_step_mm : null;
}

/** The largest from this frame up to the next moment, mm; null where none is known. */
function largestErrorAt(points, moment, i) {
  return moment.largest[i] ? moment.largest[i] * points.error_step_mm : null;
}

/** Pixel of the left image, or null. */
function pixelAt(points, moment, i) {
  if (!isKnown(moment, i) || moment.uv[2 * i] === -32768) return null;
  return [moment.uv[2 * i] * points.pixel_step, moment.uv[2 * i + 1] * points.pixel_step];
}

/** Runs of the same status: {status, pixels}; the first of a run is the last of the one before. */
function runs(points, i) {
  const result = [];
  let last = null, before = null;
  for (const moment of points.moments) {
    if (before && isGapBetween(points.gaps, before.ms, moment.ms)) last = null;
    before = moment;
    const pixel = pixelAt(points, moment, i), status = statusAt(moment, i);
    if (!pixel) {
      last = null;
      continue;
    }
    if (!last || result.at(-1).status !== status) result.push({status, pixels: last ? [last] : []});
    result.at(-1).pixels.push(pixel);
    last = pixel;
  }
  return result;
}

class Map2d {
  constructor(data, points, section, onSelect) {
    const {surface, image: [width, height]} = data;
    this.section = section;
    this.points = points;
    this.unit = Math.max(width, 64) / 460;
    this.drawing = svg('svg', {
      class: 'ways',
      viewBox: `-0.5 -0.5 ${Math.max(width, 1)} ${Math.max(height, 1)}`,
      role: 'img',
      'aria-label': 'Ways of the followed points over the left image of the template'
    });
    if (surface?.texture)
      this.drawing.append(svg(
          'image',
          {href: `data:image/jpeg;base64,${surface.texture}`, x: -0.5, y: -0.5, width, height}));
    this.marks = svg('g', {});
    this.ways = points.listed.map((point, i) => {
      const way =
          svg('g', {class: 'way'}, svg('title', {}, `${kindOf(section, point)} ${nameOf(point)}`));
      for (const {status, pixels} of runs(points, i)) {
        const line = pixels.map((pixel) => pixel.join(',')).join(' ');
        for (const [colour, thick] of [['#0f172a', 3], [colourOf(section, status), 1.4]])
          way.append(svg('polyline', {
            points: line,
            fill: 'none',
            stroke: colour,
            'stroke-width': thick * this.unit,
            'stroke-linejoin': 'round'
          }));
      }
      way.addEventListener('click', () => onSelect(i));
      return way;
    });
    this.drawing.append(...this.ways, this.marks);
  }

  /** The places in a moment, with a ring around the one that is selected. */
  show(moment, selected) {
    const shown = [];
    this.points.listed.forEach((_, i) => {
      const pixel = pixelAt(this.points, moment, i);
      if (!pixel) return;
      const [cx, cy] = pixel, fill = colourOf(this.section, statusAt(moment, i));
      shown.push(svg(
          'circle',
          {cx, cy, r: 2.6 * this.unit, fill, stroke: '#0f172a', 'stroke-width': 0.8 * this.unit}));
      if (i === selected)
        shown.push(svg('circle', {
          cx,
          cy,
          r: 8 * this.unit,
          fill: 'none',
          stroke: '#ffffff',
          'stroke-width': 1.6 * this.unit
        }));
    });
    this.marks.replaceChildren(...shown);
    this.ways.forEach((way, i) => way.classList.toggle('selected', i === selected));
  }
}

/** Where a point is lost or no picture came: {from, to, colour}, s; end: of the plot. */
function bands(points, i, end) {
  const result = [], {moments} = points, first = points.listed[i].first_frame;
  const gaps =
      points.gaps.map(({from_ms: from, to_ms: to}) => ({from: from / 1000, to: to / 1000}));
  moments.forEach((moment, at) => {
    if (isKnown(moment, i) || moment.frame < first) return;
    const from = moment.ms / 1000, next = moments[at + 1];
    const until = next ? next.ms / 1000 : from + (end - moments[0].ms / 1000) / moments.length;
    const gap = gaps.find((each) => each.from >= from && each.from < until);
    result.push({from, to: gap?.from ?? until, colour: lostColour});
  });
  return [...result, ...gaps.map((gap) => ({...gap, colour: noPicture.colour}))];
}

/** lines: [{name, colour, values}], a value of each moment, null where there is none. */
function timePlot(points, title, lines, i, marked) {
  const {left, right, top, bottom} = kMargin;
  const times = points.moments.map(({ms}) => ms / 1000);
  const all = lines.flatMap(({values}) => values.filter((value) => value !== null));
  const low = Math.min(0, ...all), high = Math.max(0, ...all) || 1;
  const pad = 0.06 * (high - low);
  const begin = times[0], end = times.at(-1) > begin ? times.at(-1) : begin + 1;
  const x = (time) => left + ((time - begin) / (end - begin)) * (kWidth - left - right);
  const y = (value) => kHeight - bottom -
      ((value - low + (low < 0 ? pad : 0)) / (high - low + (low < 0 ? 2 : 1) * pad)) *
          (kHeight - top - bottom);
  const plot = svg(
      'svg',
      {class: 'depth-plot', viewBox: `0 0 ${kWidth} ${kHeight}`, role: 'img', 'aria-label': title});
  const text = (at, from, anchor, label) =>
      svg('text', {x: at, y: from, 'text-anchor': anchor}, label);
  plot.append(
      ...bands(points, i, end).map(({from, to, colour}) => svg('rect', {
                                     x: x(from),
                                     y: top,
                                     width: Math.max(1, Math.min(x(to), kWidth - right) - x(from)),
                                     height: kHeight - top - bottom,
                                     fill: colour,
                                     opacity: 0.22
                                   })));
  for (const value of ticks(low, high).values)
    plot.append(
        svg('line', {class: 'grid', x1: left, y1: y(value), x2: kWidth - right, y2: y(value)}),
        text(left - 6, y(value) + 4, 'end', tickLabel(value)));
  for (const time of ticks(begin, end).values)
    plot.append(text(x(time), kHeight - bottom + 15, 'middle', `${tickLabel(time)} s`));
  for (const {colour, values} of lines) {
    let path = '';
    values.forEach((value, at) => {
      if (value === null) return;
      const isBroken = at === 0 || values[at - 1] === null ||
          isGapBetween(points.gaps, points.moments[at - 1].ms, points.moments[at].ms);
      path += `${isBroken ? 'M' : 'L'}${x(times[at])} ${y(value)}`;
    });
    plot.append(svg('path', {d: path, fill: 'none', stroke: colour, 'stroke-width': 1.6}));
  }
  plot.append(svg('line', {
    class: 'marker',
    x1: x(times[marked]),
    x2: x(times[marked]),
    y1: top,
    y2: kHeight - bottom
  }));
  const key = element(
      'figcaption', {}, `${title} `,
      ...(lines.length > 1 ?
              lines.map(
                  ({name, colour}) => element(
                      'span', {class: 'key'},
                      element('span', {class: 'swatch', style: `background: ${colour}`}), name)) :
              []));
  return element('figure', {}, key, plot);
}

/** Displacement from where the point was first found, mm, an array for each axis. */
function displacements(points, i) {
  const first = points.moments.find((moment) => isKnown(moment, i));
  return [0, 1, 2].map(
      (axis) => points.moments.map(
          (moment) =>
              (isKnown(moment, i) ? moment.xyz[3 * i + axis] - first.xyz[3 * i + axis] : null)));
}

function detail(points, i, marked, kind) {
  const error = points.moments.map((moment) => largestErrorAt(points, moment, i));
  const names = ['x', 'y', 'z'];
  return [
    element('h3', {}, `${kind} ${nameOf(points.listed[i])}`),
    timePlot(
        points,
        points.stride > 1 ? `Expected error, mm: the largest of each ${points.stride} frames` :
                            'Expected error, mm',
        [{name: 'error', colour: axisColours[0], values: error}], i, marked),
    timePlot(
        points, 'Displacement in the camera, mm',
        displacements(points, i).map(
            (values, axis) => ({name: names[axis], colour: axisColours[axis], values})),
        i, marked)
  ];
}

const kHints = {
  points:
      'Select a point in the list or its way in the picture. Colours are those of the status; ' +
      'red bands: lost; grey bands: no picture.',
  plan:
      'The middles of the parts that have a name, and the targets by name or number; errors are ' +
      'those of registration and tracking together. All of it lies beneath the surface, where no ' +
      'camera sees it: it is placed by the motion of the surface, within the expected error. ' +
      'Red bands: not placed; grey bands: no picture. A part that is known in part has no ' +
      'middle; pictures show what is known of it.'
};
const kHeads = {
  points: 'Point',
  plan: 'Part or target'
};
const kErrorHeads = ['Status', 'Expected error, mm', 'Median, mm', 'Largest, mm'];
// A soft hyphen, for narrow columns.
const kShareHeads = {
  points: ['Seen', 'Extra\u00adpolated', 'Lost'],
  plan: ['Placed', 'Not placed']
};
/** frames: with each status. */
const sharesOf = (section, [seen, extrapolated, lost]) =>
    section === 'plan' ? [seen + extrapolated, lost] : [seen, extrapolated, lost];
const headsOf = (section) => [kHeads[section], ...kErrorHeads, ...kShareHeads[section]];

function pointRow(points, section, i, moment, selected, onSelect) {
  const point = points.listed[i];
  const all = point.frames.reduce((sum, count) => sum + count, 0) || 1;
  const button = element('button', {type: 'button', class: 'link'}, nameOf(point));
  button.addEventListener('click', () => onSelect(i));
  const statusCellOf = section === 'plan' ? beneathStatusCell : statusCell;
  const cells = [
    button, statusCellOf(statusAt(moment, i)), number(errorAt(points, moment, i)),
    number(point.median_mm), number(point.median_mm === null ? null : point.largest_mm),
    ...sharesOf(section, point.frames).map((count) => percent(count / all))
  ];
  // Each cell shows its head where there is no room for columns.
  const heads = headsOf(section);
  const row =
      element('tr', {}, ...cells.map((cell, k) => element('td', {'data-head': heads[k]}, cell)));
  if (i === selected) row.setAttribute('aria-selected', 'true');
  return row;
}

/**
 * section: points or plan. Hidden where there are none. select: shows the moment nearest to a
 * frame.
 */
export function showPoints(data, section) {
  if (!data[section]) return {select() {}};
  const points = {...data[section], gaps: data.summary.gaps.listed};
  byId(section).hidden = false;
  byId(`${section}-hint`).textContent = kHints[section] +
      (points.listed.length < points.count ?
           ` ${points.listed.length} of ${points.count} are shown, evenly chosen; ${
               section}.csv has all.` :
           '');
  // The first that has a place.
  let selected = Math.max(0, points.listed.findIndex(({median_mm: median}) => median !== null)),
      marked = points.moments.length - 1;
  const map = new Map2d(data, points, section, (i) => {
    selected = i;
    draw();
  });
  byId(`${section}-map`).replaceChildren(map.drawing);
  function draw() {
    const moment = points.moments[marked];
    byId(`${section}-frame`).textContent =
        `Picture, status and expected error are of frame ${moment.frame}, the other columns of ` +
        'all frames.';
    map.show(moment, selected);
    const rows =
        points.listed.map((_, i) => pointRow(points, section, i, moment, selected, (chosen) => {
                            selected = chosen;
                            draw();
                          }));
    const heads = headsOf(section).map((text) => element('th', {scope: 'col'}, text));
    byId(`${section}-list`)
        .replaceChildren(element(
            'table', {class: 'followed'}, element('thead', {}, element('tr', {}, ...heads)),
            element('tbody', {}, ...rows)));
    byId(`${section}-detail`)
        .replaceChildren(
            ...detail(points, selected, marked, kindOf(section, points.listed[selected])));
  }
  draw();
  return {
    select(frame) {
      const distance = ({frame: of}) => Math.abs(of - frame);
      marked = points.moments.reduce(
          (best, moment, at) => (distance(moment) < distance(points.moments[best]) ? at : best), 0);
      draw();
    },
  };
}
