// SPDX-License-Identifier: MIT
import { FoamData, nearestCell } from "./foam_data";
import { Matrix, PackedPositions, Report, Vector } from "./report";
import { dot, row, subtract } from "./vector";
import linesGlsl from "./lines.glsl";
import linesVertexGlsl from "./lines_vertex.glsl";
import meshGlsl from "./mesh.glsl";
import overlayVertexGlsl from "./overlay_vertex.glsl";
import showGlsl from "./show.glsl";
import walkGlsl from "./walk.glsl";

// Where a picture is taken from, in the normalised frame.
export interface Pose {
  eye: Vector;
  // Row-major; rows are the camera's axes: right, down, forward.
  camFromWorld: Matrix;
}

// A pinhole camera for a picture of some size; pixels as in Camera.
export interface Lens {
  fx: number;
  fy: number;
  cx: number;
  cy: number;
}

export enum Mode {
  Color,
  Labels,
  Confidence,
  Depth,
  Cells,
}

// Whether the objects' surfaces are drawn, over the foam or alone.
export enum Meshes {
  None,
  Over,
  Alone,
}

// What is drawn besides the foam, with its depth.
export interface Over {
  meshes: Meshes;
  points: boolean;
  // Lines, and the pictures of cameras but that of this index; nothing: no cameras.
  cameras?: { lines: Line[]; except: number };
  // Pixels of the target in a pixel of the screen.
  scale: number;
}

const kNothingOver: Over = { meshes: Meshes.None, points: false, scale: 1 };
// Identities from here on are those of cameras, and of points.
const kCameraIds = 0x10000000, kPointIds = 0x20000000;

// What the foam is drawn with: the labels of the cells that are seen, or those of the composited
// identities (slower, exact).
export enum Draw {
  Foam,
  FoamAndLabels,
}

// What a label shows of its matter, 0 to 255: of its object, and of its cells apart from it.
export interface LabelState {
  object: number;
  loose: number;
  // The label that it is shown as, where it was merged into another.
  root?: number;
}

const kShown: LabelState = { object: 255, loose: 255 };

// An object that is shown `offset` from its place, and the sphere around it there.
export interface Moved {
  offset: Vector;
  center: Vector;
  radius: number;
}

// Part of a picture, in pixels; y counts from below.
export interface Part {
  x: number;
  y: number;
  width: number;
  height: number;
}

export interface Line {
  from: Vector;
  to: Vector;
  color: [number, number, number, number];
  // Camera; nothing: none.
  camera?: number;
}

// A pair of textures that a walk fills.
export class Target {
  width = 0;
  height = 0;
  color: WebGLTexture | null = null;
  data: WebGLTexture | null = null;
  frame: WebGLFramebuffer | null = null;
  private depth: WebGLRenderbuffer | null = null;

  constructor(private gl: WebGL2RenderingContext) {}

  resize(width: number, height: number): boolean {
    if (width === this.width && height === this.height) return false;
    this.free();
    const gl = this.gl;
    this.width = width;
    this.height = height;
    this.color = texture(gl, gl.RGBA8, width, height, gl.LINEAR);
    this.data = texture(gl, gl.RGBA32UI, width, height, gl.NEAREST);
    this.frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.color, 0);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT1, gl.TEXTURE_2D, this.data, 0);
    this.depth = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, this.depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, this.depth);
    gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1]);
    return true;
  }

  free(): void {
    this.gl.deleteTexture(this.color);
    this.gl.deleteTexture(this.data);
    this.gl.deleteRenderbuffer(this.depth);
    this.gl.deleteFramebuffer(this.frame);
    this.width = this.height = 0;
  }
}

function texture(
  gl: WebGL2RenderingContext,
  format: number,
  width: number,
  height: number,
  filter: number = gl.NEAREST,
): WebGLTexture {
  const made = gl.createTexture()!;
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
  for (const [key, value] of [
    [gl.TEXTURE_MIN_FILTER, filter],
    [gl.TEXTURE_MAG_FILTER, filter],
    [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE],
    [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
  ]) {
    gl.texParameteri(gl.TEXTURE_2D, key, value);
  }
  return made;
}

class Program {
  readonly program: WebGLProgram;
  private places = new Map<string, WebGLUniformLocation | null>();

  constructor(private gl: WebGL2RenderingContext, vertex: string, fragment: string, defines = "") {
    this.program = gl.createProgram()!;
    for (const [kind, text] of [
      [gl.VERTEX_SHADER, vertex],
      [gl.FRAGMENT_SHADER, fragment],
    ] as [number, string][]) {
      const shader = gl.createShader(kind)!;
      gl.shaderSource(shader, `#version 300 es\n${defines}${text}`);
      gl.compileShader(shader);
      gl.attachShader(this.program, shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
        throw new Error(`A shader does not compile: ${gl.getShaderInfoLog(shader)}`);
      }
    }
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS) && !gl.isContextLost()) {
      throw new Error(`The shaders do not link: ${gl.getProgramInfoLog(this.program)}`);
    }
  }

  use(): this {
    this.gl.useProgram(this.program);
    return this;
  }

  place(name: string): WebGLUniformLocation | null {
    let found = this.places.get(name);
    if (found === undefined) this.places.set(name, (found = this.gl.getUniformLocation(this.program, name)));
    return found;
  }

  textures(textures: Record<string, WebGLTexture | null>): void {
    const gl = this.gl;
    Object.entries(textures).forEach(([name, one], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, one);
      gl.uniform1i(this.place(name), unit);
    });
  }
}

// Triangles of an object, or points, on the graphics processor.
interface Surface {
  array: WebGLVertexArrayObject;
  label: number;
  count: number;
  origin: Vector;
  step: Vector;
}

// One triangle over everything.
const kEverywhere = `
void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}`;

// What a pixel shows.
export interface Picked {
  // Class; -1: none.
  label: number;
  confidence: number;
  opacity: number;
  // Where the transmittance falls to 1/2, normalised; nothing where it does not.
  point?: Vector;
  distance: number;
  // -1: none.
  cell: number;
  // Camera or SfM point instead; -1: none.
  camera: number;
  sfmPoint: number;
}

// Draws a foam with WebGL2: walks it into a Target, and shows that.
export class FoamRenderer {
  readonly gl: WebGL2RenderingContext;
  private walk: Program;
  private shower: Program;
  private liner: Program;
  private pointer: Program;
  private sites: WebGLTexture;
  private neighbours: WebGLTexture;
  private records: WebGLTexture;
  private identities: WebGLTexture;
  private classifier: WebGLTexture;
  private states: WebGLTexture;
  private labelColors: WebGLTexture;
  private lineBuffer: WebGLBuffer;
  private lineArray: WebGLVertexArrayObject;
  private mesher: Program;
  private surfaces: Surface[] = [];
  private points: Surface | null = null;
  private pictures: Surface | null = null;
  private pictureTexture: WebGLTexture | null = null;
  private widthBits = 11;
  private lastCell = 0;
  private pixel: Target;
  background: Vector = [1, 1, 1];
  // Shows x where keep[0..2] . x >= keep[3].
  keep: [number, number, number, number] = [0, 0, 0, -1];
  // Objects that are shown elsewhere, by label.
  moved = new Map<number, Moved>();
  private labelStates: LabelState[] = [];

  constructor(private canvas: HTMLCanvasElement, private data: FoamData, private report: Report) {
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, preserveDrawingBuffer: true });
    if (!gl) throw new Error("no WebGL2");
    this.gl = gl;
    const most = gl.getParameter(gl.MAX_TEXTURE_SIZE) as number;
    while (1 << (this.widthBits + 1) <= Math.min(most, 8192)) ++this.widthBits;
    const { header } = data;
    const identityBytes = data.identities.length > 0;
    const coefficients = (header.sh_degree + 1) ** 2;
    this.walk = new Program(
      gl,
      kEverywhere,
      walkGlsl,
      `#define SH_COEFFICIENTS ${coefficients}\n#define RECORD_TEXELS ${header.record_bytes / 16}\n` +
        `#define HAS_GRADIENT 1\n#define HAS_IDENTITY ${identityBytes ? 1 : 0}\n`,
    );
    this.shower = new Program(gl, kEverywhere, showGlsl);
    this.liner = new Program(gl, linesVertexGlsl, linesGlsl);
    this.pointer = new Program(gl, overlayVertexGlsl, linesGlsl);
    this.mesher = new Program(gl, overlayVertexGlsl, meshGlsl);

    const sites = new Uint32Array(4 * header.num_cells);
    const bits = new Uint32Array(data.positions.buffer, data.positions.byteOffset, data.positions.length);
    for (let i = 0; i < header.num_cells; ++i) {
      for (let k = 0; k < 3; ++k) sites[4 * i + k] = bits[3 * i + k];
      sites[4 * i + 3] = data.offsets[i];
    }
    this.sites = this.upload(gl.RGBA32UI, gl.RGBA_INTEGER, gl.UNSIGNED_INT, sites, 4);
    this.neighbours = this.upload(gl.R32UI, gl.RED_INTEGER, gl.UNSIGNED_INT, data.neighbors, 1);
    const words = (bytes: Uint8Array) => new Uint32Array(bytes.slice().buffer);
    this.records = this.upload(gl.RGBA32UI, gl.RGBA_INTEGER, gl.UNSIGNED_INT, words(data.records), 4);
    this.identities = this.upload(gl.RGBA32UI, gl.RGBA_INTEGER, gl.UNSIGNED_INT, words(data.identities), 4);
    const classes = new Float32Array(20 * header.num_classes);
    for (let k = 0; k < header.num_classes; ++k) {
      classes.set(data.classifier.subarray(17 * k, 17 * k + 17), 20 * k);
    }
    this.classifier = this.upload(gl.RGBA32F, gl.RGBA, gl.FLOAT, classes, 4);
    this.states = texture(gl, gl.RGBA8UI, header.num_classes + 1, 1);
    this.setStates([]);
    this.labelColors = texture(gl, gl.RGBA8UI, Math.max(1, header.num_classes), 1);
    const colors = new Uint8Array(4 * Math.max(1, header.num_classes));
    report.labels.forEach((label, k) => colors.set(label.color, 4 * k));
    gl.texSubImage2D(
      gl.TEXTURE_2D, 0, 0, 0, colors.length / 4, 1, gl.RGBA_INTEGER, gl.UNSIGNED_BYTE, colors);
    this.pixel = new Target(gl);
    this.pixel.resize(1, 1);

    this.lineBuffer = gl.createBuffer()!;
    this.lineArray = gl.createVertexArray()!;
    gl.bindVertexArray(this.lineArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.lineBuffer);
    for (const [name, count, begin] of [
      ["begin", 3, 0],
      ["end", 3, 12],
      ["color", 4, 24],
      ["id", 1, 40],
    ] as [string, number, number][]) {
      const place = gl.getAttribLocation(this.liner.program, name);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, count, gl.FLOAT, false, 44, begin);
      gl.vertexAttribDivisor(place, 1);
    }
    gl.bindVertexArray(null);
  }

  // Uploads an array as rows of 2^widthBits texels.
  private upload(
    format: number,
    kind: number,
    type: number,
    values: Uint32Array | Float32Array,
    channels: number,
  ): WebGLTexture {
    const gl = this.gl, width = 1 << this.widthBits;
    const texels = Math.max(1, values.length / channels), rows = Math.ceil(texels / width);
    if (rows > (gl.getParameter(gl.MAX_TEXTURE_SIZE) as number)) {
      throw new Error("The foam is too large for this graphics processor; write the report with a smaller --max_cells.");
    }
    const made = texture(gl, format, width, rows);
    const whole = Math.floor(values.length / channels / width);
    if (whole > 0) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, whole, kind, type, values);
    const rest = values.length / channels - whole * width;
    if (rest > 0) {
      gl.texSubImage2D(
        gl.TEXTURE_2D, 0, 0, whole, rest, 1, kind, type, values.subarray(whole * width * channels));
    }
    return made;
  }

  // Sets what each label shows; a label without a state shows everything. The last state is that of
  // cells without a label.
  setStates(states: LabelState[]): void {
    this.labelStates = states;
    this.uploadStates((k) => states[k] ?? kShown);
  }

  private uploadStates(stateOf: (label: number) => LabelState): void {
    const gl = this.gl, count = this.data.header.num_classes + 1;
    const bytes = new Uint8Array(4 * count);
    for (let k = 0; k < count; ++k) {
      const { object, loose } = stateOf(k), root = this.labelStates[k]?.root ?? k;
      bytes.set([object, loose, root & 255, root >> 8], 4 * k);
    }
    gl.bindTexture(gl.TEXTURE_2D, this.states);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, count, 1, gl.RGBA_INTEGER, gl.UNSIGNED_BYTE, bytes);
  }

  // Walks the rays of a part of `target` (all without a part): `lens` is for a picture of its size.
  // y of the part counts from below. Objects that are moved apart are walked one by one, each from
  // where the eye is as seen from its own place.
  draw(target: Target, pose: Pose, lens: Lens, how: Draw, part?: Part): void {
    const gl = this.gl, { header } = this.data, walk = this.walk.use();
    const whole = part ?? { x: 0, y: 0, width: target.width, height: target.height };
    walk.textures({
      sites: this.sites,
      neighbours: this.neighbours,
      records: this.records,
      identities: this.identities,
      classifier: this.classifier,
      states: this.states,
    });
    gl.uniform1i(walk.place("widthBits"), this.widthBits);
    gl.uniform1ui(walk.place("numSites"), header.num_sites);
    gl.uniform1i(walk.place("numClasses"), header.num_classes);
    gl.uniform1i(walk.place("maxSteps"), header.num_cells);
    gl.uniform1ui(walk.place("noNeighbour"), 0xffffffff);
    gl.uniform3fv(walk.place("background"), this.background);
    gl.uniform1f(walk.place("cutoffTau"), -Math.log(this.report.transmittance_cutoff));
    gl.uniform1f(walk.place("negligibleWeight"), this.report.negligible_weight);
    gl.uniform1i(walk.place("exactLabels"), how === Draw.FoamAndLabels ? 1 : 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.frame);
    gl.viewport(0, 0, target.width, target.height);
    gl.enable(gl.SCISSOR_TEST);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.ALWAYS);
    if (this.moved.size === 0) {
      this.drawLayer(target, pose, lens, whole, false);
    } else {
      const shown = (k: number) => this.labelStates[k] ?? kShown;
      this.uploadStates((k) => ({ object: this.moved.has(k) ? 0 : shown(k).object, loose: shown(k).loose }));
      this.drawLayer(target, pose, lens, whole, false);
      gl.depthFunc(gl.LESS);
      for (const [label, place] of this.moved) {
        if (shown(label).object === 0) continue;
        const moved = { eye: subtract(pose.eye, place.offset), camFromWorld: pose.camFromWorld };
        const box = project(moved, lens, target.height, place.center, place.radius, whole);
        if (!box) continue;
        this.uploadStates((k) => ({ object: k === label ? shown(k).object : 0, loose: 0 }));
        this.drawLayer(target, moved, lens, box, true);
      }
      this.uploadStates(shown);
    }
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.SCISSOR_TEST);
  }

  private drawLayer(target: Target, pose: Pose, lens: Lens, part: Part, isLayer: boolean): void {
    const gl = this.gl, walk = this.walk;
    this.lastCell = nearestCell(this.data, pose.eye, this.lastCell);
    gl.scissor(part.x, part.y, part.width, part.height);
    gl.uniform1ui(walk.place("startCell"), this.lastCell);
    gl.uniform1i(walk.place("isLayer"), isLayer ? 1 : 0);
    gl.uniform4fv(walk.place("keep"), this.keep);
    this.setLens(walk, target.height, pose, lens);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  private setLens(program: Program, height: number, pose: Pose, lens: Lens): void {
    const gl = this.gl;
    gl.uniform3fv(program.place("origin"), pose.eye);
    // The rows of camFromWorld, read as columns, are its transpose.
    gl.uniformMatrix3fv(program.place("worldFromCam"), false, pose.camFromWorld);
    gl.uniform2f(program.place("focal"), lens.fx, lens.fy);
    gl.uniform2f(program.place("center"), lens.cx, height - lens.cy);
  }

  // Shows what was walked on the canvas, or in `frame`, which is `width` x `height`.
  show(
    target: Target,
    mode: Mode,
    depthRange: [number, number],
    marked: number,
    width = this.canvas.width,
    height = this.canvas.height,
    frame: WebGLFramebuffer | null = null,
  ): void {
    const gl = this.gl, shower = this.shower.use();
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.viewport(0, 0, width, height);
    shower.textures({
      walkedColor: target.color,
      walkedData: target.data,
      labelColors: this.labelColors,
    });
    gl.uniform1i(shower.place("mode"), mode);
    gl.uniform2i(shower.place("size"), width, height);
    gl.uniform2i(shower.place("walkedSize"), target.width, target.height);
    gl.uniform2fv(shower.place("depthRange"), depthRange);
    gl.uniform1i(shower.place("marked"), marked);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  // Takes over surfaces and points as the program packed them (tools/report/overlay_pack.h).
  addOverlays(bytes: Uint8Array): void {
    const gl = this.gl, { surfaces, points } = this.report.overlays;
    const attributes = (program: Program, header: PackedPositions, count: number) => {
      const array = gl.createVertexArray()!;
      gl.bindVertexArray(array);
      for (const [name, type, normalized, begin, size] of [
        ["position", gl.UNSIGNED_SHORT, false, header.begin, 6 * count],
        ["color", gl.UNSIGNED_BYTE, true, header.begin + 6 * count, 3 * count],
      ] as [string, number, boolean, number, number][]) {
        const place = gl.getAttribLocation(program.program, name);
        gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
        gl.bufferData(gl.ARRAY_BUFFER, bytes.subarray(begin, begin + size), gl.STATIC_DRAW);
        gl.enableVertexAttribArray(place);
        gl.vertexAttribPointer(place, 3, type, normalized, 0, 0);
      }
      return array;
    };
    for (const one of surfaces) {
      const array = attributes(this.mesher, one, one.vertices);
      const begin = one.begin + 4 * Math.ceil((9 * one.vertices) / 4);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, bytes.subarray(begin, begin + 12 * one.triangles), gl.STATIC_DRAW);
      const label = this.report.objects[one.object].label;
      this.surfaces.push({ array, label, count: 3 * one.triangles, origin: one.origin, step: one.step });
    }
    if (points) {
      const array = attributes(this.pointer, points, points.points);
      this.points = { array, label: -1, count: points.points, origin: points.origin, step: points.step };
    }
    gl.bindVertexArray(null);
  }

  // Takes over the pictures of cameras: where their corners are (two triangles for each camera), and
  // the parts of `image` that they show.
  addPictures(corners: Vector[], places: [number, number][], image: HTMLCanvasElement): void {
    const gl = this.gl, array = gl.createVertexArray()!;
    gl.bindVertexArray(array);
    for (const [name, count, values] of [["position", 3, corners.flat()], ["uv", 2, places.flat()]] as [string, number, number[]][]) {
      const place = gl.getAttribLocation(this.pointer.program, name);
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.STATIC_DRAW);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, count, gl.FLOAT, false, 0, 0);
    }
    // Of cameras without a photo.
    gl.vertexAttrib4f(gl.getAttribLocation(this.pointer.program, "color"), 0.55, 0.6, 0.66, 1);
    gl.bindVertexArray(null);
    this.pictures = { array, label: -1, count: corners.length, origin: [0, 0, 0], step: [1, 1, 1] };
    this.pictureTexture = texture(gl, gl.RGBA8, image.width, image.height, gl.LINEAR);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, gl.RGBA, gl.UNSIGNED_BYTE, image);
  }

  // Makes a target empty, as far as the eye sees.
  clear(target: Target): void {
    const gl = this.gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.frame);
    gl.clearBufferfv(gl.COLOR, 0, [...this.background, 1]);
    gl.clearBufferuiv(gl.COLOR, 1, [0, 0, 0, 0]);
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
  }

  // Draws what there is besides the foam into the whole of a target, where the foam does not hide it.
  drawOver(target: Target, pose: Pose, lens: Lens, over: Over): void {
    const gl = this.gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.frame);
    gl.viewport(0, 0, target.width, target.height);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LESS);
    if (over.meshes !== Meshes.None) this.drawSurfaces(target, pose, lens);
    if (over.points && this.points) {
      this.usePointer(target, pose, lens, this.points, kPointIds, false);
      gl.uniform1f(this.pointer.place("pointSize"), Math.max(1, over.scale * Math.max(2, this.canvas.height / 250)));
      gl.drawArrays(gl.POINTS, 0, this.points.count);
    }
    if (over.cameras) {
      if (this.pictures) {
        const { except } = over.cameras, begin = 6 * except, count = this.pictures.count;
        this.usePointer(target, pose, lens, this.pictures, kCameraIds, true);
        if (except < 0) {
          gl.drawArrays(gl.TRIANGLES, 0, count);
        } else {
          gl.drawArrays(gl.TRIANGLES, 0, begin);
          gl.drawArrays(gl.TRIANGLES, begin + 6, count - begin - 6);
        }
      }
      this.drawLines(target.width, target.height, over.cameras.lines, pose, lens, Math.max(1, 1.5 * over.scale));
    }
    gl.bindVertexArray(null);
    gl.disable(gl.DEPTH_TEST);
  }

  private drawSurfaces(target: Target, pose: Pose, lens: Lens): void {
    const gl = this.gl, mesher = this.mesher.use();
    this.setLens(mesher, target.height, pose, lens);
    gl.uniform2f(mesher.place("sizeInPixels"), target.width, target.height);
    gl.uniform4fv(mesher.place("keep"), this.keep);
    for (const surface of this.surfaces) {
      const { object: share, root } = this.labelStates[surface.label] ?? kShown;
      if (share === 0) continue;
      const offset = this.moved.get(surface.label)?.offset ?? [0, 0, 0];
      gl.uniform1ui(mesher.place("label"), (root ?? surface.label) + 1);
      gl.uniform1i(mesher.place("isDim"), share < 255 ? 1 : 0);
      gl.uniform3fv(mesher.place("offset"), offset);
      gl.uniform3fv(mesher.place("boxOrigin"), surface.origin);
      gl.uniform3fv(mesher.place("boxStep"), surface.step);
      gl.bindVertexArray(surface.array);
      gl.drawElements(gl.TRIANGLES, surface.count, gl.UNSIGNED_INT, 0);
    }
  }

  private usePointer(target: Target, pose: Pose, lens: Lens, what: Surface, ids: number, sharesId: boolean): void {
    const gl = this.gl, pointer = this.pointer.use();
    pointer.textures({ pictures: this.pictureTexture });
    this.setLens(pointer, target.height, pose, lens);
    gl.uniform2f(pointer.place("sizeInPixels"), target.width, target.height);
    gl.uniform3fv(pointer.place("boxOrigin"), what.origin);
    gl.uniform3fv(pointer.place("boxStep"), what.step);
    gl.uniform1ui(pointer.place("firstId"), ids);
    gl.uniform1i(pointer.place("sharesId"), sharesId ? 1 : 0);
    gl.uniform1i(pointer.place("hasPicture"), sharesId ? 1 : 0);
    gl.bindVertexArray(what.array);
  }

  // Draws lines over the canvas; `lens` is for its size.
  drawLinesOnTop(lines: Line[], pose: Pose, lens: Lens): void {
    const gl = this.gl, { width, height } = this.canvas;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    this.drawLines(width, height, lines, pose, lens, 2.5);
    gl.bindVertexArray(null);
  }

  private drawLines(width: number, height: number, lines: Line[], pose: Pose, lens: Lens, thick: number): void {
    if (lines.length === 0) return;
    const gl = this.gl, liner = this.liner.use();
    const values = new Float32Array(11 * lines.length);
    lines.forEach((line, i) => {
      values.set([...line.from, ...line.to, ...line.color, line.camera === undefined ? 0 : line.camera + 1], 11 * i);
    });
    liner.textures({ pictures: this.pictureTexture });
    this.setLens(liner, height, pose, lens);
    gl.uniform2f(liner.place("sizeInPixels"), width, height);
    gl.uniform1f(liner.place("lineWidth"), thick);
    gl.uniform1ui(liner.place("firstId"), kCameraIds);
    gl.uniform1i(liner.place("hasPicture"), 0);
    gl.bindVertexArray(this.lineArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.lineBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STREAM_DRAW);
    gl.drawArraysInstanced(gl.TRIANGLES, 0, 6, lines.length);
  }

  // Draws the foam, or nothing where surfaces are drawn alone, and all else into a target.
  drawAll(target: Target, pose: Pose, lens: Lens, how: Draw, over: Over): void {
    if (over.meshes === Meshes.Alone) this.clear(target);
    else this.draw(target, pose, lens, how);
    this.drawOver(target, pose, lens, over);
  }

  // Casts the ray through one point of a picture.
  pick(pose: Pose, lens: Lens, x: number, y: number, over = kNothingOver): Picked {
    const gl = this.gl;
    const own: Lens = { fx: lens.fx, fy: lens.fy, cx: lens.cx - x + 0.5, cy: lens.cy - y + 0.5 };
    this.drawAll(this.pixel, pose, own, Draw.FoamAndLabels, over);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.pixel.frame);
    const values = new Uint32Array(4);
    gl.readBuffer(gl.COLOR_ATTACHMENT1);
    gl.readPixels(0, 0, 1, 1, gl.RGBA_INTEGER, gl.UNSIGNED_INT, values);
    const distance = new Float32Array(values.buffer, 4, 1)[0];
    const kind = values[0] & ~(kCameraIds - 1);
    const picked: Picked = {
      label: kind === 0 ? values[0] - 1 : -1,
      camera: kind === kCameraIds ? values[0] - kCameraIds : -1,
      sfmPoint: kind === kPointIds ? values[0] - kPointIds : -1,
      distance,
      cell: values[2] - 1,
      opacity: (values[3] & 0xffff) / 65535,
      confidence: (values[3] >>> 16) / 65535,
    };
    if (distance > 0) {
      const direction = rayDirection(pose, lens, x, y);
      picked.point = [0, 1, 2].map((k) => pose.eye[k] + distance * direction[k]) as Vector;
    }
    return picked;
  }

  // Renders a picture of its own, and returns its colours [height][width][4] and classes + 1
  // [height][width], from the top.
  render(
    pose: Pose,
    lens: Lens,
    width: number,
    height: number,
    mode: Mode,
    rays: number,
    depthRange: [number, number] = [1, 2],
    over = kNothingOver,
  ): { colors: Uint8ClampedArray; labels: Uint32Array } {
    const gl = this.gl, target = new Target(gl), result = new Target(gl);
    target.resize(width * rays, height * rays);
    result.resize(width, height);
    const fine = { fx: lens.fx * rays, fy: lens.fy * rays, cx: lens.cx * rays, cy: lens.cy * rays };
    this.drawAll(target, pose, fine, Draw.FoamAndLabels, over);
    const colors = new Uint8Array(4 * width * height);
    const data = new Uint32Array(4 * target.width * target.height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.frame);
    gl.readBuffer(gl.COLOR_ATTACHMENT1);
    gl.readPixels(0, 0, target.width, target.height, gl.RGBA_INTEGER, gl.UNSIGNED_INT, data);
    gl.bindFramebuffer(gl.FRAMEBUFFER, result.frame);
    gl.drawBuffers([gl.COLOR_ATTACHMENT0]);
    this.show(target, mode, depthRange, -1, width, height, result.frame);
    gl.readBuffer(gl.COLOR_ATTACHMENT0);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, colors);
    const fromTop = new Uint8ClampedArray(colors.length), labels = new Uint32Array(width * height);
    for (let y = 0; y < height; ++y) {
      const from = height - 1 - y;
      fromTop.set(colors.subarray(4 * width * from, 4 * width * (from + 1)), 4 * width * y);
      for (let x = 0; x < width; ++x) {
        labels[y * width + x] = data[4 * (from * rays * target.width + x * rays)];
      }
    }
    target.free();
    result.free();
    return { colors: fromTop, labels };
  }
}

// The unit direction of the ray through a point of a picture, in pixels from the upper left corner.
export function rayDirection(pose: Pose, lens: Lens, x: number, y: number): Vector {
  const camera = [(x - lens.cx) / lens.fx, (y - lens.cy) / lens.fy, 1];
  const m = pose.camFromWorld;
  const world = [0, 1, 2].map((k) => camera[0] * m[k] + camera[1] * m[3 + k] + camera[2] * m[6 + k]);
  const length = Math.hypot(world[0], world[1], world[2]);
  return world.map((value) => value / length) as Vector;
}

// The part of `within` that a sphere can cover in a picture `height` high; nothing where it covers
// none.
function project(
  pose: Pose,
  lens: Lens,
  height: number,
  center: Vector,
  radius: number,
  within: Part,
): Part | null {
  const from = subtract(center, pose.eye), m = pose.camFromWorld;
  const z = dot(row(m, 2), from);
  if (z + radius <= 0) return null;
  let [left, right, below, above] = [within.x, within.x + within.width, within.y, within.y + within.height];
  if (z > radius * 1.05) {
    const near = z - radius;
    const x = dot(row(m, 0), from), y = dot(row(m, 1), from);
    const edges = (a: number, f: number): [number, number] => [
      f * Math.min((a - radius) / near, (a - radius) / (z + radius)),
      f * Math.max((a + radius) / near, (a + radius) / (z + radius)),
    ];
    const [x0, x1] = edges(x, lens.fx), [y0, y1] = edges(-y, lens.fy);
    left = Math.max(left, Math.floor(lens.cx + x0));
    right = Math.min(right, Math.ceil(lens.cx + x1));
    below = Math.max(below, Math.floor(height - lens.cy + y0));
    above = Math.min(above, Math.ceil(height - lens.cy + y1));
  }
  return right > left && above > below
    ? { x: left, y: below, width: right - left, height: above - below }
    : null;
}
