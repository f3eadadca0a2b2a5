// The surface in 3D: turned with the mouse, stepped through time with the slider.
import * as THREE from 'three';
import { rampGradient, statuses, unknownStatus } from './colours.js';
import { byId, element, number, positions, seconds } from './data.js';
import { completeTriangles, Stage, statusColours, valueColour } from './stage.js';
import { stateChip } from './summary.js';

const kFrameMs = 90;

/** Undoes the rigid motion [R | t]: back into the template's frame. */
function withoutRigidMotion(xyz, m) {
  const result = new Float32Array(xyz.length);
  for (let i = 0; i < xyz.length; i += 3) {
    const x = xyz[i] - m[3], y = xyz[i + 1] - m[7], z = xyz[i + 2] - m[11];
    for (let k = 0; k < 3; ++k) result[i + k] = m[k] * x + m[4 + k] * y + m[8 + k] * z;
  }
  return result;
}

function largest(values) {
  let result = 0;
  for (const value of values) if (value > result) result = value;
  return result;
}

/** A round number at or above the value: 1, 2 or 5 times a power of ten. */
function roundUp(value) {
  const power = 10 ** Math.floor(Math.log10(Math.max(value, 1e-3)));
  return [1, 2, 5, 10].map((n) => n * power).find((n) => n >= value * 0.999);
}

/** Affine matrices that map the unit sphere to the ellipsoids, in the camera of the moment; lost points are left out. */
function decodeEllipsoids(ellipsoids, step) {
  if (!ellipsoids) return [];
  const centres = positions(ellipsoids.points);
  return Array.from(ellipsoids.status, (status, i) => {
    const [a, b, d, c, e, f] = Array.from(ellipsoids.shapes.subarray(6 * i, 6 * i + 6), (s) => s * step);
    return { status, centre: centres.subarray(3 * i, 3 * i + 3), shape: [a, 0, 0, b, d, 0, c, e, f] };
  }).filter(({ centre }) => !Number.isNaN(centre[0]));
}

/** Decodes the moments once: positions, deformation from the template, expected error (mm; NaN not known). */
function decode(surface) {
  const rest = positions(surface.rest);
  const moments = surface.moments.map((moment) => {
    if (!moment.points) return { ...moment, xyz: null };
    const xyz = positions(moment.points);
    const still = withoutRigidMotion(xyz, moment.rigid);
    const deformation = new Float32Array(xyz.length / 3);
    for (let v = 0; v < deformation.length; ++v)
      deformation[v] = Math.hypot(still[3 * v] - rest[3 * v], still[3 * v + 1] - rest[3 * v + 1], still[3 * v + 2] - rest[3 * v + 2]);
    const error = moment.error && Float32Array.from(moment.error, (e) => (e === 255 ? NaN : e * surface.error_step_mm));
    return { ...moment, xyz, still, deformation, error, ellipsoids: decodeEllipsoids(moment.ellipsoids, surface.shape_step_mm) };
  });
  return { rest, moments };
}

function colourings(surface, moments) {
  const list = [];
  if (surface.texture) list.push({ key: 'texture', name: 'tissue (template image)' });
  list.push({ key: 'status', name: 'status' });
  if (moments.some((m) => m.error)) {
    const values = moments.flatMap((m) => (m.error ? [largest(m.error)] : []));
    list.push({ key: 'error', name: 'expected error', top: roundUp(largest(values)) });
  }
  list.push({ key: 'deformation', name: 'deformation', top: roundUp(largest(moments.flatMap((m) => (m.xyz ? [largest(m.deformation)] : [])))) });
  return list;
}

function vertexColour(coloring, moment, vertex) {
  if (coloring.key === 'texture') return [1, 1, 1];
  if (coloring.key === 'status') return statusColours[moment.status[vertex]];
  const value = (coloring.key === 'error' ? moment.error : moment.deformation)?.[vertex];
  if (value === undefined || Number.isNaN(value)) return statusColours[unknownStatus];
  return valueColour(value / coloring.top);
}

function showLegend(coloring, enlarged) {
  const legend = byId('legend');
  legend.replaceChildren();
  if (enlarged) legend.append(element('span', {}, `ellipsoids: one standard deviation${enlarged > 1 ? `, ${enlarged} ×` : ''}`));
  if (coloring.key === 'status')
    for (const { name, colour } of statuses)
      legend.append(element('span', {}, element('span', { class: 'swatch', style: `background: ${colour}` }), name));
  else if (coloring.key !== 'texture')
    legend.append(element('span', {}, '0'), element('span', { class: 'ramp', style: `background: ${rampGradient}` }), element('span', {}, `${coloring.top} mm`));
}

class Scene extends Stage {
  constructor(canvas, surface, rest, moments) {
    super(canvas);
    this.geometry = new THREE.BufferGeometry();
    this.geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(rest.length), 3));
    this.geometry.setAttribute('color', new THREE.BufferAttribute(new Float32Array(rest.length), 3));
    if (surface.texture) this.geometry.setAttribute('uv', new THREE.BufferAttribute(surface.texture_uv, 2));
    this.material = new THREE.MeshLambertMaterial({ vertexColors: true, side: THREE.DoubleSide });
    this.lines = new THREE.MeshBasicMaterial({ color: 0x0f172a, wireframe: true, transparent: true, opacity: 0.28 });
    this.mesh = new THREE.Mesh(this.geometry, this.material);
    this.wires = new THREE.Mesh(this.geometry, this.lines);
    this.wires.visible = false;
    const most = Math.max(1, ...moments.map((m) => m.ellipsoids?.length ?? 0));
    this.ellipsoids = new THREE.InstancedMesh(new THREE.SphereGeometry(1, 16, 12), new THREE.MeshLambertMaterial({ transparent: true, opacity: 0.75 }), most);
    this.ellipsoids.matrixAutoUpdate = false;
    this.ellipsoids.frustumCulled = false;
    this.group.add(this.mesh, this.wires, this.ellipsoids);
    this.enclose(rest, ...moments.flatMap((m) => (m.xyz ? [m.xyz] : [])));
    this.fill();
    this.look(0.4, 0.45);
  }

  setTexture(image) {
    this.texture = new THREE.Texture(image);
    this.texture.colorSpace = THREE.SRGBColorSpace;
    this.texture.needsUpdate = true;
  }

  show(moment, triangles, coloring, holdStill) {
    const visible = Boolean(moment?.xyz);
    this.group.visible = visible;
    if (visible) {
      const source = holdStill ? moment.still : moment.xyz;
      const position = this.geometry.attributes.position.array;
      const colour = this.geometry.attributes.color.array;
      for (let v = 0; v < source.length / 3; ++v) {
        const missing = Number.isNaN(source[3 * v]);
        for (let k = 0; k < 3; ++k) position[3 * v + k] = missing ? 0 : source[3 * v + k];
        colour.set(vertexColour(coloring, moment, v), 3 * v);
      }
      this.geometry.setIndex(completeTriangles(triangles, source));
      this.geometry.attributes.position.needsUpdate = true;
      this.geometry.attributes.color.needsUpdate = true;
      this.geometry.computeVertexNormals();
      this.geometry.computeBoundingSphere();
      const map = coloring.key === 'texture' ? this.texture ?? null : null;
      if (this.material.map !== map) {
        this.material.map = map;
        this.material.needsUpdate = true;
      }
    }
    this.render();
  }

  /** enlarged: factor on their axes; 0: none. */
  showEllipsoids(moment, enlarged, holdStill) {
    const list = enlarged && moment.xyz ? moment.ellipsoids : [];
    list.forEach(({ status, centre: [x, y, z], shape }, i) => {
      const [xx, xy, xz, yx, yy, yz, zx, zy, zz] = shape.map((s) => s * enlarged);
      this.ellipsoids.setMatrixAt(i, new THREE.Matrix4(xx, xy, xz, x, yx, yy, yz, y, zx, zy, zz, z, 0, 0, 0, 1));
      this.ellipsoids.setColorAt(i, new THREE.Color(statuses[status].colour));
    });
    this.ellipsoids.count = list.length;
    this.ellipsoids.matrix.identity();
    if (holdStill && moment.rigid) this.ellipsoids.matrix.set(...moment.rigid, 0, 0, 0, 1).invert();
    this.ellipsoids.matrixWorldNeedsUpdate = true;
    this.ellipsoids.instanceMatrix.needsUpdate = true;
    if (this.ellipsoids.instanceColor) this.ellipsoids.instanceColor.needsUpdate = true;
    this.canvas.dataset.ellipsoids = list.length;
    this.render();
  }
}

function loadImage(base64) {
  return new Promise((resolve, reject) => {
    const image = new Image();
    image.onload = () => resolve(image);
    image.onerror = () => reject(new Error('the template image does not decode'));
    image.src = `data:image/jpeg;base64,${base64}`;
  });
}

function noSurface(reason) {
  byId('no-surface').hidden = false;
  byId('no-surface').textContent = reason;
  byId('surface').classList.add('empty');
  for (const id of ['play', 'moment', 'colour-by', 'mesh-lines', 'hold-still', 'ellipsoids', 'front-view']) byId(id).disabled = true;
  return { select() {} };
}

function readout(moment) {
  byId('readout').replaceChildren(
    stateChip(moment.state), element('span', {}, `frame ${moment.frame}`), element('span', {}, seconds(moment.ms)),
    element('span', {}, `residual ${number(moment.residual_mm)} mm`));
  byId('moment-label').textContent = `frame ${moment.frame} · ${seconds(moment.ms)}`;
  byId('moment').setAttribute('aria-valuetext', `frame ${moment.frame}, ${moment.state}`);
  byId('no-surface').hidden = Boolean(moment.xyz);
  byId('no-surface').textContent = `No surface in this frame (${moment.state})`;
}

export async function showSurface({ surface }, onMoment) {
  if (!surface || !surface.moments.length) return noSurface('No template was captured, so there is no surface to show.');
  const { rest, moments } = decode(surface);
  let scene;
  try {
    scene = new Scene(byId('view'), surface, rest, moments);
  } catch {
    return noSurface('This browser has no WebGL, which the 3D view needs. The rest of the page works without.');
  }
  if (surface.texture) scene.setTexture(await loadImage(surface.texture));

  const choices = colourings(surface, moments);
  byId('colour-by').append(...choices.map((c) => element('option', { value: c.key }, c.name)));
  const slider = byId('moment');
  slider.max = moments.length - 1;
  const update = () => {
    const moment = moments[slider.value];
    const coloring = choices.find((c) => c.key === byId('colour-by').value);
    scene.wires.visible = byId('mesh-lines').checked;
    const holdStill = byId('hold-still').checked;
    const enlarged = Number(byId('ellipsoids').value);
    scene.show(moment, surface.triangles, coloring, holdStill);
    scene.showEllipsoids(moment, enlarged, holdStill);
    showLegend(coloring, enlarged);
    readout(moment);
    onMoment(moment.frame);
  };

  let timer = 0;
  const stop = () => {
    clearInterval(timer);
    timer = 0;
    byId('play').textContent = 'Play';
    byId('play').setAttribute('aria-pressed', 'false');
  };
  byId('play').addEventListener('click', () => {
    if (timer) return stop();
    byId('play').textContent = 'Pause';
    byId('play').setAttribute('aria-pressed', 'true');
    timer = setInterval(() => {
      slider.value = (Number(slider.value) + 1) % moments.length;
      update();
    }, kFrameMs);
  });
  slider.addEventListener('input', () => { stop(); update(); });
  for (const id of ['colour-by', 'mesh-lines', 'hold-still', 'ellipsoids']) byId(id).addEventListener('change', update);
  byId('front-view').addEventListener('click', () => scene.look(0, 0));
  const first = moments.findIndex((m) => m.xyz);
  slider.value = Math.max(first, 0);
  update();

  return {
    /** Shows the moment nearest to a frame. */
    select(frame) {
      stop();
      let nearest = 0;
      moments.forEach((m, i) => { if (Math.abs(m.frame - frame) < Math.abs(moments[nearest].frame - frame)) nearest = i; });
      slider.value = nearest;
      update();
    },
  };
}
