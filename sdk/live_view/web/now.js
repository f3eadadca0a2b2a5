// The numbers of now, the times of the stages, the recording.
import {byId, element, milliseconds, number, percent, seconds} from '../../report/web/data.js';
import {post} from './connection.js';
import {isFollowed, stageInWords} from './words.js';

/** Shows a frame. moment: see readMoment(). */
export function showNow(header, moment, shownPerSecond) {
  byId('sequence').textContent = header.sequence;
  byId('lead').textContent = `${header.device}; defrec ${header.version}`;
  // A surface that is not followed has neither residual nor a share that is seen; one of which
  // nothing is seen has no residual.
  const known = isFollowed(moment.state), measured = known && moment.seen > 0;
  const entries = [
    ['Tissue seen', known ? percent(moment.seen) : '–'], ['Frame', String(header.frame)],
    ['Time', seconds(header.timestamp_ms)], ['Time for a frame', milliseconds(moment.frameMs)],
    ['Pictures here', `${number(shownPerSecond, 0)} per s`]
  ];
  byId('residual').textContent =
      measured && header.residual_mm !== null ? `${number(header.residual_mm, 1)} mm` : '–';
  byId('cards').replaceChildren(...entries.map(
      ([name, value]) => element('div', {}, element('dt', {}, name), element('dd', {}, value))));
}

/** header.stages: [name, ms] in the order of execution; a stage that ran twice comes twice. */
export function showStages(stages) {
  const total = new Map();
  for (const [name, ms] of stages) total.set(name, (total.get(name) ?? 0) + ms);
  const longest = Math.max(...total.values(), Number.MIN_VALUE);
  byId('stages').replaceChildren(...[...total].map(([name, ms]) => {
    const bar = element('span', {class: 'bar'});
    bar.style.width = `${(100 * ms) / longest}%`;
    return element(
        'div', {'data-stage': name}, element('dt', {title: name}, stageInWords(name)),
        element('dd', {}, milliseconds(ms)), element('dd', {class: 'track'}, bar));
  }));
}

export function showRecording(name) {
  const button = byId('record');
  button.setAttribute('aria-pressed', name ? 'true' : 'false');
  button.textContent = name ? 'Stop recording' : 'Record';
  byId('recording').textContent = name;
}

const kMessageMs = 4000;
let messageTimer = null;

/** For a few seconds. */
export function tell(message) {
  byId('message').textContent = message;
  clearTimeout(messageTimer);
  messageTimer = setTimeout(() => {
    byId('message').textContent = '';
  }, kMessageMs);
}

/** A message that holds no more. */
export function untell(message) {
  if (message && byId('message').textContent === message) byId('message').textContent = '';
}

let messagesSeen = null;

/** The program's last, with its number; one that came before the page was opened is not told. */
export function showMessage(message) {
  if (messagesSeen !== null && message.number > messagesSeen) tell(message.text);
  messagesSeen = message.number;
}

/**
 * Asks the program, and says done where it does what it is asked for, else why not; returns whether
 * it does.
 */
export async function request(path, value, done) {
  const {isTaken, text} = await post(path, value);
  tell(isTaken ? done : text);
  return isTaken;
}

export function listenToRecord() {
  byId('record').addEventListener('click', () => {
    const isOn = byId('record').getAttribute('aria-pressed') === 'true';
    request(
        '/recording', {on: !isOn},
        isOn ? 'The recording ends with this picture.' :
               'The recording begins with the next picture.');
  });
}
