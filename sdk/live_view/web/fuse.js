// Banners "No new picture" over the state, at the top and at the left view, which come by
// themselves where nothing puts them off: the browser moves them without the page's script, also
// while that is kept from running.
const kLongMs = 1e8;

export class Fuse {
  /** ms: from the newest frame until the banners. */
  constructor(banners, ms) {
    const offset = ms / kLongMs;
    this.animations = banners.map(
        (banner) => banner.animate(
            [{opacity: 0}, {opacity: 0, offset}, {opacity: 1, offset}, {opacity: 1}],
            {duration: kLongMs, fill: 'both'}));
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
