// Sound and flash while the tissue is lost or nothing is known of it; both only where asked for.
import {byId} from '../../report/web/data.js';

const kBeatMs = 1500;

export class Alarm {
  constructor() {
    this.isOn = false;
    byId('alarm-sound').addEventListener('change', () => {
      // Browsers play sound only after a click; a short one tells that it works.
      if (!byId('alarm-sound').checked) return;
      this.context ??= new AudioContext();
      this.context.resume().then(() => this.beep(0.08));
    });
    byId('alarm-flash').addEventListener('change', () => this.flash());
    setInterval(() => this.beat(), kBeatMs);
  }

  /** state: that is shown. */
  watch(state) {
    const wasOn = this.isOn;
    this.isOn = ['lost', 'unfound', 'disconnected', 'stalled'].includes(state);
    this.flash();
    if (this.isOn && !wasOn) this.beat();
  }

  flash() {
    document.body.classList.toggle('flashing', this.isOn && byId('alarm-flash').checked);
  }

  beat() {
    if (!this.isOn || !byId('alarm-sound').checked || !this.context) return;
    this.beep(0.25);
    document.documentElement.dataset.beeps =
        Number(document.documentElement.dataset.beeps ?? 0) + 1;
  }

  beep(length) {
    const now = this.context.currentTime;
    for (const [delay, hertz] of [[0, 880], [length + 0.05, 660]]) {
      const tone = this.context.createOscillator(), loudness = this.context.createGain();
      tone.frequency.value = hertz;
      loudness.gain.setValueAtTime(0.25, now + delay);
      loudness.gain.exponentialRampToValueAtTime(0.001, now + delay + length);
      tone.connect(loudness).connect(this.context.destination);
      tone.start(now + delay);
      tone.stop(now + delay + length);
    }
  }
}
