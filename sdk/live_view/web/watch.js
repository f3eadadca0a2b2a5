// Puts together what a page shows of each frame; surface and timeline are null where the packages
// that draw them are not inside.
import {extrapolatedStatus, observedStatus} from '../../report/web/colours.js';
import {byId} from '../../report/web/data.js';
import {ready} from '../../report/web/health.js';
import {Alarm} from './alarm.js';
import {Checks} from './checks.js';
import {waitForOutputs, watchFrames} from './connection.js';
import {tellMoreOfLists} from '../../report/web/more.js';
import {listenToRecord, showMessage, showNow, showRecording, showStages} from './now.js';
import {painted} from './pace.js';
import {Picture} from './picture.js';
import {partsKnown, readPlan, showPlanList} from './plan.js';
import {PointList, readPoints} from './points.js';
import {Changes} from './changes.js';
import {isOfNow, State} from './state.js';
import {largestError, placedTargets, readTargets, showTargetList} from './targets.js';
import {listenToFullScreen, Pause} from './tools.js';
import {duration, isFollowed, isLost, isUsable, notPlacedInWords, readMoment} from './words.js';

const kLateMs = 1000;  // a surface that is so far behind the picture beside it is shown as old

/** Says how old picture and surface are, and what stands in place of the surface. */
class AgeNotes {
  constructor(surface) {
    this.surface = surface;
    byId('show-surface-control').hidden = !surface;
    // When the picture came that is drawn, in 3D and beside it, for the first time.
    this.seenAt = this.pictureAt = null;
    this.held = null;         // while paused: {picture, surface}, whether each was one of now
    this.isHeld = false;      // no new picture is taken
    this.isStill = false;     // the left view shows what it did a moment ago
    this.isMeasured = false;  // positions of the newest frame
    this.isSurfaceNow = false;
    this.state = 'connecting';
    this.newestAt = null;    // as pictureAt, of the newest frame
    this.mostMs = Infinity;  // its age that is not told
    setInterval(() => this.tell(), 200);
  }

  /** state: that is shown. */
  watch(state) {
    this.state = state;
    this.tell();
  }

  pause(on) {
    const isOfVideo = isOfNow(this.state) && !this.isStill;
    // What is held stays marked until the next picture.
    if (on) this.held = {picture: isOfVideo, surface: this.isSurfaceNow};
    this.isHeld = on;
    this.tell();
  }

  measure(isStill, isMeasured) {
    [this.isStill, this.isMeasured] = [isStill, isMeasured];
    this.tell();
  }

  showPicture(at) {
    this.pictureAt = at;
    this.held = null;
    this.tell();
  }

  see(at) {
    this.seenAt = at;
    this.tell();
  }

  tellSurface() {
    const {held, seenAt} = this, wasSeen = seenAt !== null, behind = this.pictureAt - seenAt;
    const isUsed = isUsable(this.state) && this.isMeasured && !this.isStill;
    this.isSurfaceNow = wasSeen && (held ? held.surface : isUsed && behind < kLateMs);
    const stage = byId('surface').querySelector('.stage'), isStale = wasSeen && !this.isSurfaceNow;
    stage.classList.toggle('stale', isStale);
    stage.classList.toggle('held', held !== null && this.isSurfaceNow);
    this.surface?.dim(isStale);
    byId('last-seen').hidden = !wasSeen || (this.isSurfaceNow && !held);
    if (byId('last-seen').hidden) return;
    const age = `${duration(performance.now() - seenAt)} ago`;
    byId('last-seen').textContent = this.isSurfaceNow ? `PAUSED – ${age}` :
        isUsed && !held ? `3D is ${duration(behind)} behind` :
                          `Last seen ${age}`;
  }

  tell() {
    if (!this.isHeld && !isOfNow(this.state)) this.held = null;
    const {held, isStill} = this, isPaused = held !== null;
    const frame = byId('left').querySelector('.picture-frame');
    frame.classList.toggle('stale', isPaused ? !held.picture : isStill);
    frame.classList.toggle('held', isPaused);
    const ageMs = this.pictureAt === null ? 0 : performance.now() - this.pictureAt;
    const isOld = this.pictureAt !== null && !isPaused &&
        (!isOfNow(this.state) || isStill ||
         (this.state !== 'initialising' && performance.now() - this.newestAt > this.mostMs));
    byId('old-picture').hidden = !isOld;
    if (isOld) byId('old-picture').textContent = `Picture of ${duration(ageMs)} ago`;
    this.tellSurface();
    if (!this.surface) return;
    const wasSeen = this.seenAt !== null;
    byId('no-surface').hidden = wasSeen;
    const wasLost = isLost(this.state) && this.state !== 'unfound';
    byId('no-surface').textContent = wasLost ? 'Lost: there is no surface to show' :
        this.state === 'ended'               ? 'There was no surface' :
                                               'No surface yet';
  }
}

/** Red: it does not wait for the picture. */
const isRed = (state) => isLost(state) || state === 'unusable' || state === 'stalled';

/** What the banner counts: see State.take. */
function followed(header, chosen, shown, plan) {
  const {target_count: targets, targets_placed: targetsPlaced, is_given_up: isGivenUp} = header;
  return {
    points: {
      all: chosen.length,
      seen: chosen.filter(({status}) => status === observedStatus).length,
      extrapolated: chosen.filter(({status}) => status === extrapolatedStatus).length,
      largest: largestError(chosen)
    },
    targets: {all: targets, placed: targetsPlaced, partly: 0, largest: largestError(shown)},
    parts: partsKnown(plan?.parts ?? []),
    planTargets: {
      all: plan?.targetCount ?? 0,
      placed: plan?.targetsPlaced ?? 0,
      partly: 0,
      largest: largestError(plan?.targets ?? [])
    },
    isGivenUp
  };
}

export async function watch(surface, timeline) {
  const picture = new Picture(), changes = new Changes(), checks = new Checks();
  const list = new PointList(), alarm = new Alarm();
  const notes = new AgeNotes(surface);
  const pause = new Pause((on) => {
    notes.pause(on);
    state.pause(on);
    takePoints();
  }, () => notes.pictureAt);
  const state = new State((name) => {
    notes.watch(name);
    alarm.watch(name);
    takePoints();
    enable(!['disconnected', 'refused', 'ended'].includes(name));
  });
  const shown = [];  // times of the last frames, ms
  let newest = -1;   // moment
  listenToRecord();
  listenToFullScreen();
  tellMoreOfLists('.scroll, #lists');
  enable(false);

  // A click is on the tissue of now.
  function takePoints() {
    const isPaused = pause.isOn(), {shown: name} = state;
    const why = isPaused                        ? 'the picture is paused.' :
        isLost(name) || name === 'initialising' ? 'the tissue is not followed.' :
        name === 'ended'                        ? 'the run has ended.' :
        isFollowed(name)                        ? 'positions are not measured well enough now.' :
                                                  'the picture is not of now.';
    picture.take(isUsable(name) && state.isSeen() && !isPaused, `No point was added: ${why}`);
  }

  // While there is a program to ask.
  function enable(on) {
    for (const id of ['record', 'pause']) byId(id).disabled = !on;
    list.enable(on);
  }

  function rate() {
    shown.push(performance.now());
    if (shown.length > 60) shown.shift();
    return shown.length > 1 ? (1000 * (shown.length - 1)) / (shown.at(-1) - shown[0]) : NaN;
  }

  /** {left, overlay}; null while the picture is paused. */
  async function decode(sections) {
    if (pause.isOn()) return null;
    const [left, overlay] = await Promise.all([sections.left, sections.overlay].map(
        (jpeg) => jpeg && createImageBitmap(new Blob([jpeg], {type: 'image/jpeg'}))));
    return {left, overlay};
  }

  async function drawSurface({header, sections}, left, targets, plan) {
    const at = state.movedAt;
    // 3D waits for the screen, which never comes where the page is hidden.
    if (!surface || document.hidden || !isOfNow(state.of)) return;
    const withPlan = plan && byId('show-plan').checked, parts = withPlan ? plan.parts : [];
    const placed = placedTargets(
        [...(byId('show-targets').checked ? targets : []), ...(withPlan ? plan.targets : [])]);
    surface.showLegend(placed.length > 0, parts);
    if (!sections.xyz.byteLength) return;
    // What is not measured is no surface of now: that which was seen last stays.
    if (surface.isDue() && isUsable(state.of) && state.isSeen()) {
      await painted();  // what the page says of the frame does not wait for 3D
      if (!(await surface.show(header, sections, left, placed, parts))) return;
      notes.see(at);
      document.documentElement.dataset.surfaceFrame = header.frame;
    }
  }

  function showHeader(header, now, chosen) {
    if (now) showNow(header, now, rate());
    showStages(header.stages);
    picture.answer(header.dropped_clicks, chosen);
    showRecording(header.recording);
    showMessage(header.message);
  }

  /** What the page says of a frame, and its picture: all of it at once. */
  async function show(frame, ageMs) {
    const {header} = frame, cameAt = performance.now() - ageMs;
    const points = readPoints(header);
    const chosen = points.filter(({isChosen}) => isChosen);
    const moments = header.moments.map(readMoment).filter(({frame: index}) => index > newest);
    for (const moment of moments) changes.add(moment);
    if (moments.length) newest = moments.at(-1).frame;
    const targets = readTargets(header), plan = readPlan(header);
    const counts = followed(header, chosen, targets, plan);
    const now = moments.find(({frame: index}) => index === header.frame) ?? moments.at(-1);
    const isOfFollowed = isFollowed(now?.state);
    const tellAll = () => {
      state.take(moments, counts, performance.now() - cameAt, header.outage_ms);
      [notes.newestAt, notes.mostMs] = [state.movedAt, state.limitMs / 2];
      notes.measure(state.isStill(), state.isSeen());
      takePoints();
      showHeader(header, now, chosen);
      list.show(chosen, picture.takesPoints, new Set(isOfFollowed ? header.never_placed : []));
      const why = (of) =>
          (isOfFollowed ? notPlacedInWords(of, now.reasons, header.is_given_up) : '');
      showTargetList(targets, header.target_count, isOfFollowed, why({target: counts.targets}));
      showPlanList(plan, isOfFollowed, why({part: counts.parts, target: counts.planTargets}));
    };
    const isUrgent = isRed(moments.at(-1)?.state);
    if (isUrgent) tellAll();
    const bitmaps = await decode(frame.sections);
    if (!isUrgent) tellAll();
    timeline?.add(moments);
    if (bitmaps && !pause.isOn()) {
      picture.show(bitmaps, header, points, targets, plan);
      notes.showPicture(state.movedAt);
      await drawSurface(frame, bitmaps.left, targets, plan);
    }
    await checks.show(header, isOfFollowed);
    document.documentElement.dataset.frame = header.frame;
    document.documentElement.dataset.clicked = chosen.length;
  }

  const why = await watchFrames({
    options: () => ({overlay: byId('overlay').checked}),
    show,
    connected: () => {
      ready();
      state.resume();
    },
    silent: () => {
      state.silent();
      if (state.shown === 'stalled') changes.addOutage();
    },
    disconnected: () => state.stop('disconnected')
  });
  state.stop(why);
  if (pause.isOn()) pause.set(false);
  picture.end();
  showRecording('');
  checks.end();
  document.documentElement.dataset.ended = 'true';
  if (why !== 'ended') return;
  await waitForOutputs();
  state.finish();
}
