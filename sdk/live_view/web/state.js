// The state: the largest thing on the page. It never says more than is known now: without new
// frames or a connection it says that.
import {byId, element, number, seconds} from '../../report/web/data.js';
import {stateColour} from '../../report/web/colours.js';
import {reasonsInWords, remedyOf} from '../../report/web/reasons.js';
import {Fuse} from './fuse.js';
import {
  isFollowed,
  isFrozen,
  isLost,
  isUnknown,
  lessSureSince,
  states,
  unseenInWords,
  whyNotPlaced
} from './words.js';

const kStalledMs = 3000;  // without a frame
const kStripMoments = 240;
const kCounts = ['state-points', 'state-error', 'state-beneath'];  // lines of the banner
const kMaxReasons = 2;  // in the banner; the list of changes has all

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

/** Empty where there is none. */
function beneathInWords({targets, parts, planTargets}) {
  const ofPlan = [], placed = [], words = [];
  if (parts.partly) ofPlan.push(`${share(parts.partly, parts.all, 'part')} partly known`);
  if (parts.all && !(parts.partly && !parts.placed)) placed.push(ofAll(parts, 'part'));
  if (planTargets.all) placed.push(ofAll(planTargets, 'target'));
  if (placed.length) ofPlan.push(`${placed.join(', ')} placed`);
  if (ofPlan.length) words.push(`Plan: ${ofPlan.join(', ')}`);
  if (targets.all) words.push(`${ofAll(targets, 'target')} placed`);
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

/** "Points: 5 seen, 3 extrapolated"; empty without points. */
function pointsInWords({all, seen, extrapolated}) {
  const counts =
      [[seen, 'seen'], [extrapolated, 'extrapolated'], [all - seen - extrapolated, 'lost']];
  const words = counts.filter(([count]) => count).map(([count, word]) => `${count} ${word}`);
  return words.length ? `Points: ${words.join(', ')}` : '';
}

/** A line of the banner, bold where not all are placed. */
function setCount(id, text, counts) {
  setText(id, text);
  byId(id).style.fontWeight = counts.every(({placed, all}) => placed === all) ? '400' : '800';
}

/**
 * " Why: ... What to do: ..." What is noticed of tissue that was found is not why it was; that a
 * video stands still has been said. Spaces in "What to do" do not end a line.
 */
function because(state, reasons, faultyViews) {
  const why = reasonsInWords(reasons, faultyViews).slice(0, kMaxReasons),
        remedy = remedyOf(reasons, faultyViews, isFollowed(state));
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
    this.isWritten = false;     // the outputs
    this.beneath = null;        // what the banner counts of targets and plan
    this.isUnobserved = false;  // neither tissue nor points
    this.frozenFrom = null;     // ms of the pictures, of the first that repeats the one before
    this.moments = [];
    this.frameAt = null;   // when the newest frame came
    this.movedAt = null;   // when one came last that did not repeat the one before
    this.hasNone = false;  // the program's last answer was that there is no newer one
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
   * largest} with the largest expected error; targets, parts and planTargets, {all, placed, partly}
   * each; isGivenUp: their template. ageMs: of the newest frame; old where the page was kept from
   * taking it.
   */
  take(moments, followed, ageMs) {
    this.frameAt = performance.now() - ageMs;
    this.hasNone = false;
    for (const [, ms, state, reasons] of moments) {
      this.moments.push(state);
      this.frozenFrom = isFrozen(reasons) ? this.frozenFrom ?? ms : null;
    }
    this.moments.splice(0, Math.max(0, this.moments.length - kStripMoments));
    const {points, isGivenUp, ...beneath} = followed;
    const now = moments.at(-1);
    if (now) {
      const [, ms, state, reasons, , observed, faultyViews, found] = now;
      [this.of, this.reasons, this.faultyViews, this.found] = [state, reasons, faultyViews, found];
      this.isUnobserved = !observed && !points.seen && !points.extrapolated;
      this.movedAt = this.frameAt - (this.frozenFrom === null ? 0 : ms - this.frozenFrom);
    }
    setCount('state-points', pointsInWords(points), [{placed: points.seen, all: points.all}]);
    setText(
        'state-error',
        points.largest < 0 ? '' : `Largest expected error ${number(points.largest, 1)} mm`);
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
        (what && `${what}: ${why}. `) + say +
            (name === 'tracking' ? '' : because(name, reasons, this.faultyViews)));
    document.title = `${word} – defrec`;
    if (name !== 'ended' && name !== 'refused')
      setText('state-since', `for ${duration(performance.now() - this.since)}`);
    else
      setText('state-since', '');
  }

  /** {word, say}; reasons: of the frame that has the state. */
  wordsOf(name, reasons) {
    if (name === 'ended' && this.isWritten) return states.written;
    if (name === 'stalled' && isFrozen(reasons)) return states.frozen;
    const words = states[name] ?? {word: name, say: ''};
    if (!isFollowed(name)) return words;
    if (isFrozen(reasons)) return {...words, say: unseenInWords.frozen};
    if (this.isUnobserved) {
      const isSeenLeft = this.faultyViews === 'right';
      return {...words, say: unseenInWords[isSeenLeft ? 'unmeasured' : 'unobserved']};
    }
    return name === 'degraded' && this.found ? {...words, say: lessSureSince(this.found)} : words;
  }

  drawStrip() {
    const canvas = byId('strip');
    const width = Math.max(1, Math.round(canvas.clientWidth)), height = 10;
    if (canvas.width !== width) canvas.width = width;
    canvas.height = height;
    const context = canvas.getContext('2d');
    const step = width / kStripMoments;
    this.moments.forEach((state, i) => {
      const from = kStripMoments - this.moments.length + i;
      context.fillStyle = colourOf(state);
      context.fillRect(Math.floor(from * step), 0, Math.ceil(step), height);
    });
  }
}

const kMaxChanges = 600;

/** The list of changes; a state that lasts has one row, with all reasons that were given in it. */
export class Changes {
  constructor() {
    this.rows = [];
    this.last = null;  // {state, seen, words, why}
  }

  add([frame, ms, state, reasons, , , faultyViews]) {
    const seen = `${reasons} ${faultyViews}`;
    if (this.last?.state === state) {
      const {words, why, seen: before} = this.last;
      if (seen === before) return;
      this.last.seen = seen;
      for (const word of reasonsInWords(reasons, faultyViews)) words.add(word);
      why.textContent = [...words].join('; ');
      return;
    }
    const chip = element(
        'span', {class: 'chip', style: `--chip: ${colourOf(state)}`}, states[state]?.word ?? state);
    const words = new Set(reasonsInWords(reasons, faultyViews));
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
