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

export function readFoam(bytes: Uint8Array, header: FoamHeader): FoamData {
  const floats = (begin: number, count: number) => new Float32Array(bytes.buffer, begin, count);
  const data: FoamData = {
    header,
    positions: floats(0, 3 * header.num_cells),
    classifier: floats(header.classifier_begin, 17 * header.num_classes),
    records: bytes.subarray(header.records_begin, header.identities_begin),
    identities: bytes.subarray(header.identities_begin, header.neighbors_begin),
    offsets: new Uint32Array(header.num_cells + 1),
    // A number takes at least a byte.
    neighbors: new Uint32Array(header.bytes - header.neighbors_begin),
  };
  let next = header.neighbors_begin, end = 0;
  const read = (): number => {
    let value = 0;
    for (let shift = 0; ; shift += 7) {
      const byte = bytes[next++];
      value |= (byte & 127) << shift;
      if (byte < 128) return value >>> 0;
    }
  };
  for (let cell = 0; cell < header.num_cells; ++cell) {
    data.offsets[cell] = end;
    const count = read();
    data.neighbors[end++] = count;
    let index = -1;
    for (let k = 0; k < count; ++k) data.neighbors[end++] = index += read();
  }
  data.offsets[header.num_cells] = end;
  data.neighbors = data.neighbors.slice(0, end);
  return data;
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
