// Small drawings: elements of SVG, and round numbers beside an axis.
import {roundUp} from './data.js';

export function svg(name, attributes, ...children) {
  const result = document.createElementNS('http://www.w3.org/2000/svg', name);
  for (const [key, value] of Object.entries(attributes)) result.setAttribute(key, value);
  result.append(...children);
  return result;
}

/** Multiples of a round step, about five, from low to high. */
export function ticks(low, high) {
  const step = roundUp((high - low) / 6);
  const result = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; ++i)
    result.push(i * step);
  return {step, values: result};
}

export const tickLabel = (value) => `${+ value.toFixed(6)}`;
