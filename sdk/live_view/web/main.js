import 'uplot/dist/uPlot.min.css';
import '../../report/web/report.css';
import './live.css';
import {watchErrors} from '../../report/web/health.js';
import {showLicences} from '../../report/web/summary.js';
import {openSurface} from './surface.js';
import {Timeline} from './timeline.js';
import {watch} from './watch.js';

watchErrors();
showLicences(LICENCES);
watch(openSurface(), new Timeline());
