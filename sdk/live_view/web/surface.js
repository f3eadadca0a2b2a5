// The surface in 3D as it is now.
import * as THREE from 'three';
import {rampGradient, statuses} from '../../report/web/colours.js';
import {byId, element} from '../../report/web/data.js';
import {PlanMesh} from '../../report/web/plan_mesh.js';
import {
  completeTriangles,
  copies,
  place,
  seeThrough,
  Stage,
  statusColours,
  valueColour
} from '../../report/web/stage.js';
import {fetchSurface} from './connection.js';
import {Pace} from './pace.js';
import {isPartlyKnown, partSwatch} from './plan.js';
import {hasPlace, targetColour} from './targets.js';
import {statusWords} from './words.js';

const kTopErrorMm = 2;
const kWayColour = '#ffd400';  // of the shortest way from a part to the surface
const kLookMs = 8;             // whether a picture is drawn

/**
 * Tissue out of the image has no texture there: a plain colour in place of the image's last row.
 */
function leaveOutBeyondImage(material) {
  material.onBeforeCompile = (shader) => {
    shader.fragmentShader =
        shader.fragmentShader.replace('#include <map_fragment>', `#include <map_fragment>
        #ifdef USE_MAP
          if (any(lessThan(vMapUv, vec2(0.0))) || any(greaterThan(vMapUv, vec2(1.0))))
            diffuseColor.rgb = vec3(0.22, 0.2, 0.2);
        #endif`);
  };
}

/**
 * What is not of now is dim: colours keep the share tint of what they were. shown: {value}, 1 where
 * it is not of now, else 0.
 */
function dimWhenOld(material, shown, {tint, light, base = 0}) {
  const before = material.onBeforeCompile;
  material.onBeforeCompile = (shader) => {
    before.call(material, shader);
    shader.uniforms.isOld = shown;
    const head = 'uniform float isOld;\nvoid main() {', end = '#include <colorspace_fragment>';
    shader.fragmentShader =
        shader.fragmentShader.replace('void main() {', head).replace(end, `${end}
        gl_FragColor.rgb = min(gl_FragColor.rgb, 1.0);
        vec3 grayed = vec3(dot(gl_FragColor.rgb, vec3(0.3, 0.59, 0.11)));
        grayed = ${light.toFixed(2)} * mix(grayed, gl_FragColor.rgb, ${tint.toFixed(2)});
        gl_FragColor.rgb = mix(gl_FragColor.rgb, grayed + ${base.toFixed(2)}, isOld);`);
  };
  material.customProgramCacheKey = () => `dim ${tint} ${light} ${base}`;
}

const kOldSurface = {
  tint: 0,
  light: 0.8,
  base: 0.38
};
const kOldThings = {
  tint: 0.9,
  light: 0.5
};  // parts and targets: they are still told apart

class LiveSurface extends Stage {
  constructor(canvas) {
    super(canvas);
    this.pace = new Pace();
    this.isOn = true;
    this.isDrawing = false;  // the last picture is not on the screen yet
    this.isWaiting = false;  // another one is wanted
    this.number = -1;
    this.isOld = {value: 0};
    this.isPlaced = false;
    this.geometry = new THREE.BufferGeometry();
    this.texture = new THREE.CanvasTexture(document.createElement('canvas'));
    this.texture.colorSpace = THREE.SRGBColorSpace;
    this.material = new THREE.MeshLambertMaterial({vertexColors: true, side: THREE.DoubleSide});
    leaveOutBeyondImage(this.material);
    dimWhenOld(this.material, this.isOld, kOldSurface);
    this.wires = new THREE.Mesh(
        this.geometry,
        new THREE.MeshBasicMaterial(
            {color: 0x0f172a, wireframe: true, transparent: true, opacity: 0.28}));
    this.mesh = new THREE.Mesh(this.geometry, this.material);
    this.mesh.frustumCulled = this.wires.frustumCulled = false;
    this.group.add(this.mesh, this.wires);
    this.makeTargets(0);
    this.plan = null;  // the mesh, once there is one
    this.ways = new THREE.LineSegments(
        new THREE.BufferGeometry(),
        new THREE.LineBasicMaterial({color: kWayColour, depthTest: false, transparent: true}));
    dimWhenOld(this.ways.material, this.isOld, kOldThings);
    this.ways.renderOrder = 1;  // over the surface and the part, whichever lies before them
    this.ways.frustumCulled = false;
    this.group.add(this.ways);
    this.enclose([]);
    this.fill();
    byId('front-view').addEventListener('click', () => this.look(0, 0));
    byId('show-surface')
        .addEventListener('change', ({target}) => this.turn(target.checked, '3D is off.'));
    byId('surface-on').addEventListener('click', () => this.turn(true));
  }

  /** why: it is off. */
  turn(on, why = '') {
    this.isOn = on;
    if (on) this.pace.begin();
    byId('show-surface').checked = on;
    byId('surface-off').hidden = on;
    byId('surface-why').textContent = byId('surface-why').title = why;
    byId('surface').classList.toggle('off', !on);
    document.documentElement.dataset.surface = on ? 'on' : 'off';
    this.render();
  }

  isDue() {
    return this.isOn && !this.isDrawing && this.pace.isDue();
  }

  /**
   * One picture at a time: what a browser is given to draw before it is done holds up the page.
   */
  render() {
    this.isWaiting = this.isDrawing;
    if (!this.isOn || this.isDrawing) return;
    const begin = performance.now(), wasHidden = document.hidden;
    this.isDrawing = true;
    super.render();
    this.canvas.classList.toggle('dimmed', this.isOld.value > 0);
    const gl = this.renderer.getContext();
    const mark = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    const look = () => {
      if (mark && gl.clientWaitSync(mark, 0, 0) === gl.TIMEOUT_EXPIRED)
        return setTimeout(look, kLookMs);
      gl.deleteSync(mark);
      this.isDrawing = false;
      // A page that is not seen is served rarely.
      if (!wasHidden && !document.hidden) this.measure(performance.now() - begin);
      if (this.isWaiting) this.render();
      return null;
    };
    setTimeout(look);
  }

  measure(ms) {
    document.documentElement.dataset.surfaceMs = Math.round(ms);
    if (this.pace.add(ms) && this.isOn) this.turn(false, '3D is off: too slow on this computer.');
  }

  /** on: what is shown is not of now. */
  dim(on) {
    if (this.isOld.value === Number(on)) return;
    this.isOld.value = Number(on);
    this.render();
  }

  /** Whether the triangles are that surface's now. */
  async take(number) {
    const surface = await fetchSurface();
    if (!surface) return false;
    const {header, sections} = surface;
    this.number = header.surface;
    this.triangles = new Uint32Array(sections.triangles);
    const triangles = new Uint32Array(sections.plan_triangles);
    if (!this.plan && triangles.length) {
      const parts = header.plan_parts.map(([first, count]) => ({first, count}));
      this.plan = new PlanMesh({triangles, parts});
      for (const material of [this.plan.mesh.material].flat())
        dimWhenOld(material, this.isOld, kOldThings);
      this.group.add(this.plan.mesh);
      this.isPlaced = false;  // the view is to have room for it
    }
    return this.number === number;
  }

  makeRoom(vertices) {
    if (this.geometry.attributes.position?.count === vertices) return;
    this.geometry.dispose();
    for (const [name, size] of [['position', 3], ['color', 3], ['uv', 2]])
      this.geometry.setAttribute(
          name, new THREE.BufferAttribute(new Float32Array(size * vertices), size));
  }

  makeTargets(room) {
    if (this.targetRoom >= room) return;
    this.targetRoom = room;
    for (const old of [this.marks, this.errors]) {
      if (!old) continue;
      this.group.remove(old);
      for (const each of [old, old.geometry, old.material]) each.dispose();
    }
    this.marks = copies(new THREE.OctahedronGeometry(0.5), room, 1);
    this.errors = copies(new THREE.SphereGeometry(1, 16, 12), room, 0.35);
    for (const {material} of [this.marks, this.errors])
      dimWhenOld(material, this.isOld, kOldThings);
    this.group.add(this.marks, this.errors);
  }

  /** Marks, and balls as large as the expected error. */
  showTargets(targets) {
    this.makeTargets(targets.length);
    const ball = (size) => [size, 0, 0, 0, size, 0, 0, 0, size];
    place(this.marks, targets, () => ball(1), () => targetColour);
    place(this.errors, targets, ({error}) => ball(error ?? 0), () => targetColour);
    this.canvas.dataset.targets = targets.length;
  }

  /** parts: see readPlan. How many triangles of the model are shown. */
  showPlan(parts, {plan_xyz: xyz, plan_error: error}) {
    if (!this.plan) return 0;
    const plan = {xyz: new Float32Array(xyz), error: new Float32Array(error)};
    const isShown = parts.length > 0 && plan.xyz.length > 0;
    const ways = isShown ? parts.flatMap(({way}) => way ?? []) : [];
    this.ways.geometry.setAttribute('position', new THREE.Float32BufferAttribute(ways, 3));
    return this.plan.show(
        isShown ? {plan} : null, {key: byId('colour-by').value, top: kTopErrorMm}, false);
  }

  /**
   * targets: those with a place. parts: of a plan. Returns whether the frame is drawn: without the
   * triangles of its surface the one before stays.
   */
  async show(header, sections, bitmap, targets, parts) {
    const xyz = new Float32Array(sections.xyz);
    const isKnown = header.surface === this.number && (this.plan || !sections.plan_xyz?.byteLength);
    if (!isKnown && !(await this.take(header.surface))) return false;
    this.draw(xyz, header, sections, bitmap, targets, parts);
    this.showTargets(targets);
    this.canvas.dataset.plan = this.showPlan(parts, sections);
    seeThrough(
        this.material, (targets.length > 0 || parts.length > 0) && byId('see-through').checked);
    this.render();
    return true;
  }

  draw(xyz, header, sections, bitmap, targets, parts) {
    const by = byId('colour-by').value;
    this.makeRoom(xyz.length / 3);
    const {position, color, uv} = this.geometry.attributes;
    position.array.set(xyz);
    const errors = new Float32Array(sections.error), status = new Uint8Array(sections.status),
          pixels = new Float32Array(sections.uv);
    for (let v = 0; v < status.length; ++v) {
      color.array.set(
          by === 'tissue'     ? [1, 1, 1] :
              by === 'status' ? statusColours[status[v]] :
                                valueColour(errors[v] / kTopErrorMm),
          3 * v);
      uv.array[2 * v] = (pixels[2 * v] + 0.5) / header.width;
      uv.array[2 * v + 1] = 1 - (pixels[2 * v + 1] + 0.5) / header.height;
    }
    for (const attribute of [position, color, uv]) attribute.needsUpdate = true;
    this.geometry.setIndex(completeTriangles(this.triangles, xyz));
    this.geometry.computeVertexNormals();
    this.wires.visible = byId('mesh-lines').checked;
    this.useTexture(by === 'tissue' ? bitmap : null);
    if (this.isPlaced) return;
    this.isPlaced = true;
    this.enclose(
        xyz, new Float32Array(sections.plan_xyz ?? 0), ...targets.map(({centre}) => centre));
    this.look(0.4, 0.45);
  }

  useTexture(bitmap) {
    if (bitmap) {
      const canvas = this.texture.image;
      if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) {
        canvas.width = bitmap.width;
        canvas.height = bitmap.height;
        this.texture.dispose();
      }
      canvas.getContext('2d').drawImage(bitmap, 0, 0);
      this.texture.needsUpdate = true;
    }
    const map = bitmap ? this.texture : null;
    if (this.material.map === map) return;
    this.material.map = map;
    this.material.needsUpdate = true;
    this.pace.begin();
  }

  /**
   * What holds in the newest frame, also while 3D is of one before. No number of a part, which
   * would be taken for that of the picture above.
   */
  showLegend(withTargets, parts) {
    const by = byId('colour-by').value;
    const textOf = (part) => part.name +
        (hasPlace(part)          ? '' :
             isPartlyKnown(part) ? ': partly known' :
                                   ': not placed');
    const scale = JSON.stringify([by, withTargets, parts.map(textOf)]);
    if (this.scale === scale) return;
    this.scale = scale;
    const swatch = (colour) => element('span', {class: 'swatch', style: `background: ${colour}`});
    const ofParts = by === 'error' ?
        [] :
        parts.map((part) => element('span', {}, partSwatch(part), textOf(part)));
    const ofTargets = withTargets ?
        [element('span', {}, swatch(targetColour), 'targets: expected error, true size')] :
        [];
    byId('legend').replaceChildren(
        ...ofParts, ...ofTargets,
        ...(by === 'status' ?
                statuses.map(({colour}, i) => element('span', {}, swatch(colour), statusWords[i])) :
                by === 'error' ?
                [
                  element('span', {}, '0'),
                  element('span', {class: 'ramp', style: `background: ${rampGradient}`}),
                  element('span', {}, `${kTopErrorMm} mm`)
                ] :
                []));
  }
}

/** null where this browser has no WebGL. */
export function openSurface() {
  try {
    return new LiveSurface(byId('view'));
  } catch {
    byId('no-surface').textContent =
        'This browser has no WebGL, which the 3D view needs. The rest of the page works without.';
    return null;
  }
}
