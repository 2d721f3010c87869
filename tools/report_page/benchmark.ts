// SPDX-License-Identifier: MIT
//
// How fast this browser draws the foam, beside what its processor's cores could do walking one ray
// after the other: on a software renderer, which has no other means, that bounds it. Shown by
// report.html#benchmark.
import { FoamData, nearestCell } from "./foam_data";
import { Draw, Target, rayDirection } from "./foam_renderer";
import { Report, Vector } from "./report";
import { Viewer } from "./viewer";

export interface Benchmark {
  width: number;
  height: number;
  // Pictures drawn, of one ray a pixel.
  frames_per_second: number;
  cells_per_ray: number;
  faces_per_ray: number;
  // The same rays by a scalar walk, on all threads.
  threads: number;
  scalar_frames_per_second: number;
  share: number;
}

const kWidth = 160, kHeight = 120;

// Walks a ray until it is opaque, and returns how many cells and faces it met. The sum of what it
// composites is kept from being optimised away by `sink`.
function walk(data: FoamData, densities: Float32Array, cutoff: number, origin: Vector, d: Vector, start: number, sink: Float64Array): void {
  const { positions, offsets, neighbors, header } = data;
  let cell = start, t = 0, tau = 0;
  for (;;) {
    const px = positions[3 * cell], py = positions[3 * cell + 1], pz = positions[3 * cell + 2];
    const rx = origin[0] - px, ry = origin[1] - py, rz = origin[2] - pz;
    let exit = Infinity, next = -1;
    const end = offsets[cell + 1];
    for (let k = offsets[cell] + 1; k < end; ++k) {
      const j = 3 * neighbors[k];
      const nx = positions[j] - px, ny = positions[j + 1] - py, nz = positions[j + 2] - pz;
      const nd = nx * d[0] + ny * d[1] + nz * d[2];
      if (nd <= 0) continue;
      const crossing = (0.5 * (nx * nx + ny * ny + nz * nz) - (rx * nx + ry * ny + rz * nz)) / nd;
      if (crossing < exit) {
        exit = crossing;
        next = neighbors[k];
      }
    }
    sink[0] += 1;
    sink[1] += end - offsets[cell] - 1;
    if (next < 0) return;
    const out = Math.max(t, exit);
    if (cell < header.num_sites) {
      const x = densities[cell] * (out - t);
      sink[2] += Math.exp(-tau) * (1 - Math.exp(-x));
      tau += x;
      if (tau >= cutoff) return;
    }
    t = out;
    cell = next;
  }
}

function half(bits: number): number {
  const exponent = (bits >> 10) & 31, fraction = bits & 1023;
  return exponent === 0 ? fraction * 2 ** -24 : (1 + fraction / 1024) * 2 ** (exponent - 15);
}

export function benchmark(viewer: Viewer, data: FoamData, report: Report): Benchmark {
  const { renderer } = viewer, gl = renderer.gl, target = new Target(gl);
  const pose = viewer.pose, lens = viewer.lens(kWidth, kHeight);
  target.resize(kWidth, kHeight);
  const draw = () => {
    renderer.draw(target, pose, lens, Draw.Foam);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  };
  draw();
  let frames = 0;
  const begin = performance.now();
  do {
    draw();
    ++frames;
  } while (performance.now() - begin < 2000);
  const frameRate = (1000 * frames) / (performance.now() - begin);
  target.free();

  const { header, records } = data, densities = new Float32Array(header.num_sites);
  for (let i = 0; i < header.num_sites; ++i) {
    const at = i * header.record_bytes;
    densities[i] = half(records[at] | (records[at + 1] << 8));
  }
  const start = nearestCell(data, pose.eye, 0), sink = new Float64Array(3);
  const cutoff = -Math.log(report.transmittance_cutoff);
  let rays = 0;
  const since = performance.now();
  do {
    for (let y = 0; y < kHeight; ++y) {
      for (let x = 0; x < kWidth; ++x) {
        walk(data, densities, cutoff, pose.eye, rayDirection(pose, lens, x + 0.5, y + 0.5), start, sink);
        ++rays;
      }
    }
  } while (performance.now() - since < 1000);
  const threads = navigator.hardwareConcurrency || 1;
  const scalar = (threads * 1000 * rays) / (performance.now() - since) / (kWidth * kHeight);
  return {
    width: kWidth,
    height: kHeight,
    frames_per_second: frameRate,
    cells_per_ray: sink[0] / rays,
    faces_per_ray: sink[1] / rays,
    threads,
    scalar_frames_per_second: scalar,
    share: frameRate / scalar,
  };
}
