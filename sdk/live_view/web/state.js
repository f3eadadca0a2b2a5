// The state: the largest thing on the page. It never says more than is known now: without new
// frames or a connection it says that.
import {byId, number} from '../../report/web/data.js';
import {Fuse} from './fuse.js';
import {Strip} from './strip.js';
import {
  causesInWords,
  doubtsToDo,
  duration,
  headOfLists,
  isFollowed,
  isFrozen,
  isLeftStill,
  isLost,
  isTooLarge,
  isUnknown,
  isUnseen,
  isUsable,
  lessSureInWords,
  repeatedInWords,
  states,
  tellsOneView,
  unseenInWords,
  unusableInWords,
  whatToDo,
  whyNotPlaced
} from './words.js';

const kStalledMs = 3000;  // without a frame, until the program says what is usual
const kRepeatedMs = 200;  // for which pictures repeat one before that is told
const kCounts = ['state-points', 'state-beneath'];  // lines of the banner
const kMaxReasons = 3;                              // in the banner; the list of changes has all

function setText(id, text) {
  if (byId(id).textContent !== text) byId(id).textContent = text;
}

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
function pointsInWords(points, isRepeated) {
  const {all, seen, extrapolated} = points;
  // They are not lost: a picture that is the last one again tells nothing of them.
  if (all && isRepeated && !(seen + extrapolated)) return 'Points: not of this picture';
  const counts =
      [[seen, 'seen'], [extrapolated, 'extrapolated'], [all - seen - extrapolated, 'lost']];
  const words = counts.filter(([count]) => count).map(([count, word]) => `${count} ${word}`);
  return words.length ? `Points: ${words.join(', ')}${errorsInWords(points)}` : '';
}

/** A line of the banner, bold where not all are placed, or an error is large. */
function setCount(id, text, counts) {
  setText(id, text);
  const isGood = counts.every(({placed, all, largest}) => placed === all && !isTooLarge(largest));
  byId(id).style.fontWeight = isGood ? '400' : '800';
}

/**
 * " Why: ... What to do: ..." What is noticed of tissue that was found is not why it was; that a
 * video stands still has been said. Spaces in "What to do" do not end a line.
 */
function because(state, moment) {
  const {reasons, heldReasons, faultyViews, isHeld} = moment;
  const why = causesInWords({...moment, state}, false).slice(0, kMaxReasons),
        remedy = whatToDo(state, reasons || heldReasons, faultyViews);
  const head = state === 'relocalised' || state === 'found' ? 'Noticed now' :
      isHeld                                                ? 'Why, a moment ago' :
                                                              'Why';
  return (why.length && state !== 'stalled' ? ` ${head}: ${why.join('; ')}.` : '') +
      (remedy ? ` What\u00a0to\u00a0do: ${remedy}.` : '');
}

const kNoMoment = {
  reasons: '',
  heldReasons: '',
  faultyViews: '',
  found: '',
  isHeld: false,
  doubts: null,
  seen: null
};

export class State {
  /** changed: called with the name of the state that is shown. */
  constructor(changed) {
    this.changed = changed;
    this.shown = 'connecting';
    this.of = 'connecting';   // of the newest frame, or why there is none
    this.moment = kNoMoment;  // of the newest frame, see readMoment()
    this.isWritten = false;   // the outputs
    this.isPaused = false;    // the picture
    this.beneath = null;      // what the banner counts of targets and plan
    this.frozenFrom = null;   // ms of the pictures, of the first that repeats the one before
    this.movedMs = null;      // likewise, of the last one that does not
    this.repeatsMs = 0;       // how long pictures have repeated that one
    this.stillFrom = null;    // as frozenFrom, of the left view alone
    this.stillMs = 0;         // for which it has stood still
    this.strip = new Strip();
    this.limitMs = kStalledMs;  // without a frame
    this.endedAt = null;
    this.frameAt = null;   // when the newest frame came
    this.movedAt = null;   // when one came last that did not repeat the one before
    this.hasNone = false;  // the program's last answer was that there is no newer one
    this.since = performance.now();
    this.fuse = new Fuse();
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
   * newest frame; old where the page was kept from taking it. limitMs: after which time without a
   * frame the source has stopped.
   */
  take(moments, followed, ageMs, limitMs) {
    this.limitMs = limitMs ?? kStalledMs;
    this.frameAt = performance.now() - ageMs;
    this.hasNone = false;
    for (const moment of moments) {
      const {ms, reasons} = moment;
      this.strip.add(moment);
      this.frozenFrom = isFrozen(reasons) ? this.frozenFrom ?? ms : null;
      if (this.frozenFrom === null) this.movedMs = ms;
      this.repeatsMs = ms - (this.movedMs ?? ms);
      this.stillFrom = isLeftStill(moment) ? this.stillFrom ?? ms : null;
      this.stillMs = ms - (this.stillFrom ?? ms);
    }
    const {points, isGivenUp, ...beneath} = followed;
    const now = moments.at(-1);
    if (now) {
      [this.moment, this.of] = [now, now.state];
      this.movedAt = this.frameAt - this.stillMs;
    }
    setCount(
        'state-points',
        // Pictures without tissue may be alike: what is lost is lost in all of them.
        pointsInWords(points, this.frozenFrom !== null && !isLost(this.of)),
        [{...points, placed: points.seen}]);
    [this.beneath, this.isGivenUp] = [beneath, isGivenUp];
    setCount('state-beneath', beneathInWords(beneath), Object.values(beneath));
    this.tell();
    if (isOfNow(this.shown)) this.fuse.light(ageMs, this.limitMs);
  }

  /** Why there are no frames: disconnected, refused, ended. */
  stop(why) {
    this.of = why;
    this.moment = kNoMoment;
    if (why === 'ended') this.endedAt = performance.now();
    for (const id of kCounts) setText(id, '');
    if (why === 'refused') clearInterval(this.timer);
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
        performance.now() - this.frameAt > this.limitMs;
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
    const moment = name === this.of && !isSilent ? this.moment : kNoMoment;
    const {what, why} = name === this.of && (isFollowed(name) || isLost(name)) && this.beneath ?
        unplaced(this.beneath, this.moment.reasons, this.isGivenUp) :
        {what: '', why: ''};
    const isToldWhy = what !== '' && isUsable(name);
    const {word, say} = this.wordsOf(name, moment, isToldWhy && tellsOneView(why));
    for (const id of ['state-word', 'picture-state']) setText(id, word);
    setText('unplaced', what);
    setText(
        'state-say',
        (isToldWhy ? `${what}: ${why}. ` : '') +
            (this.isPaused ? say.replace('Compare', 'Press Go on, then compare') : say) +
            (name === 'tracking' ? '' : because(name, moment)));
    this.drawStrip();
    this.tellPause(word);
    const isOver = name === 'ended' || name === 'refused';
    // Beside "Picture paused" it would be read as the time of that.
    const head = this.isPaused ? `${word} for` : 'for';
    setText('state-since', isOver ? '' : `${head} ${duration(performance.now() - this.since)}`);
  }

  tellPause(word) {
    setText('state-paused', this.isPaused ? 'Picture paused' : '');
    document.title = `${word}${this.isPaused ? ' · picture paused' : ''} – defrec`;
    document.body.classList.toggle('paused', this.isPaused);
    const head = headOfLists(isOfNow(this.shown), this.isPaused);
    for (const note of document.querySelectorAll('.of-before'))
      if (note.textContent !== head) note.textContent = head;
    setText('of-lists', head && `All lists: ${head[0].toLowerCase()}${head.slice(1)}`);
  }

  /**
   * {word, say}; moment: of the frame that has the state; isOneViewTold: that one view alone does
   * not measure depth.
   */
  wordsOf(name, moment, isOneViewTold) {
    const {reasons, faultyViews, seen, found, doubts} = moment;
    if (name === 'ended' && this.isWritten) return states.written;
    if (name === 'stalled' && isFrozen(reasons)) return states.frozen;
    const words = states[name] ?? {word: name, say: ''};
    if (!isFollowed(name)) return words;
    if (name === 'unusable') return unusableInWords(reasons, seen, faultyViews);
    const say = (text) => ({...words, say: text});
    if (isFrozen(reasons))
      return this.repeatsMs < kRepeatedMs ? words : say(repeatedInWords(this.repeatsMs));
    if (isUnseen(seen)) return say(unseenInWords(faultyViews, isOneViewTold));
    if (name === 'relocalised' && found === 'resumed') return say(states.resumed.say);
    if (name !== 'degraded') return words;
    return say([lessSureInWords(moment), doubtsToDo(doubts)].filter(Boolean).join(' '));
  }

  /** Whether the left view has shown the same picture for a moment. */
  isStill() {
    return this.stillMs >= kRepeatedMs;
  }

  /** Whether positions of the newest frame are measured. */
  isSeen() {
    return !isUnseen(this.moment.seen);
  }

  drawStrip() {
    const now = performance.now(), isOver = this.endedAt !== null;
    // Pictures that stand still come, and have the state of an outage themselves.
    const ageMs = this.frameAt === null ? 0 : (this.endedAt ?? now) - this.frameAt;
    this.strip.draw(
        ageMs > this.limitMs ? ageMs : 0, this.limitMs, isOver ? now - this.endedAt : null);
  }
}
