// A frame's faults in plain words, and what to do.

// Plain words for DEFREC_REASON_*; docs/api/errors.md says what each does. What explains others
// comes before them.
const reasons = {
  'dark': 'a picture is black',
  'saturated': 'a picture is white',
  'no-texture': 'the pictures show hardly any contrast',
  'one-view': 'one of the two pictures is missing',
  'frozen': 'the picture stands still',
  'views-swapped': 'left and right look exchanged',
  'disparity': 'the disparity that was given is not that of the pictures',
  'interlaced': 'the video is interlaced',
  'view-late': 'left and right picture are not of the same time',
  'calibration': 'rows of left and right do not fit the calibration',
  'low-contrast': 'smoke, blur, a wet or covered lens',
  'occluded': 'something lies in front of the tissue',
  'no-depth': 'too little depth is measured',
  'out-of-view': 'much of the tissue is out of the picture',
  'large-residual': 'the tissue changed its shape beyond what is modelled',
  'point-error': 'a chosen point has an expected error above 3 mm',
  'contradicted': 'some of the tissue does not look as expected',
  'cut': 'the tissue came apart',
  'piece-lost': 'a part of the tissue is not found',
  'few-matches': 'little of the tissue is recognised',
  'fast-motion': 'fast motion',
  'gap': 'frames are missing',
  'overdue': 'too slow for its deadline',
  'coarse': 'not enough time to refine',
  'unchecked': 'not enough time to check',
  'template-grew': 'tissue came into view and joined',
  'template-full': 'no further tissue can join',
};

// What a reason says of a picture that it is known to speak of.
const ofOne = {
  'dark': 'is black',
  'saturated': 'is white',
  'one-view': 'is missing',
  'frozen': 'stands still',
  'view-late': 'stands still',
};

// Remedies of somebody at the table; docs/api/errors.md has what the application can do.
const remedies = {
  'dark': 'check light, lens and cable',
  'saturated': 'check light and distance',
  'no-texture': 'look whether the lens is covered',
  'one-view': 'check lens, cable and input of that view',
  'frozen': 'check the video source',
  'views-swapped': 'exchange left and right',
  'disparity': 'check the files of --disparity',
  'interlaced': 'run again with --interlaced',
  'view-late': 'synchronise both views',
  'calibration': 'calibrate again, if both pictures are of one time',
  'low-contrast': 'clean the lens, let the smoke clear',
  'occluded': 'move it aside',
  'contradicted': 'look whether something lies on it',
  'no-depth': 'look whether something covers the tissue, check focus and distance',
  'out-of-view': 'move the camera back',
  'large-residual': 'where it lasts, take a new template',
  'few-matches': 'move the camera back to where the tissue was last followed',
  'fast-motion': 'move more slowly',
  'gap': 'check the video source',
  'overdue': 'use a faster computer or smaller pictures',
  'coarse': 'use a faster computer or smaller pictures',
  'unchecked': 'use a faster computer or smaller pictures',
};

const rank = Object.fromEntries(Object.keys(reasons).map((name, i) => [name, i]));

const namesOf = (list) => list.split(',')
                              .map((name) => name.trim())
                              .filter(Boolean)
                              .sort((a, b) => (rank[a] ?? Infinity) - (rank[b] ?? Infinity) || 0);

/** A picture that is black or white has no contrast, is missing, and does not move. */
function followsFromOthers(name, names) {
  if (!names.includes('dark') && !names.includes('saturated')) return false;
  return name === 'no-texture' || name === 'one-view' ||
      (name === 'frozen' && !names.includes('one-view'));
}

const otherOf = {
  left: 'right',
  right: 'left'
};

/** Which picture a reason speaks of: left, right, both; empty: not known. */
function pictureOf(name, names, faultyViews) {
  if (name === 'frozen' && names.includes('one-view')) return otherOf[faultyViews] ?? '';
  if (name === 'view-late' && names.includes('frozen')) return '';
  const isEither = faultyViews === 'both' && names.includes('dark') && names.includes('saturated');
  return isEither ? '' : faultyViews;
}

function told(name, picture) {
  const plain = {name, words: reasons[name] ?? name.replaceAll('-', ' '), remedy: remedies[name]};
  const isBlank = name === 'dark' || name === 'saturated';
  if (isBlank && picture === 'both')
    return {...plain, words: ofOne[name].replace('is', 'both pictures are')};
  if (!(name in ofOne) || !(picture in otherOf)) return plain;
  const standsStill = name === 'frozen' || name === 'view-late';
  return {
    name,
    words: `the ${picture} picture ${ofOne[name]}`,
    remedy: standsStill ? 'check that video input' : remedies['one-view']
  };
}

/** Each thing once. */
function tell(list, faultyViews) {
  const names = namesOf(list);
  return names.filter((name) => !followsFromOthers(name, names))
      .map((name) => told(name, pictureOf(name, names, faultyViews)));
}

/**
 * The words for a list of names with commas between them. faultyViews: left, right, both or empty,
 * as in frames.csv.
 */
export const reasonsInWords = (names, faultyViews) =>
    tell(names, faultyViews).map(({words}) => words);

/**
 * The remedy of the first of the reasons that has one; empty where none has. While tissue is
 * followed, few matches do no harm; where it is unfound it was never followed.
 */
export function remedyOf(names, faultyViews, {isFollowed, isUnfound}) {
  const found = tell(names, faultyViews)
                    .find(({name, remedy}) => remedy && !(isFollowed && name === 'few-matches'));
  return isUnfound && found?.name === 'few-matches' ?
      'see whether it is the tissue of the template' :
      found?.remedy ?? '';
}
