// Plain words for states and stages.

import {stateWords} from '../../report/web/colours.js';

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
  found:
      {word: 'Found', say: 'The tissue of the template is followed. Compare one landmark by eye.'},
  unfound: {
    word: 'Not found yet',
    say: 'The tissue of the template is looked for. Do not rely on any position.'
  },
  lost: {word: stateWords.lost, say: 'The tissue is not followed. Do not rely on any position.'},
  'given-up': {
    word: stateWords.lost,
    say: 'What was followed is given up, and a new template is being taken. Do not rely on any ' +
        'position.'
  },
  stalled: {
    word: 'No new picture',
    say: 'Nothing here is current: the video stands still, or this computer is too slow.'
  },
  frozen: {
    word: 'No new picture',
    say: 'Nothing here is current: the video stands still. The same picture comes again and again.'
  },
  disconnected: {
    word: 'No connection',
    say: 'The program does not answer: it has ended, or the way to it is broken. Nothing here is ' +
        'current.'
  },
  refused: {word: 'No access', say: 'This address belongs to another run. Open the new one.'},
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
    (state) => ['tracking', 'degraded', 'relocalised', 'found'].includes(state);

/** Whether tissue was to be followed and is not. */
export const isLost = (state) => ['lost', 'unfound', 'given-up'].includes(state);

/** Text for a frame that is degraded a moment after tissue was found or found again. */
export const lessSureSince = (found) => `${states[found].say} Errors may be larger than usual.`;

/** In a frame that repeats the one before. */
export const isFrozen = (reasons) => namesOf(reasons).includes('frozen');

/** Texts for a followed frame that does not show the tissue. */
export const unseenInWords = {
  frozen: 'The same picture came again: nothing is known of the tissue now.',
  unmeasured: 'One view does not measure depth. Do not rely on any position.',
  unobserved: 'Nothing of the tissue is seen now. Do not rely on any position.'
};

/**
 * Why parts and targets have no place in a followed frame (docs/api/beneath.md, expected error), or
 * not as a whole. counts: {placed, partly, all}; reasons: the frame's; isGivenUp: their template.
 */
export function whyNotPlaced(counts, reasons, isGivenUp) {
  if (isGivenUp) return 'all places belong to a template that was given up';
  return counts.every(isUnknown) && namesOf(reasons).includes('one-view') ?
      'only one view shows the tissue, which does not measure depth' :
      'too little is known here of the tissue above, or the expected error would be too large';
}

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

export const stageInWords = (name) => stages[name] ?? name;
