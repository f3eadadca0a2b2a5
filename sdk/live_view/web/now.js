// What is said in words: the state now, changes of state, points followed by click, the recording.
import {
  byId,
  element,
  milliseconds,
  number,
  percent,
  seconds,
  table
} from '../../report/web/data.js';
import {statuses} from '../../report/web/colours.js';
import {stateChip} from '../../report/web/summary.js';
import {post} from './connection.js';

const kMaxChanges = 200;

/** Shows a followed frame. moment: [frame, ms, state, reasons, frame_ms, observed_share] */
export function showNow(header, moment, shownPerSecond) {
  byId('sequence').textContent = header.sequence;
  byId('lead').textContent = `${header.device}; defrec ${header.version}`;
  const entries = [
    ['State', stateChip(moment[2])], ['Reasons', moment[3] || 'none'],
    ['Frame', String(header.frame)], ['Time', seconds(header.timestamp_ms)],
    ['Frame time', milliseconds(moment[4])], ['Observed', percent(moment[5])],
    ['Residual', `${number(header.residual_mm)} mm`],
    ['Shown', `${number(shownPerSecond, 0)} frames/s`]
  ];
  byId('cards').replaceChildren(...entries.map(
      ([name, value]) => element('div', {}, element('dt', {}, name), element('dd', {}, value))));
}

/** header.stages: [name, ms] in the order of execution; a stage that ran twice comes twice. */
export function showStages(stages) {
  const total = new Map();
  for (const [name, ms] of stages) total.set(name, (total.get(name) ?? 0) + ms);
  const longest = Math.max(...total.values(), Number.MIN_VALUE);
  byId('stages').replaceChildren(...[...total].flatMap(([name, ms]) => {
    const bar = element('span', {class: 'bar'});
    bar.style.width = `${(100 * ms) / longest}%`;
    return [
      element('dt', {}, name),
      element('dd', {}, element('span', {class: 'time'}, milliseconds(ms)), bar)
    ];
  }));
}

export class Changes {
  constructor() {
    this.rows = [];
    this.last = '';
  }

  add([frame, ms, state, reasons]) {
    const now = `${state}: ${reasons}`;
    if (now === this.last) return;
    this.last = now;
    this.rows.unshift([String(frame), seconds(ms), stateChip(state), reasons]);
    this.rows.length = Math.min(this.rows.length, kMaxChanges);
    byId('changes').replaceChildren(table(['Frame', 'Time', 'State', 'Reasons'], this.rows));
  }
}

export function showPoints(points, clicked) {
  const rows = points.filter(([id]) => clicked.has(id))
                   .map(
                       ([id, status, , , x, y, z, error]) =>
                           [String(id), statuses[status].name,
                            x === undefined ? '' : `${number(x)}, ${number(y)}, ${number(z)}`,
                            error === undefined ? '' : `${number(error)} mm`]);
  byId('points').replaceChildren(
      rows.length ? table(['Point', 'Status', 'x, y, z in mm', 'Expected error'], rows) :
                    element('p', {class: 'hint'}, 'None yet.'));
}

export function showRecording(name) {
  const button = byId('record');
  button.setAttribute('aria-pressed', name ? 'true' : 'false');
  button.textContent = name ? 'Stop recording' : 'Record';
  byId('recording').textContent = name;
}

/** Asks the program, and shows its answer for a few seconds. */
export async function request(path, value) {
  const answer = await post(path, value);
  byId('message').textContent = answer;
  setTimeout(() => {
    if (byId('message').textContent === answer) byId('message').textContent = '';
  }, 4000);
}

export function listenToRecord() {
  byId('record').addEventListener('click', () => {
    const isOn = byId('record').getAttribute('aria-pressed') === 'true';
    request('/recording', {on: !isOn});
  });
}
