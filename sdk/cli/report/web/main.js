// Puts the page together. When all of it stands, <html> carries data-ready; data-errors counts what went wrong.
import 'uplot/dist/uPlot.min.css';
import './report.css';
import { readData } from './data.js';
import { showPictures } from './pictures.js';
import { showPlots } from './plots.js';
import { showChanges, showLicences, showReading, showSummary } from './summary.js';
import { showSurface } from './surface.js';

const root = document.documentElement;
const failed = (reason) => {
  root.dataset.errors = Number(root.dataset.errors ?? 0) + 1;
  root.dataset.error = String(reason);
};
addEventListener('error', (event) => failed(event.message));
addEventListener('unhandledrejection', (event) => failed(event.reason));

const data = readData();
showSummary(data);
showChanges(data);
showReading();
showLicences(LICENCES);
showPictures(data.key_frames);
let surface;
const plots = showPlots(data, (frame) => surface?.select(frame));
showSurface(data, (frame) => plots.mark(frame)).then((shown) => {
  surface = shown;
  root.dataset.ready = 'true';
});
