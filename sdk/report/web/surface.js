// The surface in 3D: turned with the mouse, stepped through time with the slider.
import * as THREE from 'three';
import {partColour, rampGradient, statuses, unknownStatus, wordOfState} from './colours.js';
import {
  byId,
  decodeEllipsoids,
  element,
  isPlaced,
  number,
  positions,
  roundUp,
  seconds
} from './data.js';
import {
  completeTriangles,
  copies,
  place,
  seeThrough,
  Stage,
  statusColours,
  valueColour
} from './stage.js';
import {stateChip} from './summary.js';
import {PlanMesh} from './plan_mesh.js';

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
  for (const value of values)
    if (value > result) result = value;
  return result;
}

/**
 * Decodes the moments once: positions, deformation from the template, expected error (mm; NaN not
 * known).
 */
function decode(surface) {
  const rest = positions(surface.rest);
  const moments = surface.moments.map((moment) => {
    if (!moment.points) return {...moment, xyz: null};
    const xyz = positions(moment.points);
    const still = withoutRigidMotion(xyz, moment.rigid);
    const deformation = new Float32Array(xyz.length / 3);
    for (let v = 0; v < deformation.length; ++v)
      deformation[v] = Math.hypot(
          still[3 * v] - rest[3 * v], still[3 * v + 1] - rest[3 * v + 1],
          still[3 * v + 2] - rest[3 * v + 2]);
    const inMm = (steps) =>
        steps && Float32Array.from(steps, (e) => (e === 255 ? NaN : e * surface.error_step_mm));
    const error = inMm(moment.error);
    const ellipsoids = decodeEllipsoids(moment.ellipsoids, surface.shape_step_mm).filter(isPlaced);
    return {
      ...moment,
      xyz,
      still,
      deformation,
      error,
      ellipsoids,
      plan: moment.plan && {xyz: positions(moment.plan), error: inMm(moment.plan_error)},
      targets: moment.targets.filter(isPlaced)
    };
  });
  return {rest, moments};
}

function colourings(surface, moments) {
  const list = [];
  if (surface.texture) list.push({key: 'texture', name: 'tissue (template image)'});
  list.push({key: 'status', name: 'status'});
  if (moments.some((m) => m.error)) {
    const values = moments.flatMap((m) => [m.error, m.plan?.error].filter(Boolean).map(largest));
    list.push({key: 'error', name: 'expected error', top: roundUp(largest(values))});
  }
  list.push({
    key: 'deformation',
    name: 'deformation',
    top: roundUp(largest(moments.flatMap((m) => (m.xyz ? [largest(m.deformation)] : []))))
  });
  return list;
}

function vertexColour(coloring, moment, vertex) {
  if (coloring.key === 'texture') return [1, 1, 1];
  if (coloring.key === 'status') return statusColours[moment.status[vertex]];
  const value = (coloring.key === 'error' ? moment.error : moment.deformation)?.[vertex];
  if (value === undefined || Number.isNaN(value)) return statusColours[unknownStatus];
  return valueColour(value / coloring.top);
}

const swatch = (colour, name) =>
    element('span', {}, element('span', {class: 'swatch', style: `background: ${colour}`}), name);

/**
 * A box for each part of a plan that has several. Returns whether a part is shown, by its place.
 */
function partBoxes(parts, onChange) {
  if (parts.length < 2) return () => true;
  const boxes = parts.map(({name}, i) => {
    const box = element('input', {type: 'checkbox', checked: ''});
    box.addEventListener('change', onChange);
    byId('plan-parts').append(element('label', {}, box, ' ', swatch(partColour(i), name)));
    return box;
  });
  return (i) => boxes[i].checked;
}

function showLegend(coloring, enlarged, withTargets, parts) {
  const legend = byId('legend');
  legend.replaceChildren();
  if (enlarged)
    legend.append(element(
        'span', {}, `ellipsoids: one standard deviation${enlarged > 1 ? `, ${enlarged} ×` : ''}`));
  if (withTargets) legend.append(element('span', {}, 'targets: one standard deviation, true size'));
  if (coloring.key !== 'error' && parts.length === 1)
    parts.forEach(({name}, i) => legend.append(swatch(partColour(i), name)));
  if (coloring.key === 'status')
    for (const {name, colour} of statuses) legend.append(swatch(colour, name));
  else if (coloring.key !== 'texture')
    legend.append(
        element('span', {}, '0'),
        element('span', {class: 'ramp', style: `background: ${rampGradient}`}),
        element('span', {}, `${coloring.top} mm`));
}

/** Copies of a shape, as many as are to be shown in any moment, that may be held still. */
function movable(shape, lists, opacity) {
  const made = copies(shape, Math.max(0, ...lists.map((list) => list?.length ?? 0)), opacity);
  made.matrixAutoUpdate = false;
  return made;
}

/** shapeOf: from an ellipsoid to the matrix of its copy. */
function placeIn(made, list, shapeOf, moment, holdStill) {
  place(made, list, shapeOf, ({status}) => statuses[status].colour);
  made.matrix.identity();
  if (holdStill && moment.rigid) made.matrix.set(...moment.rigid, 0, 0, 0, 1).invert();
  made.matrixWorldNeedsUpdate = true;
}

class Scene extends Stage {
  constructor(canvas, surface, rest, moments) {
    super(canvas);
    this.geometry = new THREE.BufferGeometry();
    this.geometry.setAttribute(
        'position', new THREE.BufferAttribute(new Float32Array(rest.length), 3));
    this.geometry.setAttribute(
        'color', new THREE.BufferAttribute(new Float32Array(rest.length), 3));
    if (surface.texture)
      this.geometry.setAttribute('uv', new THREE.BufferAttribute(surface.texture_uv, 2));
    this.material = new THREE.MeshLambertMaterial({vertexColors: true, side: THREE.DoubleSide});
    this.lines = new THREE.MeshBasicMaterial(
        {color: 0x0f172a, wireframe: true, transparent: true, opacity: 0.28});
    this.mesh = new THREE.Mesh(this.geometry, this.material);
    this.wires = new THREE.Mesh(this.geometry, this.lines);
    this.wires.visible = false;
    const sphere = new THREE.SphereGeometry(1, 16, 12);
    const targets = moments.map((m) => m.targets);
    this.ellipsoids = movable(sphere, moments.map((m) => m.ellipsoids), 0.75);
    this.targets = movable(sphere, targets, 0.35);
    this.marks = movable(new THREE.OctahedronGeometry(0.5), targets, 1);
    this.plan = surface.plan && new PlanMesh(surface.plan);
    this.group.add(this.mesh, this.wires, this.ellipsoids, this.marks, this.targets);
    if (this.plan) this.group.add(this.plan.mesh);
    this.enclose(
        rest, ...moments.flatMap((m) => (m.xyz ? [m.xyz] : [])),
        ...moments.flatMap((m) => (m.plan ? [m.plan.xyz] : [])),
        ...targets.flat().map(({centre}) => centre));
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
    placeIn(this.ellipsoids, list, ({shape}) => shape.map((s) => s * enlarged), moment, holdStill);
    this.canvas.dataset.ellipsoids = list.length;
    this.render();
  }

  /** isShown: of a part, by its place. */
  showPlan(moment, shown, coloring, holdStill, isShown) {
    if (!this.plan) return;
    const triangles =
        this.plan.show(shown && moment.xyz ? moment : null, coloring, holdStill, isShown);
    this.canvas.dataset.plan = triangles;
    this.canvas.dataset.outer = this.plan.seenThrough;
    this.render();
  }

  showTargets(moment, shown, holdStill) {
    const list = shown && moment.xyz ? moment.targets : [];
    placeIn(this.targets, list, ({shape}) => shape, moment, holdStill);
    placeIn(this.marks, list, () => [1, 0, 0, 0, 1, 0, 0, 0, 1], moment, holdStill);
    this.canvas.dataset.targets = list.length;
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
  for (const id
           of ['play', 'moment', 'colour-by', 'mesh-lines', 'hold-still', 'ellipsoids', 'show-plan',
               'show-targets', 'see-through', 'front-view'])
    byId(id).disabled = true;
  return {select() {}};
}

function readout(moment) {
  byId('readout').replaceChildren(
      stateChip(moment.state), element('span', {}, `frame ${moment.frame}`),
      element('span', {}, seconds(moment.ms)),
      element('span', {}, `mean residual ${number(moment.residual_mm)} mm`));
  byId('moment-label').textContent = `frame ${moment.frame} · ${seconds(moment.ms)}`;
  byId('moment').setAttribute(
      'aria-valuetext', `frame ${moment.frame}, ${wordOfState(moment.state)}`);
  byId('no-surface').hidden = Boolean(moment.xyz);
  byId('no-surface').textContent = `No surface in this frame: ${wordOfState(moment.state)}`;
}

export async function showSurface({surface}, onMoment) {
  if (!surface || !surface.moments.length)
    return noSurface('No template was captured, so there is no surface to show.');
  const {rest, moments} = decode(surface);
  let scene;
  try {
    scene = new Scene(byId('view'), surface, rest, moments);
  } catch {
    return noSurface(
        'This browser has no WebGL, which the 3D view needs. The rest of the page works without.');
  }
  if (surface.texture) scene.setTexture(await loadImage(surface.texture));

  const choices = colourings(surface, moments);
  byId('colour-by').append(...choices.map((c) => element('option', {value: c.key}, c.name)));
  const slider = byId('moment');
  slider.max = moments.length - 1;
  const update = () => {
    const moment = moments[slider.value];
    const coloring = choices.find((c) => c.key === byId('colour-by').value);
    scene.wires.visible = byId('mesh-lines').checked;
    const holdStill = byId('hold-still').checked;
    const enlarged = Number(byId('ellipsoids').value);
    const withTargets = Boolean(surface.targets || surface.plan) && byId('show-targets').checked;
    const withPlan = Boolean(surface.plan) && byId('show-plan').checked;
    seeThrough(scene.material, (withTargets || withPlan) && byId('see-through').checked);
    scene.show(moment, surface.triangles, coloring, holdStill);
    scene.showEllipsoids(moment, enlarged, holdStill);
    scene.showTargets(moment, withTargets, holdStill);
    scene.showPlan(moment, withPlan, coloring, holdStill, isPartShown);
    byId('plan-parts').hidden = !withPlan;
    byId('plan-parts').classList.toggle('without-colours', coloring.key === 'error');
    showLegend(coloring, enlarged, withTargets, withPlan ? surface.plan.parts : []);
    readout(moment);
    onMoment(moment.frame);
  };

  const isPartShown = partBoxes(surface.plan?.parts ?? [], () => update());
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
  slider.addEventListener('input', () => {
    stop();
    update();
  });
  byId('target-controls').hidden = !surface.targets && !surface.plan;
  byId('plan-control').hidden = !surface.plan;
  for (const id
           of ['colour-by', 'mesh-lines', 'hold-still', 'ellipsoids', 'show-plan', 'show-targets',
               'see-through'])
    byId(id).addEventListener('change', update);
  byId('front-view').addEventListener('click', () => scene.look(0, 0));
  const first = moments.findIndex((m) => m.xyz);
  slider.value = Math.max(first, 0);
  update();

  return {
    /** Shows the moment nearest to a frame. */
    select(frame) {
      stop();
      let nearest = 0;
      moments.forEach((m, i) => {
        if (Math.abs(m.frame - frame) < Math.abs(moments[nearest].frame - frame)) nearest = i;
      });
      slider.value = nearest;
      update();
    },
  };
}
