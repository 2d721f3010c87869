// SPDX-License-Identifier: MIT
import { FoamHeader, Vector } from "./report";

// A foam as the program packed it (tools/report/foam_pack.h), ready to be uploaded and searched.
export interface FoamData {
  header: FoamHeader;
  // [num_cells][3]
  positions: Float32Array;
  // [num_classes][17]
  classifier: Float32Array;
  // [num_sites][record_bytes]
  records: Uint8Array;
  // [num_sites][16], or nothing
  identities: Uint8Array;
  // For each cell where its list in `neighbors` begins: how many, then which.
  offsets: Uint32Array;
  neighbors: Uint32Array;
}

function base64Bytes(text: string): Uint8Array {
  const fromBase64 = (Uint8Array as unknown as { fromBase64?: (text: string) => Uint8Array }).fromBase64;
  if (fromBase64) return fromBase64(text);
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; ++i) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

// Unpacks the text of one of the page's elements into so many bytes, and says on the way how far it
// is, 0 to 1.
export async function unpack(
  text: string,
  size: number,
  progress: (share: number) => void = () => {},
): Promise<Uint8Array> {
  const packed = base64Bytes(text);
  const stream = new Blob([packed as BlobPart]).stream().pipeThrough(new DecompressionStream("gzip"));
  const bytes = new Uint8Array(size);
  const reader = stream.getReader();
  let have = 0;
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    bytes.set(value, have);
    have += value.length;
    progress(have / size);
  }
  if (have !== size) throw new Error("The data in this page are cut.");
  return bytes;
}

// Positions from the planes of bytes of their differences.
function readPositions(bytes: Uint8Array, count: number): Float32Array {
  const positions = new Float32Array(3 * count), bits = new Uint32Array(positions.buffer);
  for (let axis = 0; axis < 3; ++axis) {
    const [a, b, c, d] = [0, 1, 2, 3].map((k) => bytes.subarray((4 * axis + k) * count, (4 * axis + k + 1) * count));
    let value = 0;
    for (let i = 0; i < count; ++i) {
      const zigzag = a[i] | (b[i] << 8) | (c[i] << 16) | (d[i] << 24);
      value = (value + ((zigzag >>> 1) ^ -(zigzag & 1))) | 0;
      bits[3 * i + axis] = value;
    }
  }
  return positions;
}

// Lists of neighbours from those of higher index.
function readNeighbors(bytes: Uint8Array, begin: number, count: number): { offsets: Uint32Array; neighbors: Uint32Array } {
  let next = begin;
  const read = (): number => {
    let value = 0;
    for (let shift = 0; ; shift += 7) {
      const byte = bytes[next++];
      value |= (byte & 127) << shift;
      if (byte < 128) return value >>> 0;
    }
  };
  // A number takes at least a byte.
  const above = new Uint32Array(bytes.length - begin), sizes = new Uint32Array(count), offsets = new Uint32Array(count + 1);
  let edges = 0;
  for (let cell = 0; cell < count; ++cell) {
    const own = read();
    sizes[cell] = own;
    offsets[cell] += own;
    let index = cell;
    for (let k = 0; k < own; ++k) {
      index += read();
      above[edges++] = index;
      ++offsets[index];
    }
  }
  let end = 0;
  for (let cell = 0; cell < count; ++cell) {
    const begins = end;
    end += 1 + offsets[cell];
    offsets[cell] = begins;
  }
  offsets[count] = end;
  const neighbors = new Uint32Array(end);
  edges = 0;
  // neighbors[offsets[cell]] counts those that are there; it grows to their number.
  for (let cell = 0; cell < count; ++cell) {
    for (let k = 0; k < sizes[cell]; ++k) {
      const other = above[edges++];
      neighbors[offsets[cell] + ++neighbors[offsets[cell]]] = other;
      neighbors[offsets[other] + ++neighbors[offsets[other]]] = cell;
    }
  }
  return { offsets, neighbors };
}

export function readFoam(bytes: Uint8Array, header: FoamHeader): FoamData {
  return {
    header,
    positions: readPositions(bytes, header.num_cells),
    classifier: new Float32Array(bytes.buffer, header.classifier_begin, 17 * header.num_classes),
    records: bytes.subarray(header.records_begin, header.identities_begin),
    identities: bytes.subarray(header.identities_begin, header.neighbors_begin),
    ...readNeighbors(bytes, header.neighbors_begin, header.num_cells),
  };
}

// The cell whose site is nearest, by descent over the Delaunay graph from `start`: the graph has no
// local minima.
export function nearestCell(data: FoamData, query: Vector, start: number): number {
  const { positions, offsets, neighbors } = data;
  const squared = (cell: number) =>
    (positions[3 * cell] - query[0]) ** 2 +
    (positions[3 * cell + 1] - query[1]) ** 2 +
    (positions[3 * cell + 2] - query[2]) ** 2;
  // A duplicate of another site has no neighbours; a guard always has some.
  let cell = neighbors[offsets[start]] === 0 ? data.header.num_sites : start;
  let best = squared(cell);
  for (;;) {
    let better = cell;
    for (let k = offsets[cell] + 1; k < offsets[cell + 1]; ++k) {
      const s = squared(neighbors[k]);
      if (s < best) {
        best = s;
        better = neighbors[k];
      }
    }
    if (better === cell) return cell;
    cell = better;
  }
}
