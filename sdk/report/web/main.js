// Puts the page together.
import 'uplot/dist/uPlot.min.css';
import './report.css';
import {readData} from './data.js';
import {ready, watchErrors} from './health.js';
import {tellMoreOfLists} from './more.js';
import {showPictures} from './pictures.js';
import {showPoints} from './points.js';
import {showPlots} from './plots.js';
import {showChanges, showLicences, showReading, showSummary} from './summary.js';
import {showSurface} from './surface.js';
import {showTargets} from './targets.js';

watchErrors();
const data = readData();
showSummary(data);
showChanges(data);
showReading();
showLicences(LICENCES);
showPictures(data.key_frames);
let surface;
const plots = showPlots(data, (frame) => surface?.select(frame));
const targets = showTargets(data);
const points = showPoints(data, 'points');
const plan = showPoints(data, 'plan');
tellMoreOfLists('.scroll');
showSurface(data, (frame) => {
  plots.mark(frame);
  targets.select(frame);
  points.select(frame);
  plan.select(frame);
}).then((shown) => {
  surface = shown;
  ready();
});
