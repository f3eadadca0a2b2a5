// The left view with the followed points and the targets; a click follows another one.
import {statuses} from '../../report/web/colours.js';
import {byId} from '../../report/web/data.js';
import {request} from './now.js';
import {drawTargets} from './targets.js';

const kRadius = 3.5;

export class Picture {
  constructor() {
    this.canvas = byId('picture');
    this.context = this.canvas.getContext('2d');
    this.size = [1, 1];
    this.canvas.addEventListener('click', (event) => {
      const box = this.canvas.getBoundingClientRect();
      const u = ((event.clientX - box.left) / box.width) * this.size[0] - 0.5;
      const v = ((event.clientY - box.top) / box.height) * this.size[1] - 0.5;
      request('/points', {u, v});
    });
  }

  /** points: as the header has them. clicked: a set of ids. */
  show(bitmap, header, clicked, targets) {
    if (this.canvas.width !== bitmap.width || this.canvas.height !== bitmap.height) {
      this.canvas.width = bitmap.width;
      this.canvas.height = bitmap.height;
    }
    this.size = [header.width, header.height];
    this.context.drawImage(bitmap, 0, 0);
    const scale = bitmap.width / header.width;
    if (byId('show-points').checked) this.drawPoints(header.points, clicked, scale);
    if (byId('show-targets').checked) drawTargets(this.context, targets, scale);
  }

  drawPoints(points, clicked, scale) {
    for (const [id, status, u, v] of points) {
      if (u === undefined || u === null) continue;
      const x = (u + 0.5) * scale, y = (v + 0.5) * scale;
      this.context.beginPath();
      this.context.arc(x, y, clicked.has(id) ? 2 * kRadius : kRadius, 0, 2 * Math.PI);
      this.context.fillStyle = statuses[status].colour;
      this.context.fill();
      this.context.lineWidth = clicked.has(id) ? 2.5 : 1;
      this.context.strokeStyle = clicked.has(id) ? '#ffffff' : '#0f172a';
      this.context.stroke();
    }
  }
}
