// The head of the page, the list of state changes, how to read it, and the licences.
import {
  extrapolatedStatus,
  placedBeneath,
  stateColour,
  stateMeanings,
  statesInFiles,
  statuses,
  unknownStatus,
  wordOfState
} from './colours.js';
import {byId, element, milliseconds, number, percent, seconds, table} from './data.js';
import {reasonsInWords} from './reasons.js';
import {gapsInWords, noPicture, usualStep, withGaps} from './spans.js';
import {svg} from './svg.js';

const chip = (word, colour) => element('span', {class: 'chip', style: `--chip: ${colour}`}, word);

export const stateChip = (state) => chip(wordOfState(state), stateColour(state));

/** Cell with a status, in the live view's words. */
export function statusCell(status, word = statuses[status].name) {
  const {colour} = statuses[status];
  return element(
      'span', {}, element('span', {class: 'swatch', style: `background: ${colour}`}), word);
}

/** Likewise of what lies beneath the surface; what has no place there is so in the live view. */
export function beneathStatusCell(status) {
  if (status === extrapolatedStatus) return element('span', {}, placedBeneath.name);
  return status === unknownStatus ? statusCell(status, 'not placed') : statusCell(status);
}

function card(name, value, unit, note) {
  const shown = element('dd', {}, value);
  if (unit) shown.append(element('small', {}, ` ${unit}`));
  const result = element('div', {}, element('dt', {}, name), shown);
  if (note) result.append(element('dd', {class: 'note-line'}, note));
  return result;
}

const followedStates = ['tracking', 'degraded', 'relocalised', 'found'];

function cards(summary) {
  const followed = framesIn(summary, ...followedStates), less = framesIn(summary, 'degraded');
  const of = (frames) => percent(frames / summary.frames);
  const result =
      [card('Frames', String(summary.frames), '', `${seconds(summary.duration_ms)} of video`)];
  if (summary.frames)
    result.push(card(
        'Followed', of(followed), '',
        less ? `of all frames: ${of(followed - less)} as usual, ${of(less)} less sure, with ` +
                'errors that may be larger' :
               'of all frames'));
  const time = summary.frame_ms;
  if (time) {
    result.push(card(
        'Speed', number(1000 / time.median, 1), 'frames/s',
        `${milliseconds(time.median)} a frame (median)`));
    result.push(card('Slowest', number(time.p99, 1), 'ms', '99 % of frames are faster'));
  }
  if (summary.observed_share)
    result.push(card(
        'Seen', percent(summary.observed_share.median), '',
        'of the surface (median); the rest is extrapolated or lost'));
  return result;
}

/** Frames with one of these states. */
const framesIn = (summary, ...states) => summary.states.filter(({name}) => states.includes(name))
                                             .reduce((sum, {frames}) => sum + frames, 0);

/** Runs of the same state, {state, frame, from, to}, ms; the state is null without a picture. */
function runsOf(series, end) {
  const states = series.lines.get('state') ?? [], runs = [];
  states.forEach((state, i) => {
    if (i > 0 && states[i - 1] === state) return;
    if (runs.length) runs.at(-1).to = series.ms[i];
    runs.push({state, frame: series.frames[i], from: series.ms[i], to: end});
  });
  return runs;
}

/** Lost ones are seen however short. */
const isLost = (name) => ['lost', 'unfound', 'given-up'].includes(name);

/** The states over time, from the first frame to the last. */
function stateBar(summary, given) {
  const series = withGaps(given, summary.gaps.listed);
  const begin = series.ms[0], end = series.ms.at(-1) + (usualStep(given.ms) || 1);
  const bar = svg('svg', {
    class: 'state-bar',
    viewBox: `0 0 ${end - begin} 1`,
    preserveAspectRatio: 'none',
    role: 'img',
    'aria-label': 'State over time'
  });
  const runs =
      runsOf(series, end).map((run) => ({
                                ...run,
                                name: run.state === null ? null : summary.state_order[run.state]
                              }));
  runs.forEach((run, i) => {
    run.until = runs.slice(i + 1).find(({frame}) => frame !== null)?.frame ?? 'the end';
  });
  for (const {name, frame, from, to, until} of
           [...runs.filter((run) => !isLost(run.name)),
            ...runs.filter((run) => isLost(run.name))]) {
    const width = isLost(name) ? Math.max(to - from, (end - begin) / 400) : to - from;
    const title = name === null ? `${noPicture.word}: ${seconds(from)} to ${seconds(to)}` :
                                  `${wordOfState(name ?? 'other')}: frame ${frame} to ${until}`;
    bar.append(
        svg('rect', {
          x: Math.min(from - begin, end - begin - width),
          y: 0,
          width,
          height: 1,
          fill: name === null ? noPicture.colour : stateColour(name)
        },
            svg('title', {}, title)));
  }
  return bar;
}

function stateLegend(summary) {
  const legend = element('ul', {class: 'share-legend'});
  const add = (...parts) => legend.append(element('li', {}, ...parts));
  // Two states may have the same word.
  const words = new Map();
  for (const state of summary.state_order) {
    const frames = framesIn(summary, state);
    const same = words.get(wordOfState(state));
    if (frames) words.set(wordOfState(state), {state, frames: frames + (same?.frames ?? 0)});
  }
  for (const {state, frames} of words.values())
    add(stateChip(state), ` ${frames} (${percent(frames / summary.frames)})`);
  if (summary.gaps.count)
    add(chip(noPicture.word, noPicture.colour), ` ${seconds(summary.gaps.total_ms)}`);
  return legend;
}

function facts(meta, summary) {
  const rows = [], residual = summary.residual_mm;
  if (meta.backend) rows.push(['Backend', meta.backend]);
  if (meta.device) rows.push(['Device', meta.device]);
  if (meta.version) rows.push(['defrec', meta.version]);
  rows.push(...meta.facts);
  if (residual)
    rows.push([
      'Mean residual',
      `${number(residual.median)} mm (median); 99 % below ${number(residual.p99)} mm`
    ]);
  const list = element('dl', {class: 'fact-list'});
  for (const [name, value] of rows) list.append(element('dt', {}, name), element('dd', {}, value));
  const parts = [list];
  if (summary.stages.length)
    parts.push(table(
        ['Stage', 'Median', '99th percentile'],
        summary.stages.map(
            (s) => [s.name, milliseconds(s.ms?.median ?? NaN), milliseconds(s.ms?.p99 ?? NaN)])));
  return parts;
}

const severityNames = {
  error: 'Do not rely on this',
  warning: 'Beware',
  remark: 'Note',
};

const kGapsSaid = 3;

/** "36 of 264 frames are lost and 4 not found yet" */
function lostInWords(summary) {
  const counts = [
    [framesIn(summary, 'lost', 'given-up'), 'lost'], [framesIn(summary, 'unfound'), 'not found yet']
  ].filter(([count]) => count);
  return counts
      .map(
          ([count, word], i) =>
              i ? `${count} ${word}` : `${count} of ${summary.frames} frames are ${word}`)
      .join(' and ');
}

/** {severity, text} of frames that are told of together: head, then where and why. */
function noteOf(severity, head, told) {
  const sentence = ({where, why}) => `${where[0].toUpperCase()}${where.slice(1)}: ${why}.`;
  return {severity, text: [head, ...told.map(sentence)].join(' ')};
}

/** What was lost, stood still or is less sure, then the notes, which come in their order. */
function notesOf(meta, summary) {
  const {frames} = summary, notes = [], gaps = gapsInWords(summary.gaps, kGapsSaid);
  const lost = framesIn(summary, 'lost', 'given-up', 'unfound');
  if (lost)
    notes.push(noteOf(
        2 * lost > frames ? 'error' : 'warning',
        `${lostInWords(summary)}: nothing is known of the tissue in them.`, summary.losses));
  if (gaps)
    notes.push(noteOf(
        'warning', `${gaps}: nothing is known of the tissue there. Check the video source.`, []));
  if (summary.frozen.length)
    notes.push(noteOf(
        'warning', 'Nothing is known of the tissue while the picture stands still.',
        summary.frozen));
  if (summary.unusable.length)
    notes.push(noteOf(
        'warning',
        `In ${framesIn(summary, 'one-view', 'unseen', 'large-errors')} of ${frames} frames ` +
            'positions are not to be used: they are not measured, or their errors are large.',
        summary.unusable));
  if (summary.degraded.length)
    notes.push(noteOf(
        'warning',
        `${framesIn(summary, 'degraded')} of ${frames} frames are less sure: errors may be ` +
            'larger in them.',
        summary.degraded));
  return [...notes, ...meta.notes];
}

export function showSummary({meta, summary, series}) {
  byId('sequence').textContent = meta.sequence || 'Unnamed sequence';
  document.title = `${meta.sequence || 'Sequence'} – tracking report`;
  byId('lead').textContent =
      `How the tissue surface moved and deformed, recovered from stereo video${
          meta.backend ? ` on the ${meta.backend} backend` : ''}.`;
  byId('notes').append(...notesOf(meta, summary)
                           .map(
                               ({severity, text}) => element(
                                   'li', {class: `note ${severity}`},
                                   element('strong', {}, `${severityNames[severity]}: `), text)));
  byId('cards').append(...cards(summary));
  if (summary.frames) byId('share').append(stateBar(summary, series), stateLegend(summary));
  byId('facts').append(...facts(meta, summary));
  if (meta.overlay_file)
    byId('video-link')
        .append(
            'All frames: ',
            element('a', {href: encodeURIComponent(meta.overlay_file)}, meta.overlay_file), '.');
  byId('made-by').textContent =
      `Written by defrec ${meta.version}. Not a medical device; for engineering use.`;
}

export function showChanges({summary}) {
  const rows = summary.changes.map(
      (c) =>
          [String(c.frame), seconds(c.ms), stateChip(c.state),
           reasonsInWords(c.reasons, c.faulty_views).join('; ') || '–']);
  byId('changes').append(
      rows.length ? table(['Frame', 'Time', 'State', 'Reasons'], rows) : 'No frames.');
  if (summary.unlisted_changes)
    byId('changes').append(element('p', {class: 'hint'}, `and ${summary.unlisted_changes} more`));
}

export function showReading() {
  const list = element('dl', {class: 'reading'});
  const add = (term, text) => list.append(element('dt', {}, term), element('dd', {}, text));
  for (const {name, inFiles, colour, meaning} of statuses)
    add(element(
            'span', {}, element('span', {class: 'swatch', style: `background: ${colour}`}), name),
        `${meaning}. In the files: ${inFiles}.`);
  for (const [state, meaning] of Object.entries(stateMeanings))
    add(stateChip(state), `${meaning}. In the files: ${statesInFiles[state] ?? state}.`);
  add(chip(noPicture.word, noPicture.colour),
      'For a second or longer none came: plots are empty there.');
  add('When frames are lost',
      'Do what the note at the top says; all reasons are under Changes of state. The tissue is ' +
          'found again once it is seen as it was in the template. Where that lasts, run defrec ' +
          'doctor on those frames, or take another template.');
  add('Units',
      'Lengths are millimetres in the left rectified camera (x right, y down, z ' +
          'away from it); times are milliseconds.');
  add('Mean residual',
      'Mean difference in depth between the deformed surface and what stereo measured ' +
          'in that frame, over the vertices whose depth agrees: how well the model fits, not how ' +
          'far it is from the truth.');
  add('Expected error',
      'The tracker\'s own estimate of how far a point may be off (root mean square).');
  add('Not placed',
      'A plan\'s part or a target of which no place is known: its tissue is lost, only one view ' +
          'shows it, or the expected error would be too large.');
  add('Followed point',
      'A point that was given with --points or by a click. Lost: no claim is made about it in ' +
          'that frame.');
  add('Error ellipsoid',
      'In which direction a followed point may be off: one standard deviation, enlarged as ' +
          'chosen.');
  add('Target',
      'A place beneath the surface that was given in the template\'s frame. A ring in ' +
          'the overlay is as wide as its expected error, dashed where it is placed by the motion ' +
          'of the surface.');
  add('Placed',
      'Beneath the surface, where no camera sees it: by the motion of the surface, within the ' +
          'expected error. In the files: extrapolated.');
  add('Deformation', 'Displacement from the template with the rigid motion taken out.');
  add('Overlay',
      'Grid: the surface\'s lines in the colours above. Blue: recognised details of the ' +
          'template, each from where it was. Dots: followed points in the colour of their ' +
          'status, in a ring as wide as their expected error, dashed where extrapolated; lost ' +
          'ones are not drawn. With --overlay-details also control points (crosses), refused ' +
          'matches (dark).');
  byId('reading').append(list);
}

export function showLicences(licences) {
  for (const {name, version, licence, text} of licences)
    byId('licences')
        .append(element('h3', {}, `${name} ${version} (${licence})`), element('pre', {}, text));
}
