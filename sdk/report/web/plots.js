// The plots over time, with one cursor.
import uPlot from 'uplot';
import {lineColours, stateColour, wordOfState} from './colours.js';
import {byId, element, number, paletteColour} from './data.js';
import {noPicture, withGaps} from './spans.js';

const shown = (digits, unit) => (_, value) =>
    (value === null ? '–' : `${number(value, digits)}${unit}`);

function axis(label) {
  return {
    ...(label && {label, labelSize: 22}),
    size: 56,
    font: '12px system-ui, sans-serif',
    labelFont: '12px system-ui, sans-serif',
    stroke: paletteColour('--muted'),
    grid: {stroke: paletteColour('--line'), width: 1},
    ticks: {stroke: paletteColour('--line'), width: 1, size: 4},
  };
}

/** Bands of the state's colour behind a plot. */
function stateBands(states, names) {
  return (plot) => {
    const {ctx, bbox} = plot;
    const times = plot.data[0];
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    for (let start = 0; start < states.length;) {
      let end = start + 1;
      while (end < states.length && states[end] === states[start]) ++end;
      const isGap = states[start] === null, name = names[states[start]] ?? 'other';
      const left = plot.valToPos(times[start], 'x', true);
      const right =
          end < times.length ? plot.valToPos(times[end], 'x', true) : bbox.left + bbox.width;
      ctx.globalAlpha = plot.stateStrip ? 1 : name === 'tracking' ? 0 : 0.16;
      ctx.fillStyle = isGap ? noPicture.colour : stateColour(name);
      ctx.fillRect(left, bbox.top, Math.max(1, right - left), bbox.height);
      start = end;
    }
    ctx.restore();
  };
}

export function showPlots({series: given, summary}, onSelect) {
  const series = withGaps(given, summary.gaps.listed);
  const line = (name) => series.lines.get(name) ?? [];
  const times = series.ms.map((ms) => ms / 1000);
  const states = line('state');
  const container = byId('plots');
  const engineers = byId('engineers'), engineerPlots = byId('engineer-plots');
  if (!times.length) {
    engineers.hidden = true;
    container.append(element('p', {class: 'hint'}, 'No frames.'));
    return {mark() {}};
  }
  if (series.stride > 1)
    byId('stride-note').textContent =
        `Each point stands for ${series.stride} frames and shows the worst of them.`;

  let plots = [];
  let marked = 0;
  const width = () => Math.max(300, container.clientWidth - 2);

  function plot(title, label, lines, {height = 150, strip = false, into = container} = {}) {
    const options = {
      title,
      width: width(),
      height,
      cursor: {sync: {key: 'time'}, points: {size: 6}},
      scales: {
        x: {time: false},
        y: strip ? {range: [0, 1]} :
                   {range: (_, low, high) => [Math.min(0, low), high > 0 ? high * 1.08 : 1]}
      },
      axes: [
        {...axis(''), size: 30, values: (_, ticks) => ticks.map((t) => `${+ t.toFixed(3)} s`)},
        strip ? {...axis(' '), values: () => [], grid: {show: false}, ticks: {show: false}} :
                axis(label),
      ],
      series: [
        {
          label: 'Frame',
          value: (_, value, __, i) =>
              (i === null || i === undefined ? '–' :
                                               `${series.frames[i] ?? '–'} (${number(value, 2)} s)`)
        },
        ...lines.map(({name, format}, i) => ({
                       label: name,
                       stroke: strip ? 'transparent' : lineColours[i % lineColours.length],
                       width: strip ? 0 : 1.6,
                       points: {show: !strip && times.length < 2},
                       value: format,
                     })),
      ],
      hooks: {
        init: [(u) => {
          u.stateStrip = strip;
        }],
        drawClear: [stateBands(states, summary.state_order)],
        draw: [(u) => {
          const x = u.valToPos(times[marked], 'x', true);
          if (x < u.bbox.left || x > u.bbox.left + u.bbox.width) return;
          u.ctx.fillStyle = paletteColour('--ink');
          u.ctx.fillRect(x - 1, u.bbox.top, 2, u.bbox.height);
        }],
      },
    };
    const made = new uPlot(options, [times, ...lines.map((l) => l.values)], into);
    let pressed = null;
    made.over.addEventListener('mousedown', (event) => {
      pressed = event.clientX;
    });
    made.over.addEventListener('click', (event) => {
      const index = made.cursor.idx;
      const frame = series.frames[index] ?? null;
      if (frame !== null && Math.abs(event.clientX - pressed) < 4) onSelect(frame);
    });
    plots.push(made);
  }

  function draw() {
    for (const each of plots) each.destroy();
    plots = [];
    container.replaceChildren();
    engineerPlots.replaceChildren();
    const stateName = (_, value, __, i) => {
      if (value !== null) return wordOfState(summary.state_order[value] ?? 'other');
      return i === null || i === undefined ? '–' : noPicture.word;
    };
    plot(
        'State', '', [{name: 'state', values: states, format: stateName}],
        {height: 66, strip: true});
    plot('Share of the surface that is seen', '%', [{
           name: 'seen',
           values: line('observed_share').map((v) => v === null ? null : 100 * v),
           format: shown(1, ' %')
         }]);
    if (series.lines.has('points_median_mm')) {
      plot('Expected error of the followed points', 'mm', [
        {name: 'median', values: line('points_median_mm'), format: shown(2, ' mm')},
        {name: 'largest', values: line('points_largest_mm'), format: shown(2, ' mm')}
      ]);
      plot(
          'Followed points that are lost', 'count',
          [{name: 'lost', values: line('points_lost'), format: shown(0, '')}], {height: 110});
    }
    if (engineers.open) drawForEngineers();
  }

  function drawForEngineers() {
    const into = engineerPlots;
    plot(
        'Residual', 'mm',
        [{name: 'mean residual', values: line('residual_mm'), format: shown(3, ' mm')}], {into});
    plot(
        'Features', 'count',
        ['features', 'matches', 'inliers'].map(
            (name) => ({name, values: line(name), format: shown(0, '')})),
        {into});
    const stages = [...series.lines.keys()].filter((name) => name.startsWith('stage '));
    const all = line('frame_ms').some((v) => v !== null) ?
        [{name: 'whole frame', values: line('frame_ms'), format: shown(2, ' ms')}] :
        [];
    plot(
        'Time per stage', 'ms',
        [
          ...all,
          ...stages.map(
              (name) => ({name: name.slice(6), values: line(name), format: shown(2, ' ms')}))
        ],
        {height: 210, into});
  }

  draw();
  engineers.addEventListener('toggle', () => {
    if (engineers.open && !engineerPlots.childElementCount) drawForEngineers();
  });
  let resized = 0;
  addEventListener('resize', () => {
    clearTimeout(resized);
    resized = setTimeout(
        () => plots.forEach((each) => each.setSize({width: width(), height: each.height})), 150);
  });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', draw);

  return {
    /** Puts the marker at the sample that holds this frame. */
    mark(frame) {
      const at = Math.max(0, series.frames.findLastIndex((of) => of !== null && of <= frame));
      if (at === marked) return;
      marked = at;
      for (const each of plots) each.redraw(false);
    },
  };
}
