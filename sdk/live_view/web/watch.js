// Puts together what a page shows of each frame; surface and timeline are null where the packages
// that draw them are not inside.
import {byId} from '../../report/web/data.js';
import {ready} from '../../report/web/health.js';
import {Checks} from './checks.js';
import {watchFrames} from './connection.js';
import {Changes, listenToRecord, showNow, showPoints, showRecording, showStages} from './now.js';
import {Picture} from './picture.js';
import {placedTargets, readTargets, showTargetList} from './targets.js';

export async function watch(surface, timeline) {
  const picture = new Picture();
  const changes = new Changes();
  const checks = new Checks();
  const given = new Set();  // points that were there when the page opened
  const shown = [];         // times of the last frames, ms
  let newest = -1;          // moment
  let isFirst = true;
  listenToRecord();

  async function show({header, sections}) {
    const [left, overlay] = await Promise.all([sections.left, sections.overlay].map(
        (jpeg) => jpeg && createImageBitmap(new Blob([jpeg], {type: 'image/jpeg'}))));
    for (const [id] of header.points)
      if (isFirst) given.add(id);
    isFirst = false;
    const clicked = new Set(header.points.map(([id]) => id).filter((id) => !given.has(id)));
    const moments = header.moments.filter(([frame]) => frame > newest);
    for (const moment of moments) changes.add(moment);
    if (moments.length) newest = moments.at(-1)[0];
    shown.push(performance.now());
    if (shown.length > 60) shown.shift();
    const rate = shown.length > 1 ? (1000 * (shown.length - 1)) / (shown.at(-1) - shown[0]) : NaN;
    const now = header.moments.find(([frame]) => frame === header.frame) ?? header.moments.at(-1);
    if (now) showNow(header, now, rate);
    showStages(header.stages);
    showPoints(header.points, clicked);
    showRecording(header.recording);
    await checks.show(header);
    const targets = readTargets(header);
    showTargetList(targets, header.target_count);
    picture.show(overlay ?? left, header, clicked, targets);
    await surface?.show(
        header, sections, left, byId('show-targets').checked ? placedTargets(targets) : []);
    timeline?.add(moments);
    document.documentElement.dataset.frame = header.frame;
    document.documentElement.dataset.clicked = clicked.size;
    left.close();
    overlay?.close();
  }

  const reason = await watchFrames(() => ({overlay: byId('overlay').checked}), show, ready);
  byId('message').textContent = reason;
  checks.end();
  document.documentElement.dataset.ended = 'true';
}
