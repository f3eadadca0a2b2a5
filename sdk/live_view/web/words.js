// Plain words for states and stages.

/** word: the largest on the page. */
export const states = {
  connecting: {word: 'Connecting', say: 'Waiting for the first frame.'},
  initialising: {
    word: 'Starting',
    say: 'Nothing is followed yet: waiting for a frame that shows the tissue well.'
  },
  tracking: {word: 'Tracking', say: 'The tissue is followed.'},
  degraded:
      {word: 'Less sure', say: 'The tissue is followed, but errors may be larger than usual.'},
  relocalised: {
    word: 'Found again',
    say: 'The tissue was lost, and is followed again. Compare one landmark by eye.'
  },
  found:
      {word: 'Found', say: 'The tissue of the template is followed. Compare one landmark by eye.'},
  unfound: {
    word: 'Not found yet',
    say: 'The tissue of the template is looked for. Do not rely on any position.'
  },
  lost: {word: 'Lost', say: 'The tissue is not followed. Do not rely on any position.'},
  stalled: {
    word: 'No new picture',
    say: 'Nothing here is current: the video stands still, or this computer is too slow.'
  },
  disconnected: {
    word: 'No connection',
    say: 'The program does not answer: it has ended, or the way to it is broken. Nothing here is ' +
        'current.'
  },
  refused: {word: 'No access', say: 'This address belongs to another run. Open the new one.'},
  ended: {word: 'Ended', say: 'The run has ended. Nothing is followed any more.'},
};

/** Whether positions of the frame are those of the tissue now. */
export const isFollowed =
    (state) => ['tracking', 'degraded', 'relocalised', 'found'].includes(state);

/**
 * Why parts and targets have no place in a followed frame (docs/api/beneath.md, expected error);
 * empty where all have one. counts: {placed, all}. reasons: the frame's.
 */
export function whyNotPlaced(counts, reasons) {
  const sum = (key) => counts.reduce((total, count) => total + count[key], 0);
  if (sum('placed') === sum('all')) return '';
  const hasOneView = reasons.split(',').map((name) => name.trim()).includes('one-view');
  return sum('placed') === 0 && hasOneView ?
      'only one view shows the tissue, so its depth is too uncertain to place what lies beneath' :
      'too little is known here of the tissue above, or the expected error would be too large';
}

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
