// A plan's model in 3D: its parts in their colours, or in that of the expected error.
import * as THREE from 'three';
import {partColour, unknownStatus} from './colours.js';
import {completeTriangles, statusColours, valueColour} from './stage.js';

export class PlanMesh {
  /** plan: {triangles, parts: [{first, count}]}; no two parts share a vertex. */
  constructor(plan) {
    this.triangles = plan.triangles;
    const vertices = plan.triangles.reduce((most, v) => Math.max(most, v + 1), 0);
    this.colours = new Float32Array(3 * vertices);
    plan.parts.forEach(({first, count}, i) => {
      const colour = new THREE.Color(partColour(i)).toArray();
      for (let t = 3 * first; t < 3 * (first + count); ++t)
        this.colours.set(colour, 3 * plan.triangles[t]);
    });
    this.geometry = new THREE.BufferGeometry();
    for (const name of ['position', 'color'])
      this.geometry.setAttribute(
          name, new THREE.BufferAttribute(new Float32Array(3 * vertices), 3));
    this.mesh = new THREE.Mesh(
        this.geometry, new THREE.MeshLambertMaterial({vertexColors: true, side: THREE.DoubleSide}));
    this.mesh.frustumCulled = false;
    this.mesh.matrixAutoUpdate = false;
  }

  /** moment: or null, of which nothing is shown. How many triangles are shown. */
  show(moment, coloring, holdStill) {
    this.mesh.visible = Boolean(moment?.plan);
    if (!this.mesh.visible) return 0;
    const {xyz, error} = moment.plan;
    const {position, color} = this.geometry.attributes;
    for (let v = 0; v < position.count; ++v) {
      const missing = Number.isNaN(xyz[3 * v]);
      for (let k = 0; k < 3; ++k) position.array[3 * v + k] = missing ? 0 : xyz[3 * v + k];
      if (coloring.key === 'error') color.array.set(this.errorColour(error[v], coloring), 3 * v);
    }
    if (coloring.key !== 'error') color.array.set(this.colours);
    const triangles = completeTriangles(this.triangles, xyz);
    this.geometry.setIndex(triangles);
    position.needsUpdate = true;
    color.needsUpdate = true;
    this.geometry.computeVertexNormals();
    this.mesh.matrix.identity();
    if (holdStill && moment.rigid) this.mesh.matrix.set(...moment.rigid, 0, 0, 0, 1).invert();
    this.mesh.matrixWorldNeedsUpdate = true;
    return triangles.length / 3;
  }

  errorColour(mm, coloring) {
    return Number.isNaN(mm) ? statusColours[unknownStatus] : valueColour(mm / coloring.top);
  }
}
