// Plain words for states and stages.

import {stateWords} from '../../report/web/colours.js';
import {number} from '../../report/web/data.js';
import {reasonsInWords, remedyOf} from '../../report/web/reasons.js';

/** "4.2 s", "2 min 5 s". */
export function duration(ms) {
  if (ms < 60000) return `${(ms / 1000).toFixed(ms < 10000 ? 1 : 0)} s`;
  return `${Math.floor(ms / 60000)} min ${Math.floor((ms % 60000) / 1000)} s`;
}

/**
 * The header's. seen: share of the tissue; isHeld: less sure for the sake of a frame before, whose
 * reasons and doubts (see doubtsInWords) come with it; gapMs: without a picture before this one,
 * where that was an outage.
 */
export const readMoment = ([
  frame, ms, state, reasons, frameMs, seen, faultyViews, found, isHeld, heldReasons, doubts, gapMs
]) => ({
  frame,
  ms,
  state,
  reasons,
  frameMs,
  seen,
  faultyViews,
  found,
  isHeld,
  heldReasons,
  doubts,
  gapMs
});

/** word: the largest on the page. */
export const states = {
  connecting: {word: 'Connecting', say: 'Waiting for the first frame.'},
  initialising: {
    word: stateWords.initialising,
    say: 'Nothing is followed yet: waiting for a frame that shows the tissue well.'
  },
  tracking: {word: stateWords.tracking, say: 'The tissue is followed.'},
  degraded: {
    word: stateWords.degraded,
    say: 'The tissue is followed, but errors may be larger than usual.'
  },
  relocalised: {
    word: stateWords.relocalised,
    say: 'The tissue was lost, and is followed again. Compare one landmark by eye.'
  },
  // Said as relocalised, after an outage.
  resumed: {
    word: stateWords.relocalised,
    say: 'No new picture came for a while; the tissue is followed again. Compare one landmark by ' +
        'eye.'
  },
  found: {word: stateWords.found, say: 'The tissue is followed. Compare one landmark by eye.'},
  unfound:
      {word: stateWords.unfound, say: 'The tissue is looked for. Do not rely on any position.'},
  lost: {word: stateWords.lost, say: 'The tissue is not followed. Do not rely on any position.'},
  'given-up': {
    word: stateWords.lost,
    say: 'What was followed is given up, and a new template is being taken. Do not rely on any ' +
        'position.'
  },
  stalled: {
    word: 'No new picture',
    say:
        'No picture comes any more, and nothing here is current. What\u00a0to\u00a0do: check the ' +
        'camera, recorder and cables; close other programs on this computer.'
  },
  frozen: {
    word: 'No new picture',
    say: 'Nothing here is current: the video stands still. The same picture comes again and again.'
  },
  disconnected: {
    word: 'No connection',
    say: 'The program does not answer: it has ended, or the way to it is broken. Nothing here ' +
        'is current. What\u00a0to\u00a0do: use no position; look at the terminal of ' +
        'defrec track and at the network.'
  },
  refused: {
    word: 'No access',
    say:
        'This address belongs to another run. What\u00a0to\u00a0do: open the address that defrec ' +
        'track printed last.'
  },
  ended: {
    word: 'Ended',
    say: 'Nothing is followed any more. The outputs are being written: do not switch off yet.'
  },
  written: {
    word: 'Ended',
    say: 'Nothing is followed any more. The program has finished; report.html in its output ' +
        'folder sums up the run.'
  },
};

/** Whether positions of the frame are those of the tissue now. */
export const isFollowed =
    (state) => ['tracking', 'degraded', 'relocalised', 'found', 'unusable'].includes(state);

/** Whether these positions are measured well enough to be used. */
export const isUsable = (state) => isFollowed(state) && state !== 'unusable';

/** Whether tissue was to be followed and is not. */
export const isLost = (state) => ['lost', 'unfound', 'given-up'].includes(state);

/**
 * Text for a frame that is degraded, also a moment after tissue was found. Points with large
 * errors, or without a place, say nothing of the rest.
 */
export function lessSureInWords({reasons, heldReasons, doubts, found}) {
  const isOfPoints = doubts && !reasons && !heldReasons;
  if (!found) return isOfPoints ? states.tracking.say : states.degraded.say;
  return isOfPoints ? states[found].say : `${states[found].say} Errors may be larger than usual.`;
}

/** Text for frames that have repeated one for some time. */
export const repeatedInWords = (ms) =>
    `The same picture comes again: all positions are of the last new one, ${duration(ms)} ago.`;

/** In a frame that repeats the one before; one view that stands still is another thing. */
export function isFrozen(reasons) {
  const names = namesOf(reasons);
  return names.includes('frozen') && !names.includes('one-view');
}

/** Whether the left view shows what it did in the frame before, whatever the right one does. */
export function isLeftStill({reasons, faultyViews}) {
  const names = namesOf(reasons);
  // One that is black looks the same in each frame.
  if (isFrozen(reasons)) return !names.includes('dark') && !names.includes('saturated');
  return names.includes('frozen') ? faultyViews === 'right' :
                                    names.includes('view-late') && faultyViews === 'left';
}

/** The largest expected error of a usable point; shown_state.hpp has the same, and states why. */
export const kMostErrorMm = 3;

/** By the value as it is shown. */
export const isTooLarge = (error) => Number(number(error, 1)) > kMostErrorMm;

const kLeastSeen = 0.005;  // of the tissue: less is 0 % in words

/** seen: share of the tissue. */
export const isUnseen = (seen) => seen !== null && seen < kLeastSeen;

const isOneView = (reasons, faultyViews) =>
    namesOf(reasons).includes('one-view') || ['left', 'right'].includes(faultyViews);

/** {word, say} for state unusable. seen: share of the tissue. */
export function unusableInWords(reasons, seen, faultyViews) {
  if (isUnseen(seen) && isOneView(reasons, faultyViews))
    return {
      word: stateWords['one-view'],
      say: 'Do not use positions: one view does not measure depth.'
    };
  if (isUnseen(seen))
    return {word: stateWords.unseen, say: 'Do not use positions: they are not measured now.'};
  return {
    word: stateWords['large-errors'],
    say: `Do not use positions: all points have expected errors above ${kMostErrorMm} mm.`
  };
}

/** The state's word in a list of frames. */
export const wordOf = (state, reasons, seen, faultyViews) =>
    (state === 'unusable' ? unusableInWords(reasons, seen, faultyViews).word :
                            states[state]?.word ?? state);

/**
 * Text for a frame of which nothing is seen, for a moment. isTold: that one view alone does not.
 */
export const unseenInWords = (faultyViews, isTold) =>
    (isTold ? 'Do not rely on any position.' :
         faultyViews === 'right' ?
              'One view does not measure depth. Do not rely on any position.' :
              'Nothing of the tissue is seen now. Do not rely on any position.');

/** The reasons in words: pictures that are repeated are no video that stands still. */
export const whyInWords = (state, reasons, faultyViews) =>
    reasonsInWords(reasons, faultyViews)
        .map(
            (words) =>
                (isFrozen(reasons) && state !== 'stalled' && words === frozenInWords ?
                     'repeated pictures' :
                     words));

/** "P4, P5 and 2 more"; how(i): what follows a name. */
function listed([names, , count], how = () => '') {
  const words = names.map((name, i) => `${name}${how(i)}`), more = count - names.length;
  if (more > 0) return `${words.join(', ')} and ${more} more`;
  return [words.slice(0, -1).join(', '), words.at(-1)].filter(Boolean).join(' and ');
}

const isOne = ([, , count]) => count === 1;

/** "P4 has no place" */
const placeless = (named) => `${listed(named)} ${isOne(named) ? 'has' : 'have'} no place`;

/** Points that have gone since have no names. */
const removedInWords = (count) => (count ? ['points that are removed now'] : []);

/**
 * The doubts for a list that has those of many frames: words that stay from one frame to the next,
 * each of one point.
 */
function doubtsOfMany({large, targets, lost, never, removed}) {
  const each =
      ([names, , count],
       tell) => [...names, ...(count > names.length ? ['further points'] : [])].map(tell);
  return [
    ...each(large, (name) => `large expected error of ${name}`),
    ...(targets[2] ? ['large expected errors of targets'] : []),
    ...each(lost, (name) => `no place of ${name}`),
    ...each(never, (name) => `${name} not seen when given`), ...removedInWords(removed)
  ];
}

/**
 * Why points and targets make a frame less sure. doubts: the moment's, {large, targets, lost,
 * never}, [names, expected errors, count] each, and removed, the number of points that have gone
 * since; null: none. ofMany: see doubtsOfMany.
 */
export function doubtsInWords(doubts, ofMany) {
  if (!doubts) return [];
  if (ofMany) return doubtsOfMany(doubts);
  const {large, targets, lost, never, removed} = doubts, words = [];
  const errors = (named) => listed(named, (i) => ` \u00b1${number(named[1][i], 1)}\u00a0mm`);
  if (large[2]) words.push(errors(large));
  if (targets[2]) words.push(errors(targets));
  if (lost[2]) words.push(placeless(lost));
  if (never[2]) words.push(`${listed(never)} not seen when given`);
  words.push(...removedInWords(removed));
  return words;
}

/** What ends that points have no place, which they never had. */
export const endOfUnplaced = (isOfOne) => isOfOne ? 'click on it again, then remove the old one' :
                                                    'click on them again, then remove the old ones';

/** What to do about them, for the text of the banner; empty: nothing. */
export function doubtsToDo(doubts) {
  if (!doubts) return '';
  const {large, targets, never} = doubts, words = [];
  if (never[2]) {
    const many = never[2] > never[0].length ? `${never[2]} points have no place` : placeless(never);
    words.push(`${many}: ${endOfUnplaced(isOne(never))}.`);
  }
  const what = [[large, 'points'], [targets, 'targets']].filter(([named]) => named[2]);
  if (what.length)
    words.push(`Do not use ${what.map(([, name]) => name).join(' and ')} above \u00b1${
        kMostErrorMm}\u00a0mm.`);
  return words.join(' ');
}

// The doubts name the points.
const kOfPoints = 'point-error';

/** Why the state is what it is; never empty for one that is less sure. */
export function causesInWords({state, reasons, faultyViews, heldReasons, doubts}, ofMany) {
  const given = [reasons, heldReasons].filter(Boolean).join(',');
  const names = [...new Set(namesOf(given))].filter((name) => name !== kOfPoints || !doubts);
  const words = [
    ...(state === 'degraded' ? doubtsInWords(doubts, ofMany) : []),
    ...whyInWords(state, names.join(','), faultyViews)
  ];
  return state === 'degraded' && !words.length ? ['less is observed than usual'] : words;
}

const [frozenInWords] = reasonsInWords('frozen', '');

/** What to do; empty where nothing is known. */
export const whatToDo = (state, reasons, faultyViews) => remedyOf(
    isFrozen(reasons) && state !== 'stalled' ?
        namesOf(reasons).filter((name) => name !== 'frozen').join(',') :
        reasons,
    faultyViews, {isFollowed: isFollowed(state), isUnfound: state === 'unfound'});

const kNotOfOneView = 'only one view shows the tissue, which does not measure depth';

/** Whether words of whyNotPlaced() tell that. */
export const tellsOneView = (why) => why === kNotOfOneView;

/**
 * Why parts and targets have no place in a followed frame (docs/api/beneath.md, expected error), or
 * not as a whole. counts: {placed, partly, all}; reasons: the frame's; isGivenUp: their template.
 */
export function whyNotPlaced(counts, reasons, isGivenUp) {
  if (isGivenUp) return 'all places belong to a template that was given up';
  if (isFrozen(reasons)) return 'the same picture comes again, and nothing is measured in it';
  return counts.every(isUnknown) && namesOf(reasons).includes('one-view') ?
      kNotOfOneView :
      'too little is known here of the tissue above, or the expected error would be too large';
}

/** Words for the head of lists: what they show is not what the picture does. */
export const headOfLists = (isOfNow, isPaused) => !isOfNow ? 'Of the last picture, not of now' :
    isPaused                                               ? 'Now (the picture is paused)' :
                                                             '';

export const isUnknown = ({placed, partly}) => placed + partly === 0;

const amount = (count, name, what) =>
    (count ? [`${count} ${name}${count === 1 ? '' : 's'} ${what}`] : []);

/**
 * "1 part partly known, 2 targets not placed: too little ..."; empty where all have a place. named:
 * {part, target}, counts as of whyNotPlaced, as is isGivenUp.
 */
export function notPlacedInWords(named, reasons, isGivenUp) {
  const counts = Object.values(named);
  const what = Object.entries(named).flatMap(
      ([name, {placed, partly, all}]) =>
          [...amount(partly, name, 'partly known'),
           ...amount(all - placed - partly, name, 'not placed')]);
  if (!what.length) return '';
  const head = counts.every(isUnknown) ? 'Not placed' : what.join(', ');
  return `${head}: ${whyNotPlaced(counts, reasons, isGivenUp)}.`;
}

const namesOf = (reasons) => reasons.split(',').map((name) => name.trim());

const stages = {
  'upload': 'Copy in',
  'rectify': 'Straighten the pictures',
  'stereo': 'Measure depth',
  'orb': 'Find features',
  'match': 'Recognise features',
  'ransac': 'Leave out wrong ones',
  'lm coarse': 'Fit the surface, coarse',
  'align coarse': 'Compare pictures, coarse',
  'lm middle': 'Fit the surface',
  'align fine': 'Compare pictures, fine',
  'lm fine': 'Fit the surface, fine',
  'check': 'Check the fit',
  'align right': 'Check the right picture',
  'warp': 'Move the surface',
  'download': 'Copy out',
};

/** By status of a vertex or point: the page's only words for them. */
export const statusWords = ['seen', 'extrapolated', 'lost'];

export const stageInWords = (name) => stages[name] ?? name;
