// The states of the last seconds, in time: the newest at the right.
import {byId} from '../../report/web/data.js';
import {stateColour} from '../../report/web/colours.js';
import {duration} from './words.js';

const kSpanMs = 20000;

/** For the strip and the list of changes: a video that stands still is as bad as being lost. */
export const colourOf = (state) => stateColour(state === 'stalled' ? 'lost' : state);

export class Strip {
  constructor() {
    this.moments = [];  // {state, ms, gapMs}, of the pictures' time
  }

  add({state, ms, gapMs}) {
    const {moments} = this;
    if (moments.length && ms < moments.at(-1).ms) moments.length = 0;  // a recording begins again
    moments.push({state, ms, gapMs});
    // One that began before the span lasts into it.
    while (moments.length > 1 && moments[1].ms < ms - kSpanMs) moments.shift();
  }

  /** [from, to, state] of the last seconds, ms before the right end. See draw(). */
  spans(outageMs, limitMs) {
    const {moments} = this, end = (moments.at(-1)?.ms ?? 0) + outageMs, spans = [];
    const add = (from, to, state) => {
      const first = Math.max(end - kSpanMs, from);
      if (to > first) spans.push([end - first, end - to, state]);
    };
    moments.forEach(({state, ms}, i) => {
      const next = moments[i + 1], to = next?.ms ?? end;
      const gapMs = next ? next.gapMs : outageMs;
      const isOutage = gapMs > 0, stopped = Math.min(to, ms + limitMs);
      add(ms, isOutage ? stopped : to, state);
      if (isOutage) add(stopped, to, 'stalled');
    });
    return spans;
  }

  /**
   * outageMs: since the newest picture, where no further one comes, and else 0; limitMs: from which
   * time on that is an outage; endedMs: since the end of the run, null before.
   */
  draw(outageMs, limitMs, endedMs) {
    const canvas = byId('strip');
    const width = Math.max(1, Math.round(canvas.clientWidth));
    if (canvas.width !== width) canvas.width = width;
    const height = Math.max(1, Math.round(canvas.clientHeight));
    canvas.height = height;
    const context = canvas.getContext('2d');
    const spans = this.spans(outageMs, limitMs);
    const at = (ms) => width * (1 - ms / kSpanMs);
    for (const [from, to, state] of spans) {
      context.fillStyle = colourOf(state);
      context.fillRect(Math.floor(at(from)), 0, Math.ceil(at(to)) - Math.floor(at(from)), height);
    }
    canvas.dataset.spans = spans.map(([, , state]) => state).join(' ');
    if (!spans.length || spans[0][0] <= 0) return;
    const [ago] = spans[0];
    context.font = `bold ${0.8 * height}px sans-serif`;
    context.textBaseline = 'middle';
    context.lineWidth = 4;
    context.strokeStyle = '#0f172a';
    context.fillStyle = '#ffffff';
    const write = (text, x) => {
      context.strokeText(text, x, height / 2);
      context.fillText(text, x, height / 2);
    };
    const end = endedMs === null ? 'now' : `ended ${duration(endedMs)} ago`;
    const begin = endedMs === null ? `${duration(ago)} ago` : `${duration(ago)} before`;
    const left = Math.floor(at(ago)) + 8, room = width - context.measureText(end).width - 24;
    if (left + context.measureText(begin).width < room) write(begin, left);
    context.textAlign = 'right';
    write(end, width - 8);
    canvas.dataset.end = end;
  }
}
