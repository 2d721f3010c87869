// SPDX-License-Identifier: MIT
import { Matrix, Vector } from "./report";

export const add = (a: Vector, b: Vector): Vector => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const subtract = (a: Vector, b: Vector): Vector => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a: Vector, s: number): Vector => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const length = (a: Vector): number => Math.hypot(a[0], a[1], a[2]);
export const distance = (a: Vector, b: Vector): number => length(subtract(a, b));
export const cross = (a: Vector, b: Vector): Vector => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
export function normalize(a: Vector): Vector {
  const l = length(a);
  return l > 0 ? scale(a, 1 / l) : a;
}
export const mix = (a: Vector, b: Vector, s: number): Vector => add(scale(a, 1 - s), scale(b, s));

// Turns `a` about the unit `axis` by an angle (Rodrigues).
export function turn(a: Vector, axis: Vector, angle: number): Vector {
  const c = Math.cos(angle), s = Math.sin(angle);
  return add(add(scale(a, c), scale(cross(axis, a), s)), scale(axis, dot(axis, a) * (1 - c)));
}

// Row k of a row-major 3x3 matrix.
export const row = (m: Matrix, k: number): Vector => [m[3 * k], m[3 * k + 1], m[3 * k + 2]];

// The rotation whose rows are the camera's axes (right, down, forward) in the world, with `forward`
// as given and right as level as `up` allows.
export function lookAlong(forward: Vector, up: Vector): Matrix {
  const z = normalize(forward);
  let x = cross(z, up);
  if (length(x) < 1e-6) x = cross(z, Math.abs(z[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0]);
  x = normalize(x);
  const y = cross(z, x);
  return [...x, ...y, ...z];
}

// The rotation nearest to the mean of two, for flights.
export function mixRotations(a: Matrix, b: Matrix, s: number): Matrix {
  const z = normalize(mix(row(a, 2), row(b, 2), s));
  const x0 = mix(row(a, 0), row(b, 0), s);
  const x = normalize(subtract(x0, scale(z, dot(x0, z))));
  return [...x, ...cross(z, x), ...z];
}
