// A canvas in 3D for a surface in the rectified left camera (mm): light, grid, and a view that the
// mouse turns.
import * as THREE from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';
import {rampColour, statuses} from './colours.js';

export class Stage {
  /** Throws where there is no WebGL. The surface belongs into group. */
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({canvas, antialias: true, alpha: true});
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(35, 1, 0.5, 5000);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => this.render());
    // The camera's x right, y down, z away becomes three.js' x right, y up, z towards the viewer.
    this.group = new THREE.Group();
    this.group.rotation.x = Math.PI;
    // The light travels with the viewer, from over the left shoulder.
    const light = new THREE.DirectionalLight(0xffffff, 2.5);
    light.position.set(-0.4, 0.6, 1);
    this.camera.add(light, light.target);
    this.scene.add(this.group, this.camera, new THREE.HemisphereLight(0xffffff, 0x9aa0a8, 1.1));
  }

  /** Finds the box of the positions, which may be NaN; puts the 10 mm grid behind it. */
  enclose(...lists) {
    const box = new THREE.Box3();
    const point = new THREE.Vector3();
    for (const xyz of lists)
      for (let i = 0; i < xyz.length; i += 3)
        if (!Number.isNaN(xyz[i])) box.expandByPoint(point.set(xyz[i], -xyz[i + 1], -xyz[i + 2]));
    if (box.isEmpty()) box.expandByPoint(point.set(0, 0, -80)).expandByScalar(20);
    this.centre = box.getCenter(new THREE.Vector3());
    this.size = box.getSize(new THREE.Vector3());
    const cells = Math.max(2, 2 * Math.ceil(Math.max(this.size.x, this.size.y) / 20 + 0.5));
    if (this.grid) this.scene.remove(this.grid);
    this.grid = new THREE.GridHelper(10 * cells, cells, 0x94a3b8, 0x94a3b8);
    this.grid.material.transparent = true;
    this.grid.material.opacity = 0.35;
    this.grid.rotation.x = Math.PI / 2;
    this.grid.position.set(this.centre.x, this.centre.y, box.min.z - 2);
    this.scene.add(this.grid);
  }

  /**
   * Looks at all that is enclosed; the angles (radians) lead right and up from the camera's side.
   */
  look(right, up) {
    const half = Math.tan((this.camera.fov * Math.PI) / 360);
    const distance =
        1.15 * Math.max(this.size.y / 2 / half, this.size.x / 2 / half / this.camera.aspect) +
        this.size.z / 2;
    const direction = new THREE.Vector3(
        Math.sin(right) * Math.cos(up), Math.sin(up), Math.cos(right) * Math.cos(up));
    this.camera.position.copy(this.centre).addScaledVector(direction, distance);
    this.controls.target.copy(this.centre);
    this.controls.update();
  }

  /** From now on as large as its parent element. */
  fill() {
    new ResizeObserver(() => this.resize()).observe(this.canvas.parentElement);
    this.resize();
  }

  resize() {
    const {clientWidth: width, clientHeight: height} = this.canvas.parentElement;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.render();
  }

  render() {
    this.renderer.render(this.scene, this.camera);
  }
}

/** Shows what lies behind a material, or does not. */
export function seeThrough(material, on, opacity = 0.4) {
  if (material.transparent === on) return;
  material.transparent = on;
  material.opacity = on ? opacity : 1;
  material.depthWrite = !on;
  material.needsUpdate = true;
}

/** As many copies of a shape as there is room for, each with a place and a colour of its own. */
export function copies(shape, room, opacity) {
  const material =
      new THREE.MeshLambertMaterial({transparent: opacity < 1, opacity, depthWrite: opacity === 1});
  const made = new THREE.InstancedMesh(shape, material, Math.max(1, room));
  made.frustumCulled = false;
  made.count = 0;
  return made;
}

/** A copy for each in the list, at its centre. shapeOf: from it to the 3x3 matrix of its copy. */
export function place(made, list, shapeOf, colourOf) {
  list.forEach((each, i) => {
    const [x, y, z] = each.centre;
    const [xx, xy, xz, yx, yy, yz, zx, zy, zz] = shapeOf(each);
    made.setMatrixAt(i, new THREE.Matrix4(xx, xy, xz, x, yx, yy, yz, y, zx, zy, zz, z, 0, 0, 0, 1));
    made.setColorAt(i, new THREE.Color(colourOf(each)));
  });
  made.count = list.length;
  made.instanceMatrix.needsUpdate = true;
  if (made.instanceColor) made.instanceColor.needsUpdate = true;
}

/** The triangles whose vertices all have a position. */
export function completeTriangles(triangles, xyz) {
  const complete = [];
  for (let t = 0; t < triangles.length; t += 3)
    if (![0, 1, 2].some((k) => Number.isNaN(xyz[3 * triangles[t + k]])))
      complete.push(triangles[t], triangles[t + 1], triangles[t + 2]);
  return complete;
}

/** The ramp's colour as three.js takes it. */
export function valueColour(share) {
  return new THREE.Color().setRGB(...rampColour(share), THREE.SRGBColorSpace).toArray();
}

export const statusColours = statuses.map(({colour}) => new THREE.Color(colour).toArray());
