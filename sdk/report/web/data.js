// Reads the data that page_json.cpp wrote, and small helpers for showing it.
function bytes(base64) {
  const text = atob(base64);
  const result = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) result[i] = text.charCodeAt(i);
  return result;
}
const floats = (base64) => new Float32Array(bytes(base64).buffer);
const gaps = (values) => Array.from(values, (v) => (Number.isFinite(v) ? v : null));

/** Positions as a Float32Array; NaN where there is none. */
export function positions(points) {
  const steps = new Uint16Array(bytes(points.xyz).buffer);
  const result = new Float32Array(steps.length);
  for (let i = 0; i < steps.length; ++i) {
    const none = steps[i - (i % 3)] === 65535;
    result[i] = none ? NaN : points.lowest[i % 3] + steps[i] * points.step[i % 3];
  }
  return result;
}

/**
 * Per point status, centre, the affine matrix that maps the unit sphere to its ellipsoid, and the
 * expected error (mm). A lost point's centre is NaN.
 */
export function decodeEllipsoids(ellipsoids, step) {
  if (!ellipsoids) return [];
  const centres = positions(ellipsoids.points);
  return Array.from(ellipsoids.status, (status, i) => {
    const lower = Array.from(ellipsoids.shapes.subarray(6 * i, 6 * i + 6), (s) => s * step);
    const [a, b, d, c, e, f] = lower;
    return {
      status,
      centre: centres.subarray(3 * i, 3 * i + 3),
      shape: [a, 0, 0, b, d, 0, c, e, f],
      error: Math.hypot(...lower)
    };
  });
}

export const isPlaced = ({centre}) => !Number.isNaN(centre[0]);

/** A round number at or above the value: 1, 2 or 5 times a power of ten. */
export function roundUp(value) {
  const power = 10 ** Math.floor(Math.log10(Math.max(value, 1e-3)));
  return [1, 2, 5, 10].map((n) => n * power).find((n) => n >= value * 0.999);
}

export function readData() {
  const data = JSON.parse(document.getElementById('data').textContent);
  const series = data.series;
  series.ms = Array.from(new Float64Array(bytes(series.ms).buffer));
  series.lines = new Map(series.lines.map((line) => [line.name, gaps(floats(line.values))]));
  for (const moment of [data.points, data.plan].flatMap((points) => points?.moments ?? [])) {
    moment.status = bytes(moment.status);
    moment.xyz = positions(moment.points);
    moment.uv = new Int16Array(bytes(moment.uv).buffer);
    moment.error = new Uint16Array(bytes(moment.error).buffer);
    moment.largest = new Uint16Array(bytes(moment.largest).buffer);
  }
  if (data.surface) {
    const surface = data.surface;
    surface.triangles = new Uint32Array(bytes(surface.triangles).buffer);
    surface.texture_uv = floats(surface.texture_uv);
    if (surface.plan)
      surface.plan.triangles = new Uint32Array(bytes(surface.plan.triangles).buffer);
    for (const moment of surface.moments) {
      if (moment.status) moment.status = bytes(moment.status);
      if (moment.error) moment.error = bytes(moment.error);
      if (moment.plan_error) moment.plan_error = bytes(moment.plan_error);
      for (const list of [moment.ellipsoids, moment.targets, moment.plan_targets]) {
        if (!list) continue;
        list.shapes = new Int16Array(bytes(list.shapes).buffer);
        list.status = bytes(list.status);
      }
      moment.targets = [moment.targets, moment.plan_targets].flatMap(
          (list) => decodeEllipsoids(list, surface.shape_step_mm));
    }
  }
  return data;
}

export const byId = (id) => document.getElementById(id);

/** An element with attributes and children; strings become text, never markup. */
export function element(name, attributes = {}, ...children) {
  const result = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) result.setAttribute(key, value);
  result.append(...children);
  return result;
}

export function number(value, digits = 2) {
  return value === null || value === undefined || !Number.isFinite(value) ? '–' :
                                                                            value.toFixed(digits);
}
export const seconds = (ms) => `${number(ms / 1000, ms < 100000 ? 2 : 1)} s`;
export const milliseconds = (ms) => `${number(ms, ms < 1 ? 3 : ms < 10 ? 2 : 1)} ms`;
export const percent = (share) =>
    (share > 0.9995 || share < 0.0005 ? number(100 * share, 0) : number(100 * share, 1)) + ' %';

/** A colour of the style's palette, in the scheme that the page has now. */
export function paletteColour(name) {
  const probe = element('span', {style: `color: var(${name})`});
  document.body.append(probe);
  const {color} = getComputedStyle(probe);
  probe.remove();
  return color;
}

export function table(head, rows) {
  // Each cell knows its head, for where there is no room for columns.
  const body = rows.map(
      (row) =>
          element('tr', {}, ...row.map((cell, k) => element('td', {'data-head': head[k]}, cell))));
  const heads = head.map((text) => element('th', {scope: 'col'}, text));
  return element(
      'table', {}, element('thead', {}, element('tr', {}, ...heads)),
      element('tbody', {}, ...body));
}
