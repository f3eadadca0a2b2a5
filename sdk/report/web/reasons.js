// A frame's faults in plain words, and what to do.

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
  'contradicted': 'some of the tissue does not look as expected',
  'disparity': 'the disparity that was given is not that of the pictures',
};

const namesOf = (list) => list.split(',').map((name) => name.trim()).filter(Boolean);

/** The words for a list of names with commas between them. */
export const reasonsInWords = (names) =>
    namesOf(names).map((name) => reasons[name] ?? name.replaceAll('-', ' '));

// Remedies of somebody at the table; docs/api/errors.md has what the application can do.
const remedies = {
  'dark': 'check light, lens and cable',
  'saturated': 'check light and distance',
  'no-texture': 'look whether the lens is covered',
  'few-matches': 'move the camera back to where the tissue was last followed',
  'occluded': 'move the instrument aside',
  'large-residual': 'where it lasts, take a new template',
  'fast-motion': 'move more slowly',
  'out-of-view': 'move the camera back',
  'no-depth': 'check focus and distance',
  'one-view': 'check lens, cable and input of that view',
  'frozen': 'check the video source',
  'gap': 'check the video source',
  'views-swapped': 'exchange left and right',
  'low-contrast': 'clean the lens, let the smoke clear',
  'view-late': 'synchronise both views',
  'calibration': 'calibrate the cameras again',
  'coarse': 'use a faster computer or smaller pictures',
  'unchecked': 'use a faster computer or smaller pictures',
  'overdue': 'use a faster computer or smaller pictures',
  'interlaced': 'run again with --interlaced',
  'disparity': 'check the files of --disparity',
};

/** The remedy of the first of the reasons that has one; empty where none has. */
export const remedyOf = (names) => remedies[namesOf(names).find((name) => name in remedies)] ?? '';
