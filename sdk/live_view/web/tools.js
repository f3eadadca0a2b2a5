// Full screen, and the pause of the pictures. The state goes on while they pause.
import {byId} from '../../report/web/data.js';
import {duration} from './words.js';

export function listenToFullScreen() {
  const button = byId('full-screen');
  let hadGrid = true;
  button.hidden = !document.fullscreenEnabled;
  button.addEventListener(
      'click',
      () =>
          (document.fullscreenElement ? document.exitFullscreen() :
                                        document.documentElement.requestFullscreen()));
  document.addEventListener('fullscreenchange', () => {
    const isFull = Boolean(document.fullscreenElement);
    document.body.classList.toggle('full', isFull);
    // Labels are read from afar there, and the grid is what hides them.
    const grid = byId('overlay');
    if (isFull) hadGrid = grid.checked;
    grid.checked = !isFull && hadGrid && !grid.disabled;
    grid.dispatchEvent(new Event('change'));
    button.textContent = isFull ? 'Leave full screen' : 'Full screen';
  });
}

export class Pause {
  /** changed: called with whether it is on. pictureAt(): when the picture came; null: none yet. */
  constructor(changed, pictureAt) {
    this.changed = changed;
    this.pictureAt = pictureAt;
    this.from = null;
    byId('pause').addEventListener('click', () => this.set(this.from === null));
    setInterval(() => this.tell(), 500);
  }

  isOn() {
    return this.from !== null;
  }

  set(on) {
    this.from = on ? this.pictureAt() ?? performance.now() : null;
    byId('pause').setAttribute('aria-pressed', `${on}`);
    byId('pause').textContent = on ? 'Go on' : 'Pause picture';
    byId('paused').hidden = !on;
    this.tell();
    this.changed(on);
  }

  tell() {
    if (this.from !== null)
      byId('paused').textContent =
          `PAUSED – picture of ${duration(performance.now() - this.from)} ago`;
  }
}
