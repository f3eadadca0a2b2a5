// "No new picture", which comes by itself where nothing puts it off: over the state, at the left
// view, and as a gray veil over the page. The browser moves it all without the page's script, also
// while that is kept from running.
import {byId, element} from '../../report/web/data.js';

const kLongMs = 1e8;
const kLightMs = 60000;  // of the animations, at which it comes
const kAges = 120;       // seconds that are told one by one

export class Fuse {
  constructor() {
    const offset = kLightMs / kLongMs, forever = {duration: kLongMs, fill: 'both'};
    const show = (id, [off, on]) =>
        byId(id).animate([off, {...off, offset}, {...on, offset}, on], forever);
    // The veil that grays the page is out of the picture until then, and costs nothing.
    const veil = [{transform: 'translateX(-300%)'}, {transform: 'none'}];
    const ages = Array.from({length: kAges}, (_, s) => `Picture of ${s} s ago`);
    byId('fuse-ages')
        .append(...[...ages, 'Picture of over 2 min ago'].map((age) => element('span', {}, age)));
    const end = `translateY(${(-100 * kAges) / (kAges + 1)}%)`;
    this.ages = byId('fuse-ages').animate([{transform: 'none'}, {transform: end}], {
      duration: 1000 * kAges,
      fill: 'both',
      easing: `steps(${kAges})`
    });
    this.animations = [
      show('fuse', [{opacity: 0}, {opacity: 1}]), show('picture-fuse', veil),
      show('page-fuse', veil), this.ages
    ];
    this.out();
  }

  /** ageMs: of the newest frame; limitMs: from its coming until this is said. */
  light(ageMs, limitMs) {
    for (const animation of this.animations) {
      animation.play();
      animation.currentTime = animation === this.ages ? ageMs : ageMs + kLightMs - limitMs;
    }
  }

  out() {
    for (const animation of this.animations) animation.cancel();
  }
}
