// Sound and flash while the tissue is lost or nothing is known of it; both only where asked for.
import {byId} from '../../report/web/data.js';
import {isLost} from './words.js';

const kBeatMs = 1500;

// A choice outlasts a reload of the page where the browser keeps such things.
function kept(id) {
  try {
    return sessionStorage.getItem(id) === 'on';
  } catch {
    return false;
  }
}

function keep({id, checked}) {
  try {
    sessionStorage.setItem(id, checked ? 'on' : 'off');
  } catch {
    // It holds until the page is loaded again.
  }
}

export class Alarm {
  constructor() {
    this.isOn = false;
    this.sound = byId('alarm-sound');
    for (const box of [this.sound, byId('alarm-flash')]) {
      box.checked = kept(box.id);
      box.addEventListener('change', () => keep(box));
    }
    // A short one tells that it works.
    this.sound.addEventListener('change', () => this.wake()?.then(() => this.beep(0.08)));
    byId('alarm-flash').addEventListener('change', () => this.flash());
    for (const gesture of ['click', 'keydown'])
      document.addEventListener(gesture, () => this.wake());
    this.wake();
    setInterval(() => this.beat(), kBeatMs);
  }

  /** Browsers play sound only after a click or a key; until then the page says so. */
  wake() {
    const {checked} = this.sound;
    if (checked && !this.context) {
      this.context = new AudioContext();
      this.context.addEventListener('statechange', () => this.tellWhetherSilent());
    }
    this.tellWhetherSilent();
    return checked ? this.context.resume() : null;
  }

  tellWhetherSilent() {
    const isSilent = this.sound.checked && this.context.state !== 'running';
    byId('sound-waits').textContent = isSilent ? 'No sound until you click on this page.' : '';
  }

  /** state: that is shown. */
  watch(state) {
    const wasOn = this.isOn;
    this.isOn = isLost(state) || ['disconnected', 'stalled', 'unusable'].includes(state);
    this.flash();
    if (this.isOn && !wasOn) this.beat();
  }

  flash() {
    document.body.classList.toggle('flashing', this.isOn && byId('alarm-flash').checked);
  }

  beat() {
    // Tones of a context that waits would all come at once later.
    if (!this.isOn || !this.sound.checked || this.context?.state !== 'running') return;
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
