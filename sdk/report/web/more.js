// How many rows follow beneath the lower edge of what scrolls: many browsers draw a scroll bar only
// while it moves.
import {element} from './data.js';

/** box: what scrolls, with one element of the page in it for each list. */
function tellMore(box) {
  const note = element('button', {type: 'button', class: 'more', hidden: ''});
  const tell = () => {
    const isAll = box.scrollTop + box.clientHeight >= box.scrollHeight - 2;
    const edge = box.getBoundingClientRect().top + box.clientHeight - note.offsetHeight;
    const isBelow = (row) => row.checkVisibility() && row.getBoundingClientRect().bottom > edge;
    const rows = isAll || getComputedStyle(box).overflowY === 'visible' ?
        0 :
        [...box.querySelectorAll('tbody tr')].filter(isBelow).length;
    const text = `\u25be ${rows} more below`;
    if (rows && note.textContent !== text) note.textContent = text;
    note.hidden = rows === 0;
  };
  note.addEventListener(
      'click', () => box.scrollBy({top: 0.8 * box.clientHeight, behavior: 'smooth'}));
  box.addEventListener('scroll', tell);
  const sizes = new ResizeObserver(tell);
  for (const each of [box, ...box.children]) sizes.observe(each);
  box.append(note);
}

/** boxes: a selector of what scrolls. */
export function tellMoreOfLists(boxes) {
  for (const box of document.querySelectorAll(boxes)) tellMore(box);
}
