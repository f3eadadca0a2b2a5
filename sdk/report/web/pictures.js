// The key frames and their enlarged view.
import {wordOfState} from './colours.js';
import {stateChip} from './summary.js';
import {byId, element, seconds} from './data.js';
import {reasonsInWords} from './reasons.js';

const source = (picture) => `data:image/jpeg;base64,${picture.jpeg}`;
const describe = (picture) => `Overlay of frame ${picture.frame}, ${wordOfState(picture.state)}`;

function caption(picture) {
  const result = element(
      'figcaption', {}, `frame ${picture.frame} · ${seconds(picture.ms)} `,
      stateChip(picture.state));
  if (picture.changed) result.append(' state changed');
  if (picture.reasons)
    result.append(element(
        'span', {class: 'reasons'},
        reasonsInWords(picture.reasons, picture.faulty_views).join('; ')));
  return result;
}

function enlarge(picture) {
  const close = element('button', {type: 'button'}, 'Close');
  close.addEventListener('click', () => byId('large').close());
  byId('large').replaceChildren(
      element(
          'figure', {}, element('img', {src: source(picture), alt: describe(picture)}),
          caption(picture)),
      close);
  byId('large').showModal();
}

export function showPictures(pictures) {
  const list = byId('pictures');
  if (!pictures.length) list.append(element('p', {class: 'hint'}, 'No frame was kept.'));
  for (const picture of pictures) {
    const image = element('img', {src: source(picture), alt: describe(picture), loading: 'lazy'});
    const button = element('button', {type: 'button', class: 'picture'}, image);
    button.addEventListener('click', () => enlarge(picture));
    list.append(element('figure', {}, button, caption(picture)));
  }
  byId('large').addEventListener('click', (event) => {
    if (event.target === byId('large')) byId('large').close();
  });
}
