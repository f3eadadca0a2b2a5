// How often the surface is drawn in 3D: less often where that takes long, and not at all where it
// would hold up the rest of the page, as on a computer without a GPU that has other work.
const kRest = 4;               // times as long as it took, before it is drawn again; not the first
const kSlowMs = 250;           // of one picture
const kMostSlow = 5;           // so many of them, one after the other, are too slow
const kTooSlowMs = 1000;       // of one picture
const kTooSlowFirstMs = 5000;  // of the first one, for which programs are compiled

export class Pace {
  constructor() {
    this.begin();
  }

  /** Measures anew. */
  begin() {
    this.slow = 0;
    this.isFirst = true;
    this.freeAt = 0;
  }

  isDue() {
    return performance.now() >= this.freeAt;
  }

  /** ms: from the begin of a picture until it is drawn. Returns whether that is too slow. */
  add(ms) {
    const isTooSlow = ms > (this.isFirst ? kTooSlowFirstMs : kTooSlowMs);
    this.slow = ms > kSlowMs && !this.isFirst ? this.slow + 1 : 0;
    this.freeAt = performance.now() + (this.isFirst ? 0 : kRest * ms);
    this.isFirst = false;
    return isTooSlow || this.slow === kMostSlow;
  }
}

/** Once what the page says now is on the screen; a page that is hidden is not drawn. */
export const painted = () => new Promise((resolve) => {
  const patience = setTimeout(resolve, 100);
  requestAnimationFrame(() => setTimeout(() => {
                          clearTimeout(patience);
                          resolve();
                        }));
});
