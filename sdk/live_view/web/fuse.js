// A banner "No new picture" over the state, which comes by itself where nothing puts it off: the
// browser moves it without the page's script, also while that is kept from running.
const kLongMs = 1e8;

export class Fuse {
  /** ms: from the newest frame until the banner. */
  constructor(banner, ms) {
    const offset = ms / kLongMs;
    this.animation = banner.animate(
        [{opacity: 0}, {opacity: 0, offset}, {opacity: 1, offset}, {opacity: 1}],
        {duration: kLongMs, fill: 'both'});
    this.animation.cancel();
  }

  /** ageMs: of the newest frame. */
  light(ageMs) {
    this.animation.play();
    this.animation.currentTime = ageMs;
  }

  out() {
    this.animation.cancel();
  }
}
