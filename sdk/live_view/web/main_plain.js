// The page without packages of npm: no 3D view and no plots.
import {byId} from '../../report/web/data.js';
import {watchErrors} from '../../report/web/health.js';
import {watch} from './watch.js';

watchErrors();
byId('no-surface').textContent = 'This build has no 3D view: it was made without node and npm.';
watch(null, null);
