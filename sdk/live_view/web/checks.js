// What the video and the calibration have wrong, in the words of `defrec doctor`.
import {byId, element} from '../../report/web/data.js';
import {fetchChecks} from './connection.js';

const marks = {
  error: {name: 'Problem', colour: '#dc2626'},
  warning: {name: 'Warning', colour: '#b45309'},
  unknown: {name: 'Unknown', colour: '#475569'},
  fine: {name: 'Fine', colour: '#15803d'},
};

const markOf = ({verdict, severity}) => (verdict === 'found' ? severity : verdict);

function item(finding) {
  const {name, colour} = marks[markOf(finding)];
  const result = element(
      'li', {'data-id': finding.id, 'data-mark': markOf(finding)},
      element('span', {class: 'chip', style: `--chip: ${colour}`}, name),
      element('div', {}, element('strong', {}, finding.title), `: ${finding.what}`));
  if (finding.remedy)
    result.lastChild.append(
        element('p', {}, element('span', {class: 'to-do'}, 'What to do: '), finding.remedy));
  return result;
}

const count = (number, name) => `${number} ${name}${number === 1 ? '' : 's'}`;

// What the pictures looked like at the start, of which the state tells the present.
const kOfPictures = ['exposure', 'black_frames', 'sharpness'];

/** "1 problem, 2 warnings", or that there are none. */
function summary(found) {
  const errors = found.filter(({severity}) => severity === 'error').length;
  const parts = [];
  if (errors) parts.push(count(errors, 'problem'));
  if (found.length > errors) parts.push(count(found.length - errors, 'warning'));
  return parts.join(', ') || 'nothing was found';
}

export class Checks {
  constructor() {
    this.isShown = this.wasFollowed = false;
    this.linked = [];  // findings
  }

  /** Fetches the findings once the header says that there are any. */
  async show({has_checks: hasChecks}, isFollowed) {
    if (isFollowed && !this.wasFollowed) {
      this.wasFollowed = true;
      this.link();
    }
    if (this.isShown || !hasChecks) return;
    const checks = await fetchChecks();
    if (!checks) return;
    this.isShown = true;
    const of = (verdict) => checks.findings.filter((finding) => finding.verdict === verdict);
    const found = of('found'), unknown = of('unknown'), fine = of('fine');
    byId('checks-state').textContent =
        `At the start (first ${checks.frames} frames): ${summary(found)}.`;
    byId('checks-found').replaceChildren(...found.map(item));
    byId('checks-others').replaceChildren(...[...unknown, ...fine].map(item));
    byId('checks-rest-title').textContent = `${fine.length} fine, ${unknown.length} unknown`;
    byId('checks-rest').hidden = false;
    this.linked = found;
    this.link();
    document.documentElement.dataset.found = found.map(({id}) => id).join(' ');
  }

  /** Tissue that is followed has shown that its pictures are good enough by now. */
  link() {
    const found = this.linked.filter(({id}) => !(this.wasFollowed && kOfPictures.includes(id)));
    byId('checks-link').hidden = found.length === 0;
    byId('checks-link').textContent = `${summary(found)} in video or calibration`;
  }

  /** The run has ended. */
  end() {
    if (this.isShown) return;
    byId('checks-state').textContent =
        'The run ended before its first frames were looked at; defrec doctor looks at them.';
  }
}
