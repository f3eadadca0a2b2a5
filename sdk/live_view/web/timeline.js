// Frame time and share of the tissue that is seen, of the last frames.
import uPlot from 'uplot';
import {lineColours} from '../../report/web/colours.js';
import {byId, paletteColour} from '../../report/web/data.js';

const kMaxMoments = 600;
const kDrawMs = 250;

export class Timeline {
  constructor() {
    const ink = paletteColour('--muted');
    const axis = (scale, side) => ({scale, side, stroke: ink, size: 52, grid: {show: side === 3}});
    this.values = [[], [], []];
    this.drawn = 0;
    const container = byId('plots');
    const width = () => Math.max(300, container.clientWidth - 2);
    this.plot = new uPlot(
        {
          width: width(),
          height: 170,
          scales: {
            x: {time: false},
            ms: {range: (_, __, high) => [0, high > 0 ? high * 1.1 : 1]},
            share: {range: [0, 100]}
          },
          axes: [
            {stroke: ink, size: 30, values: (_, ticks) => ticks.map((t) => `${+ t.toFixed(2)} s`)},
            axis('ms', 3), axis('share', 1)
          ],
          series: [
            {label: 'Time', value: (_, value) => (value === null ? '–' : `${value.toFixed(2)} s`)},
            {label: 'frame time, ms', scale: 'ms', stroke: lineColours[0], width: 1.6},
            {label: 'tissue seen, %', scale: 'share', stroke: lineColours[2], width: 1.6},
          ],
        },
        this.values, container);
    addEventListener('resize', () => this.plot.setSize({width: width(), height: 170}));
  }

  add(moments) {
    for (const {ms, frameMs, seen: share} of moments) {
      this.values[0].push(ms / 1000);
      this.values[1].push(frameMs);
      this.values[2].push(share === null ? null : 100 * share);
    }
    for (const line of this.values) line.splice(0, Math.max(0, line.length - kMaxMoments));
    if (performance.now() - this.drawn < kDrawMs) return;
    this.drawn = performance.now();
    this.plot.setData(this.values);
  }
}
