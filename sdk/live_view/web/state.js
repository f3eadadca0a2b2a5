// The state: the largest thing on the page. It never says more than is known now: without new
// frames or a connection it says that.
import {byId, element, number, seconds} from '../../report/web/data.js';
import {stateColour} from '../../report/web/colours.js';
import {Fuse} from './fuse.js';
import {
  headOfLists,
  isFollowed,
  isFrozen,
  isLost,
  isUnknown,
  isUnseen,
  isUsable,
  kMostErrorMm,
  lessSureSince,
  states,
  unseenInWords,
  unusableInWords,
  whatToDo,
  whyInWords,
  whyNotPlaced,
  wordOf
} from './words.js';

const kStalledMs = 3000;  // without a frame
const kStripMoments = 240, kStripHeight = 16;
const kRepeatedMs = 200;  // for which pictures repeat one before that is told
const kCounts = ['state-points', 'state-beneath'];  // lines of the banner
const kMaxReasons = 2;                              // in the banner; the list of changes has all

/** "4.2 s", "2 min 5 s". */
export function duration(ms) {
  if (ms < 60000) return `${(ms / 1000).toFixed(ms < 10000 ? 1 : 0)} s`;
  return `${Math.floor(ms / 60000)} min ${Math.floor((ms % 60000) / 1000)} s`;
}

function setText(id, text) {
  if (byId(id).textContent !== text) byId(id).textContent = text;
}

/** For the strip and the list of changes: a video that stands still is as bad as being lost. */
const colourOf = (state) => stateColour(state === 'stalled' ? 'lost' : state);

/** Whether the state is that of a frame of now: not of a page without frames, or with old ones. */
export const isOfNow = (state) => isFollowed(state) || isLost(state) || state === 'initialising';

const share = (count, all, name) => `${count} of ${all} ${name}${all === 1 ? '' : 's'}`;
const ofAll = ({placed, all}, name) => share(placed, all, name);

/** ", errors up to 1.1 mm"; empty where nothing has a place. */
function errorsInWords(...counts) {
  const largest = Math.max(...counts.map((each) => each.largest));
  return largest < 0 ? '' : `, errors\u00a0up\u00a0to\u00a0${number(largest, 1)}\u00a0mm`;
}

/** Empty where there is none. */
function beneathInWords({targets, parts, planTargets}) {
  const ofPlan = [], placed = [], words = [];
  if (parts.partly) ofPlan.push(`${share(parts.partly, parts.all, 'part')} partly known`);
  if (parts.all && !(parts.partly && !parts.placed)) placed.push(ofAll(parts, 'part'));
  if (planTargets.all) placed.push(ofAll(planTargets, 'target'));
  if (placed.length) ofPlan.push(`${placed.join(', ')} placed`);
  if (ofPlan.length) words.push(`Plan: ${ofPlan.join(', ')}${errorsInWords(parts, planTargets)}`);
  if (targets.all) words.push(`${ofAll(targets, 'target')} placed${errorsInWords(targets)}`);
  return words.join('; ');
}

/**
 * Says what of the plan or the targets has no place at all: {what: "Plan not placed", why}; both
 * empty where something has.
 */
function unplaced({targets, parts, planTargets}, reasons, isGivenUp) {
  const isMissing = (counts) => counts.some(({all}) => all) && counts.every(isUnknown);
  const missing = [['Plan', [parts, planTargets]], ['Targets', [targets]]].filter(
      ([, counts]) => isMissing(counts));
  if (!missing.length) return {what: '', why: ''};
  const names = missing.map(([name]) => name).join(' and ').replace(' T', ' t');
  return {
    what: `${names} not placed`,
    why: whyNotPlaced(missing.flatMap(([, counts]) => counts), reasons, isGivenUp)
  };
}

/** "Points: 5 seen, 3 extrapolated, errors up to 0.4 mm"; empty without points. */
function pointsInWords(points) {
  const {all, seen, extrapolated} = points;
  const counts =
      [[seen, 'seen'], [extrapolated, 'extrapolated'], [all - seen - extrapolated, 'lost']];
  const words = counts.filter(([count]) => count).map(([count, word]) => `${count} ${word}`);
  return words.length ? `Points: ${words.join(', ')}${errorsInWords(points)}` : '';
}

/** A line of the banner, bold where not all are placed, or an error is large. */
function setCount(id, text, counts) {
  setText(id, text);
  const isGood =
      counts.every(({placed, all, largest}) => placed === all && largest <= kMostErrorMm);
  byId(id).style.fontWeight = isGood ? '400' : '800';
}

/**
 * " Why: ... What to do: ..." What is noticed of tissue that was found is not why it was; that a
 * video stands still has been said. Spaces in "What to do" do not end a line.
 */
function because(state, reasons, faultyViews) {
  const why = whyInWords(state, reasons, faultyViews).slice(0, kMaxReasons),
        remedy = whatToDo(state, reasons, faultyViews);
  const head = state === 'relocalised' || state === 'found' ? 'Noticed now' : 'Why';
  return (why.length && state !== 'stalled' ? ` ${head}: ${why.join('; ')}.` : '') +
      (remedy ? ` What\u00a0to\u00a0do: ${remedy}.` : '');
}

export class State {
  /** changed: called with the name of the state that is shown. */
  constructor(changed) {
    this.changed = changed;
    this.shown = 'connecting';
    this.of = 'connecting';  // of the newest frame, or why there is none
    this.reasons = this.faultyViews = this.found = '';
    this.isWritten = false;  // the outputs
    this.isPaused = false;   // the picture
    this.beneath = null;     // what the banner counts of targets and plan
    this.seen = null;        // share of the tissue
    this.largest = -1;       // expected error of points, mm
    this.frozenFrom = null;  // ms of the pictures, of the first that repeats the one before
    this.movedMs = null;     // likewise, of the last one that does not
    this.repeatsMs = 0;      // how long pictures have repeated that one
    this.moments = [];       // {state, ms}
    this.frameAt = null;     // when the newest frame came
    this.movedAt = null;     // when one came last that did not repeat the one before
    this.hasNone = false;    // the program's last answer was that there is no newer one
    this.since = performance.now();
    this.fuse = new Fuse(kStalledMs);
    this.timer = setInterval(() => this.tell(), 200);
    addEventListener('resize', () => this.drawStrip());
    // A heading that is scrolled to does not lie beneath what stays in sight.
    const sizes = new ResizeObserver(() => {
      const stays = ['state', 'state-word'].map(byId).find(
          (each) => getComputedStyle(each).position === 'sticky' && each.offsetHeight);
      document.documentElement.style.setProperty('--banner', `${stays?.offsetHeight ?? 0}px`);
    });
    for (const id of ['state', 'state-word']) sizes.observe(byId(id));
  }

  /**
   * moments: of the frames since the last call. followed: points, {all, seen, extrapolated,
   * largest} with the largest expected error, -1 where there is none; targets, parts and
   * planTargets, {all, placed, partly, largest} each; isGivenUp: their template. ageMs: of the
   * newest frame; old where the page was kept from taking it.
   */
  take(moments, followed, ageMs) {
    this.frameAt = performance.now() - ageMs;
    this.hasNone = false;
    for (const [, ms, state, reasons] of moments) {
      this.moments.push({state, ms});
      this.frozenFrom = isFrozen(reasons) ? this.frozenFrom ?? ms : null;
      if (this.frozenFrom === null) this.movedMs = ms;
      this.repeatsMs = ms - (this.movedMs ?? ms);
    }
    this.moments.splice(0, Math.max(0, this.moments.length - kStripMoments));
    const {points, isGivenUp, ...beneath} = followed;
    const now = moments.at(-1);
    if (now) {
      const [, ms, state, reasons, , seen, faultyViews, found] = now;
      [this.of, this.reasons, this.faultyViews, this.found] = [state, reasons, faultyViews, found];
      [this.seen, this.largest] = [seen, points.largest];
      this.movedAt = this.frameAt - (this.frozenFrom === null ? 0 : ms - this.frozenFrom);
    }
    setCount('state-points', pointsInWords(points), [{...points, placed: points.seen}]);
    [this.beneath, this.isGivenUp] = [beneath, isGivenUp];
    setCount('state-beneath', beneathInWords(beneath), Object.values(beneath));
    this.drawStrip();
    this.tell();
    if (isOfNow(this.shown)) this.fuse.light(ageMs);
  }

  /** Why there are no frames: disconnected, refused, ended. */
  stop(why) {
    this.of = why;
    this.reasons = this.faultyViews = '';
    for (const id of kCounts) setText(id, '');
    if (why !== 'disconnected') clearInterval(this.timer);
    this.tell();
  }

  /**
   * The program answers; what it says of a frame is taken at once, and else told a moment later.
   */
  resume() {
    if (this.of === 'disconnected') this.of = this.frameAt === null ? 'connecting' : 'stalled';
  }

  /** Whether the picture is held; the state goes on. */
  pause(on) {
    this.isPaused = on;
    this.tell();
  }

  /** The program answers that it has no newer frame. */
  silent() {
    this.hasNone = true;
    this.tell();
  }

  /** After the end, once the outputs are there. */
  finish() {
    this.isWritten = true;
    this.tell();
  }

  tell() {
    // A page that is hidden may be kept from taking frames: there the program's word counts.
    const isSilent = this.frameAt !== null && (this.hasNone || !document.hidden) &&
        performance.now() - this.frameAt > kStalledMs;
    const name = isSilent && isOfNow(this.of) ? 'stalled' : this.of;
    if (name !== this.shown) {
      this.shown = name;
      if (!isOfNow(name)) this.fuse.out();
      this.since = name === 'stalled' ? this.movedAt : performance.now();
      document.documentElement.dataset.state = name;
      document.body.classList.toggle('not-current', !isOfNow(name));
      for (const id of kCounts) byId(id).hidden = !isOfNow(name);
      this.changed(name);
    }
    const reasons = name === this.of && !isSilent ? this.reasons : '';
    const {word, say} = this.wordsOf(name, reasons);
    for (const id of ['state-word', 'picture-state']) setText(id, word);
    const {what, why} = name === this.of && isFollowed(name) && this.beneath ?
        unplaced(this.beneath, this.reasons, this.isGivenUp) :
        {what: '', why: ''};
    setText('unplaced', what);
    setText(
        'state-say',
        (what && isUsable(name) ? `${what}: ${why}. ` : '') +
            (this.isPaused ? say.replace('Compare', 'Press Go on, then compare') : say) +
            (name === 'tracking' ? '' : because(name, reasons, this.faultyViews)));
    this.tellPause(word);
    if (name !== 'ended' && name !== 'refused')
      setText('state-since', `for ${duration(performance.now() - this.since)}`);
    else
      setText('state-since', '');
  }

  tellPause(word) {
    setText('state-paused', this.isPaused ? 'Picture paused' : '');
    document.title = `${word}${this.isPaused ? ' · picture paused' : ''} – defrec`;
    document.body.classList.toggle('paused', this.isPaused);
    const head = headOfLists(isOfNow(this.shown), this.isPaused);
    for (const note of document.querySelectorAll('.of-before'))
      if (note.textContent !== head) note.textContent = head;
  }

  /** {word, say}; reasons: of the frame that has the state. */
  wordsOf(name, reasons) {
    if (name === 'ended' && this.isWritten) return states.written;
    if (name === 'stalled' && isFrozen(reasons)) return states.frozen;
    const words = states[name] ?? {word: name, say: ''};
    if (!isFollowed(name)) return words;
    if (name === 'unusable') return unusableInWords(reasons, this.seen, this.faultyViews);
    const say = (text) => ({...words, say: text});
    if (isFrozen(reasons))
      return this.repeatsMs < kRepeatedMs ?
          words :
          say(`The same picture came again: positions are ${duration(this.repeatsMs)} old.`);
    if (isUnseen(this.seen)) return say(unseenInWords(this.faultyViews));
    if (name !== 'degraded') return words;
    const less = this.found ? lessSureSince(this.found) : words.say;
    return say(
        this.largest > kMostErrorMm ? `${less} Do not use points above \u00b1${kMostErrorMm} mm.` :
                                      less);
  }

  drawStrip() {
    const canvas = byId('strip');
    const width = Math.max(1, Math.round(canvas.clientWidth));
    if (canvas.width !== width) canvas.width = width;
    canvas.height = kStripHeight;
    const context = canvas.getContext('2d');
    const step = width / kStripMoments, first = kStripMoments - this.moments.length;
    this.moments.forEach(({state}, i) => {
      context.fillStyle = colourOf(state);
      context.fillRect(Math.floor((first + i) * step), 0, Math.ceil(step), kStripHeight);
    });
    if (this.moments.length < 2) return;
    // The time is that of the pictures.
    const ago = this.moments.at(-1).ms - this.moments[0].ms;
    context.font = `bold ${kStripHeight - 3}px sans-serif`;
    context.textBaseline = 'middle';
    context.fillStyle = '#ffffff';
    const text = `${duration(ago)} ago`, left = Math.floor(first * step) + 8;
    if (ago > 0 && left + context.measureText(text).width < 0.8 * width)
      context.fillText(text, left, kStripHeight / 2);
    context.textAlign = 'right';
    context.fillText('now', width - 8, kStripHeight / 2);
  }
}

const kMaxChanges = 600;

/** The list of changes; a state that lasts has one row, with all reasons that were given in it. */
export class Changes {
  constructor() {
    this.rows = [];
    this.last = null;  // {state, seen, words, why}
  }

  add([frame, ms, state, reasons, , share, faultyViews]) {
    const seen = `${reasons} ${faultyViews}`;
    if (this.last?.state === state) {
      const {words, why, seen: before} = this.last;
      if (seen === before) return;
      this.last.seen = seen;
      for (const word of whyInWords(state, reasons, faultyViews)) words.add(word);
      why.textContent = [...words].join('; ');
      return;
    }
    const chip = element(
        'span', {class: 'chip', style: `--chip: ${colourOf(state)}`},
        wordOf(state, reasons, share, faultyViews));
    const words = new Set(whyInWords(state, reasons, faultyViews));
    const why = element('span', {}, [...words].join('; '));
    this.last = {state, seen, words, why};
    this.rows.unshift(element(
        'tr', {},
        ...[String(frame), seconds(ms), chip, why].map((cell) => element('td', {}, cell))));
    this.rows.length = Math.min(this.rows.length, kMaxChanges);
    const heads =
        ['Frame', 'Time', 'State', 'Why'].map((text) => element('th', {scope: 'col'}, text));
    byId('changes').replaceChildren(element(
        'table', {}, element('thead', {}, element('tr', {}, ...heads)),
        element('tbody', {}, ...this.rows)));
  }
}
