// A plan's model in 3D: its parts in their colours, or in that of the expected error. Parts that
// hold others let these be seen.
import * as THREE from 'three';
import {partColour, unknownStatus} from './colours.js';
import {completeTriangles, seeThrough, statusColours, valueColour} from './stage.js';

// Two walls and more lie in front of what is inside.
const kOuterOpacity = 0.2;

/** The part's box: null where no vertex has a place. */
function boxOf(triangles, xyz) {
  const box = new THREE.Box3(), place = new THREE.Vector3();
  for (const v of triangles)
    if (!Number.isNaN(xyz[3 * v])) box.expandByPoint(place.fromArray(xyz, 3 * v));
  return box.isEmpty() ? null : box;
}

const material = () => new THREE.MeshLambertMaterial({vertexColors: true, side: THREE.DoubleSide});

export class PlanMesh {
  /** plan: {triangles, parts: [{first, count}]}; no two parts share a vertex. */
  constructor(plan) {
    this.parts =
        plan.parts.map(({first, count}) => plan.triangles.subarray(3 * first, 3 * (first + count)));
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
    const outer = material();
    seeThrough(outer, true, kOuterOpacity);
    this.mesh = new THREE.Mesh(this.geometry, [material(), outer]);
    this.mesh.frustumCulled = false;
    this.mesh.matrixAutoUpdate = false;
  }

  /**
   * moment: or null, of which nothing is shown. isShown: of a part, by its place. How many
   * triangles are shown.
   */
  show(moment, coloring, holdStill, isShown = () => true) {
    this.seenThrough = 0;  // triangles
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
    const triangles = this.setTriangles(xyz, this.parts.filter((_, i) => isShown(i)));
    position.needsUpdate = true;
    color.needsUpdate = true;
    this.geometry.computeVertexNormals();
    this.mesh.matrix.identity();
    if (holdStill && moment.rigid) this.mesh.matrix.set(...moment.rigid, 0, 0, 0, 1).invert();
    this.mesh.matrixWorldNeedsUpdate = true;
    return triangles / 3;
  }

  /** Those of these parts, inner ones first. How many indices there are. */
  setTriangles(xyz, parts) {
    const boxes = parts.map((part) => boxOf(part, xyz));
    const isOuter = (box) =>
        boxes.some((other) => box && other && other !== box && box.containsBox(other));
    const [inner, outer] = [false, true].map(
        (wanted) => completeTriangles(
            parts.filter((_, i) => isOuter(boxes[i]) === wanted).flatMap((part) => [...part]),
            xyz));
    this.geometry.setIndex([...inner, ...outer]);
    this.geometry.clearGroups();
    this.geometry.addGroup(0, inner.length, 0);
    this.geometry.addGroup(inner.length, outer.length, 1);
    this.seenThrough = outer.length / 3;
    return inner.length + outer.length;
  }

  errorColour(mm, coloring) {
    return Number.isNaN(mm) ? statusColours[unknownStatus] : valueColour(mm / coloring.top);
  }
}
