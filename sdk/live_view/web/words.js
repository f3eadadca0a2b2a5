// Plain words for states, reasons and stages.

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
  relocalised: {word: 'Found again', say: 'The tissue was lost, and is followed again.'},
  lost: {word: 'Lost', say: 'The tissue is not followed. Do not rely on any position.'},
  stalled: {word: 'No new picture', say: 'The program runs, but no frame comes from the video.'},
  disconnected: {
    word: 'No connection',
    say: 'The program does not answer: it has ended, or the way to it is broken. Nothing here is ' +
        'current.'
  },
  refused: {word: 'No access', say: 'This address belongs to another run. Open the new one.'},
  ended: {word: 'Ended', say: 'The run has ended. Nothing is followed any more.'},
};

/** Whether positions of the frame are those of the tissue now. */
export const isFollowed = (state) => ['tracking', 'degraded', 'relocalised'].includes(state);

// Plain words for DEFREC_REASON_*; docs/api/errors.md says what each does.
const reasons = {
  'dark': 'a picture is black',
  'saturated': 'a picture is white',
  'no-texture': 'the pictures show hardly any contrast',
  'few-matches': 'little of the tissue is recognised',
  'occluded': 'something lies in front of the tissue',
  'large-residual': 'the tissue changed its shape beyond what is modelled',
  'fast-motion': 'fast motion',
  'out-of-view': 'much of the tissue is out of the picture',
  'no-depth': 'too little depth is measured',
  'one-view': 'one of the two pictures is missing',
  'frozen': 'the picture stands still',
  'gap': 'frames are missing',
  'views-swapped': 'left and right look exchanged',
  'low-contrast': 'smoke, blur or a wet lens',
  'view-late': 'left and right picture are not of the same time',
  'calibration': 'the calibration does not fit the camera any more',
  'template-grew': 'tissue came into view and joined',
  'template-full': 'no further tissue can join',
  'coarse': 'not enough time to refine',
  'unchecked': 'not enough time to check',
  'overdue': 'too slow for its deadline',
  'cut': 'the tissue came apart',
  'piece-lost': 'a part of the tissue is not found',
  'interlaced': 'the video is interlaced',
  'contradicted': 'part of the tissue looks different where it should be',
};

/** The words for a list of names with commas between them. */
export const reasonsInWords = (names) =>
    names.split(',')
        .map((name) => name.trim())
        .filter(Boolean)
        .map((name) => reasons[name] ?? name.replaceAll('-', ' '));

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
