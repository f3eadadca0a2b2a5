// Colours of states and of vertex statuses; overlay_painter.cpp draws with the same.
export const stateColours = {
  tracking: '#15803d',
  relocalised: '#7c3aed',
  initialising: '#475569',
  degraded: '#b45309',
  lost: '#dc2626',
  // What is said in place of a state (shown_state.hpp).
  'found': '#7c3aed',
  'unfound': '#dc2626',
  'given-up': '#dc2626',
  'stalled': '#dc2626',
  'unusable': '#dc2626',
  'one-view': '#dc2626',
  'unseen': '#dc2626',
  'large-errors': '#dc2626',
};
export const stateColour = (state) => stateColours[state] ?? '#94a3b8';

// As every page and overlay says them; files have the names.
export const stateWords = {
  'initialising': 'Starting',
  'tracking': 'Tracking',
  'degraded': 'Less sure',
  'lost': 'Lost',
  'relocalised': 'Found again',
  'found': 'Found',
  'unfound': 'Not found yet',
  'given-up': 'Lost',
  'stalled': 'No new picture',
  'one-view': 'One view only',
  'unseen': 'Tissue not seen',
  'large-errors': 'Large errors',
};
export const wordOfState = (state) => stateWords[state] ?? (state || 'no state');

export const stateMeanings = {
  initialising: 'no template yet: nothing is followed',
  tracking: 'the surface is followed',
  degraded: 'followed, with less support than usual, or with an expected error above 3 mm of a ' +
      'chosen point: expect larger errors',
  lost: 'not followed: no geometry is handed out',
  relocalised: 'found again after having been lost; said for five seconds',
  found: 'found for the first time with a template of before; said for five seconds',
  unfound: 'with a template of before, which is not found yet: no geometry is handed out',
  stalled: 'the picture has stood still for half a second or longer: nothing is of that time',
  'one-view': 'one view does not measure depth: do not use positions',
  unseen: 'positions are not measured: do not use them',
  'large-errors': 'all points have expected errors above 3 mm: do not use them',
};

/** The state in the files where that has another name. */
export const statesInFiles = {
  degraded: 'degraded; tracking or relocalised where the error of a chosen point is the reason',
  found: 'relocalised, then tracking',
  relocalised: 'relocalised, then tracking',
  unfound: 'lost',
  stalled: 'any state with the reason frozen',
  'one-view': 'degraded with the reason one-view or view-late',
  unseen: 'tracking, degraded or relocalised',
  'large-errors': 'tracking, degraded or relocalised',
};

// Indexed by VertexStatus, as DEFREC_POINT_* of the C API. inFiles: what files call it.
export const statuses = [
  {
    name: 'seen',
    inFiles: 'observed, of a point tracked',
    colour: '#2dd4bf',
    meaning: 'seen in this frame, in depth and in the image'
  },
  {
    name: 'extrapolated',
    inFiles: 'extrapolated',
    colour: '#fbbf24',
    meaning: 'hidden, without data or not recognised: moved along by the model'
  },
  {
    name: 'lost',
    inFiles: 'unknown, of a point lost',
    colour: '#9ca3af',
    meaning: 'no claim is made about this place'
  },
];

/** Colours of a plan's parts, one after the other; plan_painter.cpp draws with the same. */
const kPartColours = ['#ec5cf6', '#5ae6a0', '#5ab4fa', '#fb8040', '#ff78b4', '#f0dc50'];
export const partColour = (part) => kPartColours[part % kPartColours.length];

/**
 * Tissue beneath the surface is not seen: it is placed by the motion of the surface, which is the
 * rule there, so that neither word nor colour are those of a warning. In the files it is
 * extrapolated.
 */
export const placedBeneath = {
  name: 'placed',
  colour: '#dbe4f0',
};

/** Features of the template that were recognised. */
export const matchColour = '#5aa0ff';

export const observedStatus = 0;
export const extrapolatedStatus = 1;
export const unknownStatus = 2;

// Dark blue to yellow, readable without red-green vision (a coarse table of the viridis map's
// course).
const ramp = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
export function rampColour(share) {
  const place = Math.min(Math.max(share, 0), 1) * (ramp.length - 1);
  const low = Math.min(Math.floor(place), ramp.length - 2);
  return ramp[low].map((c, i) => (c + (ramp[low + 1][i] - c) * (place - low)) / 255);
}
export const rampGradient = `linear-gradient(90deg, ${ramp.map((c) => `rgb(${c})`).join(', ')})`;

export const lineColours =
    ['#2563eb', '#d97706', '#16a05e', '#db2777', '#7c3aed', '#0891b2', '#84cc16', '#b45309'];
