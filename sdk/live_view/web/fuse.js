// "No new picture", which comes by itself where nothing puts it off: over the state, at the left
// view, and as a gray veil over the page. The browser moves it all without the page's script, also
// while that is kept from running.
import {byId, element} from '../../report/web/data.js';

const kLongMs = 1e8;
const kAges = 120;  // seconds that are told one by one

export class Fuse {
  /** ms: from the newest frame until it comes. */
  constructor(ms) {
    const offset = ms / kLongMs, forever = {duration: kLongMs, fill: 'both'};
    const show = (id, [off, on]) =>
        byId(id).animate([off, {...off, offset}, {...on, offset}, on], forever);
    // The veil that grays the page is out of the picture until then, and costs nothing.
    const veil = [{transform: 'translateX(-300%)'}, {transform: 'none'}];
    const ages = Array.from({length: kAges}, (_, s) => `Picture of ${s} s ago`);
    byId('fuse-ages')
        .append(...[...ages, 'Picture of over 2 min ago'].map((age) => element('span', {}, age)));
    const end = `translateY(${(-100 * kAges) / (kAges + 1)}%)`;
    this.animations = [
      show('fuse', [{opacity: 0}, {opacity: 1}]), show('picture-fuse', veil),
      show('page-fuse', veil), byId('fuse-ages').animate([{transform: 'none'}, {transform: end}], {
        duration: 1000 * kAges,
        fill: 'both',
        easing: `steps(${kAges})`
      })
    ];
    this.out();
  }

  /** ageMs: of the newest frame. */
  light(ageMs) {
    for (const animation of this.animations) {
      animation.play();
      animation.currentTime = ageMs;
    }
  }

  out() {
    for (const animation of this.animations) animation.cancel();
  }
}
