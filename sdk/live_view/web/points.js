// The points that users chose: their list, in which they are named and removed.
import {byId, element, number} from '../../report/web/data.js';
import {statusCell} from '../../report/web/summary.js';
import {request, tell} from './now.js';
import {errorCell, hasPlace} from './targets.js';
import {endOfUnplaced, statusWords} from './words.js';

const kMaxListed = 100;
const kMaxName = 80;  // bytes; live_view.cpp refuses more
const kAskMs = 4000;  // for which a button asks whether a point is to be removed

/** The header's; a lost one has neither pixel nor place. */
export const readPoints = ({points}) => points.map(
    ([id, status, isChosen, name, u, v, x, y, z, error]) =>
        ({id, status, isChosen, name, u: u ?? null, v: v ?? null, x, y, z, error}));

const isTooLong = (name) => new TextEncoder().encode(name).length > kMaxName;

/** A point that was given where no tissue was seen stays lost. */
function pointCell({id, status}, neverPlaced) {
  const cell = statusCell(status, statusWords[status]);
  if (neverPlaced.has(id))
    cell.append(element(
        'small', {class: 'lost-why'}, `not seen when it was given: ${endOfUnplaced(true)}`));
  return cell;
}

export const numberOf = ({id}) => `#${id}`;
export const labelOf = (point) => point.name || numberOf(point);

/**
 * Lets a button do what it says when it is pressed a second time. what(): "point P4"; show: called
 * with whether it asks. Returns what ends its question.
 */
function askFirst(button, what, show, done) {
  let timer = null;
  const ask = (on) => {
    clearTimeout(timer);
    timer = on ? setTimeout(() => ask(false), kAskMs) : null;
    button.classList.toggle('asks', on);
    show(on);
  };
  button.addEventListener('click', ({detail}) => {
    if (timer === null) {
      ask(true);
      tell(`Press again to remove ${what()}.`);
    } else if (detail < 2) {  // not the second half of a double click
      ask(false);
      done();
    }
  });
  ask(false);
  return () => ask(false);
}

/** Removes the point: its rows end for good. label(): of the point. */
function removeButton(id, label) {
  const button = element('button', {type: 'button', class: 'remove'});
  const show = (asks) => button.setAttribute(
      'aria-label', asks ? `Remove point ${id}? Press again to remove it` : `Remove point ${id}`);
  askFirst(
      button, () => `point ${label()}`, show,
      () => request('/points', {id, removed: true}, `Point ${label()} removed.`));
  return button;
}

const pointsInWords = (count) => `${count} point${count === 1 ? '' : 's'} without a place`;

/** Removes all points that never had a place. */
class RemoveUnplaced {
  constructor() {
    this.ids = [];
    this.button = byId('remove-unplaced');
    this.end = askFirst(
        this.button, () => pointsInWords(this.ids.length), (asks) => this.write(asks),
        () => this.remove());
  }

  write(asks) {
    const count = this.ids.length;
    this.button.textContent =
        asks ? `Remove ${count}?` : `Remove points without a place (${count})`;
  }

  show(ids) {
    this.button.hidden = !ids.length;
    if (ids.join() === this.ids.join()) return;
    this.ids = ids;
    this.end();  // what was asked was of others
  }

  /** One after the other, up to one that is refused, of which the page tells. */
  async remove() {
    const {ids} = this, done = `${pointsInWords(ids.length)} removed.`;
    for (const id of ids)
      if (!(await request('/points', {id, removed: true}, done))) return;
  }
}

export class PointList {
  constructor() {
    this.rows = new Map();  // by id
    this.unplaced = new RemoveUnplaced();
    this.more = element('p', {class: 'hint'});
    this.body = element('tbody');
    const heads = ['Point', 'Status', 'Expected error', 'x, y, z in mm', ''].map(
        (text) => element('th', {scope: 'col'}, text));
    this.table = element(
        'table', {class: 'point-table'}, element('thead', {}, element('tr', {}, ...heads)),
        this.body);
    byId('points').replaceChildren(this.table, this.more);
  }

  makeRow(id) {
    const name =
        element('input', {type: 'text', placeholder: `#${id}`, 'aria-label': `Name of ${id}`});
    let isTold = '';
    name.addEventListener('input', () => {
      isTold = isTooLong(name.value) ? 'A name has at most 80 bytes: make it shorter.' : '';
      tell(isTold);
    });
    name.addEventListener('change', () => {
      if (isTold) return tell('The name was not changed: it has more than 80 bytes.');
      return request(
          '/points', {id, name: name.value},
          name.value ? `Point #${id} is called ${name.value}.` :
                       `Point #${id} has no name any more.`);
    });
    const cells = Array.from({length: 5}, () => element('td'));
    // By which its label in the picture calls it where there is no room for the name.
    const number = element('span', {class: 'number'}, numberOf({id}));
    cells[0].append(element('div', {class: 'named'}, number, name));
    cells[4].append(removeButton(id, () => labelOf({id, name: name.value})));
    const row = {name, number, cells, line: element('tr', {'data-id': `${id}`}, ...cells)};
    this.body.append(row.line);
    this.rows.set(id, row);
    return row;
  }

  /**
   * chosen: points of users. takesMore: a click can follow another one. neverPlaced: ids of those
   * which never had a place in the run.
   */
  show(chosen, takesMore, neverPlaced) {
    this.unplaced.show(chosen.map(({id}) => id).filter((id) => neverPlaced.has(id)));
    const listed = chosen.slice(0, kMaxListed);
    const ids = new Set(listed.map(({id}) => id));
    for (const [id, {line}] of this.rows) {
      if (ids.has(id)) continue;
      line.remove();
      this.rows.delete(id);
    }
    for (const point of listed) {
      const {name, number: shown, cells} = this.rows.get(point.id) ?? this.makeRow(point.id);
      if (document.activeElement !== name) name.value = point.name;
      shown.hidden = !point.name;
      cells[1].replaceChildren(pointCell(point, neverPlaced));
      cells[2].replaceChildren(errorCell(hasPlace(point) ? point.error : null));
      cells[3].textContent = hasPlace(point) ?
          [point.x, point.y, point.z].map((value) => number(value, 1)).join(', ') :
          '–';
    }
    this.table.hidden = listed.length === 0;
    this.more.textContent = chosen.length > listed.length ?
        `and ${chosen.length - listed.length} more` :
        listed.length ? '' :
        takesMore     ? 'None yet: click on tissue in the left view.' :
                        'None.';
  }

  /** Whether names can be given, and points removed. */
  enable(on) {
    this.unplaced.button.disabled = !on;
    for (const field of this.body.querySelectorAll('input, button')) field.disabled = !on;
  }
}
