// Puts the plain page together, which has none of npm's packages: in place of the surface and the
// plots it says why they are missing.
import {byId, element, readData} from './data.js';
import {ready, watchErrors} from './health.js';
import {tellMoreOfLists} from './more.js';
import {showPictures} from './pictures.js';
import {showPoints} from './points.js';
import {showChanges, showReading, showSummary} from './summary.js';
import {showTargets} from './targets.js';

function leaveOut(section) {
  const why = 'Not in this report: this defrec was built without node, npm or the npm packages ' +
      'that draw it.';
  section.replaceChildren(section.querySelector('h2'), element('p', {class: 'note'}, why));
}

watchErrors();
const data = readData();
showSummary(data);
showChanges(data);
showReading();
showPictures(data.key_frames);
showTargets(data);
showPoints(data, 'points');
showPoints(data, 'plan');
tellMoreOfLists('.scroll');
leaveOut(byId('surface'));
leaveOut(byId('plots').closest('section'));
byId('licences').closest('details').remove();
ready();
