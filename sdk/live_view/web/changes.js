// The list of changes; a state that lasts has one row, with all reasons that were given in it.
import {byId, element, seconds} from '../../report/web/data.js';
import {colourOf} from './strip.js';
import {causesInWords, duration, wordOf} from './words.js';

const kMaxChanges = 600;

export class Changes {
  constructor() {
    this.rows = [];
    this.last = null;    // {state, seen, words, why}
    this.newest = null;  // moment
  }

  /** moment: see readMoment(). */
  add(moment) {
    const {frame, ms, state, seen, reasons, faultyViews, gapMs} = moment;
    if (gapMs > 0 && this.newest)
      this.put(
          'stalled', this.newest.frame, ms - gapMs, wordOf('stalled'),
          [`no picture came for ${duration(gapMs)}`]);
    this.newest = moment;
    this.put(
        state, frame, ms, wordOf(state, reasons, seen, faultyViews), causesInWords(moment, true));
  }

  /** No picture comes any more; the program says so. */
  addOutage() {
    if (this.newest && this.last?.state !== 'stalled')
      this.put('stalled', this.newest.frame, this.newest.ms, wordOf('stalled'), []);
  }

  put(state, frame, ms, word, words) {
    if (this.last?.state === state) {
      const {words: told, why} = this.last, before = told.size;
      for (const each of words) told.add(each);
      if (told.size > before) why.textContent = [...told].join('; ');
      return;
    }
    const chip = element('span', {class: 'chip', style: `--chip: ${colourOf(state)}`}, word);
    const why = element('span', {}, words.join('; '));
    this.last = {state, words: new Set(words), why};
    this.rows.unshift(element(
        'tr', {},
        ...[String(frame), seconds(ms), chip, why].map((cell) => element('td', {}, cell))));
    this.rows.length = Math.min(this.rows.length, kMaxChanges);
    const heads =
        ['Frame', 'Time', 'State', 'Why'].map((text) => element('th', {scope: 'col'}, text));
    byId('changes').replaceChildren(element(
        'table', {}, element('thead', {}, element('tr', {}, ...heads)),
        element('tbody', {}, ...this.rows)));
  }
}
