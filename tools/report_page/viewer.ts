// SPDX-License-Identifier: MIT
import { FoamData } from "./foam_data";
import { Draw, FoamRenderer, LabelState, Lens, Line, Meshes, Mode, Over, Part, Picked, Pose, Target, rayDirection } from "./foam_renderer";
import { Camera, FoamObject, Report, Vector } from "./report";
import { add, cross, distance, dot, length, lookAlong, mix, mixRotations, normalize, row, scale, subtract, turn } from "./vector";

const kFrame = 30; // milliseconds that a picture may take while the view moves
const kRest = 180; // milliseconds without movement until the picture is refined
const kDim = 12; // share of 255 of the matter of dimmed objects

// How an object is shown.
export enum Show {
  Full,
  Dim,
  Hidden,
}

// The 3D view: moves the camera, draws the foam coarsely while it moves and finely at rest.
export class Viewer {
  readonly renderer: FoamRenderer;
  pose: Pose;
  // The photo whose camera is looked through; -1: none.
  camera = -1;
  mode = Mode.Color;
  meshes = Meshes.None;
  showsCameras = false;
  showsPoints = false;
  // Chosen class; -1: none.
  chosen = -1;
  // The class that alone is shown; -1: all.
  isolated = -1;
  explosion = 0;
  // 0: none, 1: horizontal, 2: across the view.
  slice = 0;
  sliceAt = 0.5;
  measured: Vector[] = [];
  readonly up: Vector;
  readonly center: Vector;
  readonly radius: number;
  // For each label the one that it is merged into, or itself.
  readonly roots: number[];
  // Called when the flight to a photo's camera ends.
  arrived: () => void = () => {};
  // Called when something changed that the page shows, and when a picture was shown.
  changed: () => void = () => {};
  presented: (isFine: boolean) => void = () => {};

  private shows: Show[];
  // The objects that cameras go around.
  private readonly things: FoamObject[];
  // Focal length in picture heights.
  private focal = 1;
  private coarse: Target;
  private fine: Target;
  private resolution = 0.25;
  private depthRange: [number, number] = [1, 2];
  private lastMove = 0;
  private needsCoarse = true;
  // Rays along each edge of a pixel of the next fine picture; 3: done.
  private nextFine = 1;
  private parts: Part[] = [];
  private partsAtOnce = 1;
  private pending: { fence: WebGLSync; since: number; done: (milliseconds: number) => void } | null = null;
  private flight: { from: Pose; to: Pose; focal: [number, number]; camera: number; begin: number } | null = null;
  private sliceNormal: Vector = [0, 0, 1];
  private sliceRange: [number, number] = [0, 1];

  constructor(readonly canvas: HTMLCanvasElement, private data: FoamData, private report: Report) {
    this.renderer = new FoamRenderer(canvas, data, report);
    this.coarse = new Target(this.renderer.gl);
    this.fine = new Target(this.renderer.gl);
    this.shows = report.labels.map(() => Show.Full);
    this.roots = report.labels.map((_, k) => k);
    const { cameras, objects } = report;
    const mean = (vectors: Vector[]): Vector =>
      scale(vectors.reduce(add, [0, 0, 0]), 1 / Math.max(1, vectors.length));
    this.up = normalize(mean(cameras.map((camera) => scale(row(camera.cam_from_world, 1), -1))));
    if (length(this.up) === 0) this.up = [0, 0, 1];
    const awayFrom = (center: Vector): number => {
      const distances = cameras.map((camera) => distance(camera.center, center)).sort((a, b) => a - b);
      return distances.length > 0 ? distances[distances.length >> 1] : 1;
    };
    const middle = mean(objects.map((object) => object.center));
    // Walls and floors, around the cameras, are surroundings.
    this.things = objects.filter((object) => object.radius < 0.8 * awayFrom(middle));
    this.center = this.things.length > 0 ? mean(this.things.map((object) => object.center)) : middle;
    this.radius = awayFrom(this.center);
    this.pose = { eye: add(this.center, [this.radius, 0, 0]), camFromWorld: lookAlong([-1, 0, 0], this.up) };
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
    if (cameras.length > 0) this.start();
  }

  // The lens for a picture of this size.
  lens(width: number, height: number): Lens {
    const camera = this.report.cameras[this.camera];
    if (camera) {
      const s = Math.min(width / camera.width, height / camera.height);
      return {
        fx: camera.fx * s,
        fy: camera.fy * s,
        cx: (width - camera.width * s) / 2 + camera.cx * s,
        cy: (height - camera.height * s) / 2 + camera.cy * s,
      };
    }
    const f = this.focal * height;
    return { fx: f, fy: f, cx: width / 2, cy: height / 2 };
  }

  // Where the photo lies in the canvas, in CSS pixels.
  photoPlace(camera: Camera): { x: number; y: number; width: number; height: number } {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const s = Math.min(width / camera.width, height / camera.height);
    return {
      x: (width - camera.width * s) / 2,
      y: (height - camera.height * s) / 2,
      width: camera.width * s,
      height: camera.height * s,
    };
  }

  poseOf(camera: Camera): Pose {
    return { eye: camera.center, camFromWorld: camera.cam_from_world };
  }

  // Goes to where a photo was taken, with a field of view that the photo fills: of the held-out
  // photos, or of all where there are none, the one in the middle of all cameras. The first is often
  // at the rim of what photos show.
  start(): void {
    const { cameras } = this.report;
    const heldOut = cameras.filter((one) => one.held_out);
    const fromAll = (one: Camera): number =>
      cameras.reduce((sum, other) => sum + distance(one.center, other.center), 0);
    const camera = (heldOut.length > 0 ? heldOut : cameras)
      .map((one) => ({ one, away: fromAll(one) }))
      .reduce((best, next) => (next.away < best.away ? next : best)).one;
    const { width, height } = this.canvas;
    this.pose = this.poseOf(camera);
    this.focal = (camera.fy * Math.max(width / camera.width, height / camera.height)) / height;
    this.camera = -1;
    this.move();
  }

  lookThrough(index: number): void {
    const camera = this.report.cameras[Math.max(0, index)];
    this.pose = this.poseOf(camera);
    this.camera = Math.max(0, index);
    this.move();
  }

  // Marks the view as moved: draws it anew.
  move(): void {
    this.lastMove = performance.now();
    this.needsCoarse = true;
    this.restart();
  }

  // Leaves the photo's camera, keeping its field of view.
  release(): void {
    if (this.camera < 0) return;
    this.focal = this.lens(this.canvas.width, this.canvas.height).fy / this.canvas.height;
    this.camera = -1;
    this.changed();
  }

  private restart(): void {
    this.nextFine = 1;
    this.parts = [];
  }

  private resize(): void {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (width === this.canvas.width && height === this.canvas.height) return;
    this.canvas.width = width;
    this.canvas.height = height;
    this.move();
    this.changed();
  }

  // Flies to a pose, or to the camera of a photo.
  fly(to: Pose, camera = -1): void {
    this.release();
    const target = this.report.cameras[camera];
    const focal = target
      ? (target.fy * Math.min(this.canvas.width / target.width, this.canvas.height / target.height)) / this.canvas.height
      : this.focal;
    this.flight = { from: this.pose, to, focal: [this.focal, focal], camera, begin: performance.now() };
    this.move();
  }

  flyToCamera(index: number): void {
    this.fly(this.poseOf(this.report.cameras[index]), index);
  }

  // Shows an object whole, from the side that most cameras near it see.
  poseFor(center: Vector, radius: number, focal = this.focal): Pose {
    const nearest = this.report.cameras
      .map((camera) => camera.center)
      .sort((a, b) => distance(a, center) - distance(b, center))
      .slice(0, 3);
    const away = nearest.length > 0 ? nearest.map((c) => normalize(subtract(c, center))).reduce(add) : [1, 0, 0] as Vector;
    const direction = normalize(length(away) > 0.1 ? away : [1, 0, 0]);
    const eye = add(center, scale(direction, Math.max(radius, 1e-4) * 2.1 * Math.max(0.6, focal)));
    return { eye, camFromWorld: lookAlong(subtract(center, eye), this.up) };
  }

  flyToObject(label: number): void {
    const object = this.report.objects.find((one) => one.label === label);
    if (object) this.fly(this.poseFor(object.center, object.radius));
  }

  // --- What is shown ---

  showOf(label: number): Show {
    return this.shows[label];
  }

  setShow(label: number, show: Show): void {
    this.shows[label] = show;
    this.applyStates();
  }

  isolate(label: number): void {
    this.isolated = this.isolated === label ? -1 : label;
    this.applyStates();
  }

  showAll(): void {
    this.shows.fill(Show.Full);
    this.isolated = -1;
    this.applyStates();
  }

  states(isolated: number): LabelState[] {
    const share = [255, kDim, 0];
    const states: LabelState[] = this.roots.map((root) => {
      if (isolated >= 0) return { object: root === isolated ? 255 : 0, loose: 0, root };
      const shown = share[this.shows[root]];
      return { object: shown, loose: shown, root };
    });
    const rest = isolated >= 0 ? 0 : 255;
    states.push({ object: rest, loose: rest });
    return states;
  }

  // Shows labels as those that they are merged into.
  setRoots(roots: number[]): void {
    roots.forEach((root, k) => (this.roots[k] = root));
    if (this.chosen >= 0) this.chosen = roots[this.chosen];
    if (this.isolated >= 0) this.isolated = roots[this.isolated];
    this.applyStates();
  }

  private applyStates(): void {
    this.renderer.setStates(this.states(this.isolated));
    this.move();
    this.changed();
  }

  setExplosion(share: number): void {
    this.explosion = share;
    this.renderer.moved.clear();
    if (share > 0) {
      for (const object of this.things) {
        let away = subtract(object.center, this.center);
        // What stands on a table stays above it.
        const height = dot(away, this.up);
        if (height < 0) away = subtract(away, scale(this.up, height));
        this.renderer.moved.set(object.label, {
          offset: scale(away, share),
          center: object.center,
          radius: object.radius * 1.2,
        });
      }
    }
    this.move();
  }

  setSlice(kind: number, at: number, normal?: Vector): void {
    if (kind !== this.slice || normal) {
      this.sliceNormal = normal ?? (kind === 1 ? scale(this.up, -1) : row(this.pose.camFromWorld, 2));
      const heights: number[] = [];
      const { positions, header } = this.data;
      for (let i = 0; i < header.num_sites; i += Math.ceil(header.num_sites / 20000)) {
        const p: Vector = [positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]];
        if (distance(p, this.center) < this.radius) heights.push(dot(this.sliceNormal, p));
      }
      heights.sort((a, b) => a - b);
      if (heights.length > 0) this.sliceRange = [heights[0], heights[heights.length - 1]];
    }
    this.slice = kind;
    this.sliceAt = at;
    const [low, high] = this.sliceRange;
    this.renderer.keep = kind === 0 ? [0, 0, 0, -1] : [...this.sliceNormal, low + at * (high - low)];
    this.move();
    this.changed();
  }

  // The photo whose camera sees most nearly what is seen now.
  nearestCamera(): number {
    const { eye, camFromWorld } = this.pose, forward = row(camFromWorld, 2);
    const away = this.report.cameras.map((camera) =>
      distance(camera.center, eye) / this.radius + 1 - dot(row(camera.cam_from_world, 2), forward));
    return away.indexOf(Math.min(...away));
  }

  setMeshes(meshes: Meshes): void {
    this.meshes = meshes;
    this.move();
    this.changed();
  }

  setShowsCameras(shows: boolean): void {
    this.showsCameras = shows;
    this.move();
    this.changed();
  }

  setShowsPoints(shows: boolean): void {
    this.showsPoints = shows;
    this.move();
    this.changed();
  }

  setMode(mode: Mode): void {
    this.mode = mode;
    this.move();
    this.changed();
  }

  choose(label: number): void {
    this.chosen = label;
    this.present();
    this.changed();
  }

  // --- Movement ---

  // x and y in CSS pixels of the canvas.
  pick(x: number, y: number): Picked {
    const ratio = this.canvas.width / Math.max(1, this.canvas.clientWidth);
    return this.renderer.pick(this.pose, this.lens(this.canvas.width, this.canvas.height), x * ratio, y * ratio, this.over(1));
  }

  orbit(pivot: Vector, dx: number, dy: number): void {
    this.release();
    const { eye, camFromWorld } = this.pose;
    const right = row(camFromWorld, 0), forward = row(camFromWorld, 2);
    const steep = Math.asin(Math.max(-1, Math.min(1, dot(forward, this.up))));
    const tilt = Math.max(-1.5, Math.min(1.5, steep - dy)) - steep;
    const around = (v: Vector) => turn(turn(v, right, tilt), this.up, -dx);
    this.pose = {
      eye: add(pivot, around(subtract(eye, pivot))),
      camFromWorld: [...around(right), ...around(row(camFromWorld, 1)), ...around(forward)],
    };
    this.level();
    this.move();
  }

  // Turns the camera about its axis until the horizon is level.
  private level(): void {
    const forward = row(this.pose.camFromWorld, 2);
    if (length(cross(forward, this.up)) > 0.05) this.pose.camFromWorld = lookAlong(forward, this.up);
  }

  // Moves along the camera's axes, in normalised units.
  shift(right: number, down: number, forward: number): void {
    this.release();
    const m = this.pose.camFromWorld;
    const by = add(add(scale(row(m, 0), right), scale(row(m, 1), down)), scale(row(m, 2), forward));
    this.pose = { eye: add(this.pose.eye, by), camFromWorld: m };
    this.move();
  }

  // Moves towards the point under a pixel, by a share of the way.
  dolly(x: number, y: number, share: number, depth: number): void {
    this.release();
    const ratio = this.canvas.width / Math.max(1, this.canvas.clientWidth);
    const towards = rayDirection(this.pose, this.lens(this.canvas.width, this.canvas.height), x * ratio, y * ratio);
    this.pose = { eye: add(this.pose.eye, scale(towards, share * depth)), camFromWorld: this.pose.camFromWorld };
    this.move();
  }

  look(dx: number, dy: number): void {
    this.release();
    const forward = row(this.pose.camFromWorld, 2), right = row(this.pose.camFromWorld, 0);
    const towards = turn(turn(forward, right, -dy), this.up, -dx);
    if (length(cross(towards, this.up)) > 0.05) {
      this.pose = { eye: this.pose.eye, camFromWorld: lookAlong(towards, this.up) };
    }
    this.move();
  }

  // --- Drawing ---

  // Draws what there is to draw; to be called for every frame of the browser.
  tick(now: number): void {
    const gl = this.renderer.gl;
    if (gl.isContextLost()) return;
    if (this.flight) this.advance(now);
    if (this.pending) {
      const state = gl.clientWaitSync(this.pending.fence, gl.SYNC_FLUSH_COMMANDS_BIT, 0);
      if (state === gl.TIMEOUT_EXPIRED) return;
      const { fence, since, done } = this.pending;
      gl.deleteSync(fence);
      this.pending = null;
      done(performance.now() - since);
    }
    if (this.needsCoarse) this.drawCoarse();
    else if (this.nextFine < 3 && performance.now() - this.lastMove > kRest) this.drawFine();
  }

  // Whether the finest picture is shown.
  isDone(): boolean {
    return this.nextFine === 3 && !this.needsCoarse && !this.pending && !this.flight;
  }

  private advance(now: number): void {
    const { from, to, focal, camera, begin } = this.flight!;
    const time = Math.min(1, Math.max(0, now - begin) / 700), s = time * time * (3 - 2 * time);
    this.focal = focal[0] * (1 - s) + focal[1] * s;
    this.pose = {
      eye: mix(from.eye, to.eye, s),
      camFromWorld: mixRotations(from.camFromWorld, to.camFromWorld, s),
    };
    if (time === 1) {
      this.pose = to;
      this.camera = camera;
      this.flight = null;
      this.changed();
      if (camera >= 0) this.arrived();
    }
    this.move();
  }

  private after(done: (milliseconds: number) => void): void {
    const gl = this.renderer.gl;
    const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0)!;
    gl.flush();
    this.pending = { fence, since: performance.now(), done };
  }

  private how(): Draw {
    return this.mode === Mode.Labels || this.mode === Mode.Confidence ? Draw.FoamAndLabels : Draw.Foam;
  }

  private drawCoarse(): void {
    this.needsCoarse = false;
    this.restart();
    const { width, height } = this.canvas;
    this.coarse.resize(Math.max(16, Math.round(width * this.resolution)), Math.max(16, Math.round(height * this.resolution)));
    if (this.mode === Mode.Depth) this.findDepthRange();
    const lens = this.lens(this.coarse.width, this.coarse.height);
    this.renderer.drawAll(this.coarse, this.pose, lens, this.how(), this.over(this.coarse.height / height));
    this.present(this.coarse);
    this.after((milliseconds) => {
      const by = Math.sqrt(kFrame / Math.max(4, milliseconds));
      this.resolution = Math.max(0.08, Math.min(1, this.resolution * Math.max(0.5, Math.min(1.3, by))));
      this.presented(false);
    });
  }

  // Draws some parts of the next finer picture, and shows it when it has all.
  private drawFine(): void {
    const { width, height } = this.canvas, rays = this.nextFine;
    if (this.parts.length === 0) {
      this.fine.resize(width * rays, height * rays);
      if (this.mode === Mode.Depth) this.findDepthRange();
      const size = 128;
      for (let y = 0; y < this.fine.height; y += size) {
        for (let x = 0; x < this.fine.width; x += size) {
          this.parts.push({ x, y, width: Math.min(size, this.fine.width - x), height: Math.min(size, this.fine.height - y) });
        }
      }
    }
    const lens = this.lens(this.fine.width, this.fine.height);
    if (this.meshes === Meshes.Alone) {
      this.parts = [];
      this.renderer.clear(this.fine);
    }
    for (const part of this.parts.splice(0, this.partsAtOnce)) {
      this.renderer.draw(this.fine, this.pose, lens, this.how(), part);
    }
    const isWhole = this.parts.length === 0;
    if (isWhole) {
      this.renderer.drawOver(this.fine, this.pose, lens, this.over(rays));
      ++this.nextFine;
      this.present(this.fine);
    }
    this.after((milliseconds) => {
      this.partsAtOnce = Math.max(1, Math.min(64, Math.round(this.partsAtOnce * Math.min(2, kFrame / Math.max(1, milliseconds)))));
      if (isWhole) this.presented(true);
    });
  }

  private shownTarget: Target | null = null;

  // Shows a target, or again the one that is shown.
  present(target: Target | null = this.shownTarget): void {
    if (!target || target.width === 0) return;
    this.shownTarget = target;
    this.renderer.show(target, this.mode, this.depthRange, this.chosen);
    const { width, height } = this.canvas;
    const lens = this.lens(width, height);
    this.renderer.drawLinesOnTop(this.measureLines(), this.pose, lens);
  }

  private findDepthRange(): void {
    const gl = this.renderer.gl, probe = new Target(gl);
    probe.resize(32, 24);
    this.renderer.draw(probe, this.pose, this.lens(32, 24), Draw.Foam);
    const data = new Uint32Array(4 * 32 * 24), floats = new Float32Array(data.buffer);
    gl.readBuffer(gl.COLOR_ATTACHMENT1);
    gl.readPixels(0, 0, 32, 24, gl.RGBA_INTEGER, gl.UNSIGNED_INT, data);
    probe.free();
    const far: number[] = [];
    for (let i = 1; i < floats.length; i += 4) if (floats[i] > 0) far.push(floats[i]);
    far.sort((a, b) => a - b);
    if (far.length < 2) return;
    const low = far[Math.floor(0.02 * far.length)], high = far[Math.floor(0.96 * far.length)];
    this.depthRange = [low * 0.95, Math.max(high * 1.05, low * 1.1)];
  }

  // What is drawn besides the foam, `scale` pixels of the target for each of the canvas.
  private over(scale: number): Over {
    const cameras = this.showsCameras ? { lines: this.cameraLines(), except: this.cameraAtEye() } : undefined;
    return { meshes: this.meshes, points: this.showsPoints, cameras, scale };
  }

  // The camera that the eye stands in, so near that its picture would hide everything; -1: none.
  private cameraAtEye(): number {
    if (this.camera >= 0) return this.camera;
    const away = this.report.cameras.map((camera) => distance(camera.center, this.pose.eye));
    const nearest = away.indexOf(Math.min(...away));
    return away[nearest] < 0.25 * this.pictureDepth() ? nearest : -1;
  }

  // How far before a camera its picture is drawn.
  private pictureDepth(): number {
    return this.radius * 0.07;
  }

  // The corners of a camera's picture in 3D, from its upper left one clockwise.
  corners(camera: Camera): Vector[] {
    const m = camera.cam_from_world, depth = this.pictureDepth();
    return [[0, 0], [1, 0], [1, 1], [0, 1]].map(([x, y]): Vector => {
      const a = ((x * camera.width - camera.cx) / camera.fx) * depth;
      const b = ((y * camera.height - camera.cy) / camera.fy) * depth;
      return add(camera.center, add(add(scale(row(m, 0), a), scale(row(m, 1), b)), scale(row(m, 2), depth)));
    });
  }

  private cameraLines(): Line[] {
    const lines: Line[] = [];
    this.report.cameras.forEach((camera, index) => {
      if (index === this.camera) return;
      const color: Line["color"] = camera.held_out ? [0.9, 0.45, 0, 1] : [0.04, 0.39, 0.69, 1];
      this.corners(camera).forEach((corner, k, corners) => {
        lines.push({ from: camera.center, to: corner, color, camera: index });
        lines.push({ from: corner, to: corners[(k + 1) % 4], color, camera: index });
      });
    });
    return lines;
  }

  // Puts the small photos into the frusta of their cameras.
  async loadPictures(): Promise<void> {
    const { cameras } = this.report, across = 16, width = 128, height = 96;
    if (cameras.length === 0) return;
    const sheet = document.createElement("canvas");
    const small = cameras.filter((camera) => camera.thumbnail);
    sheet.width = across * width;
    sheet.height = Math.max(1, Math.ceil(small.length / across)) * height;
    const context = sheet.getContext("2d")!;
    const corners: Vector[] = [], places: [number, number][] = [];
    let next = 0;
    for (const camera of cameras) {
      const place = (x: number, y: number): [number, number] => [x / sheet.width, y / sheet.height];
      let box: [number, number][] = Array(4).fill([-1, -1]);
      if (camera.thumbnail) {
        const picture = new Image();
        picture.src = camera.thumbnail;
        await picture.decode();
        const x = (next % across) * width, y = Math.floor(next++ / across) * height;
        context.drawImage(picture, x, y, width, height);
        const [l, t, r, b] = [x + 1, y + 1, x + width - 1, y + height - 1];
        box = [place(l, t), place(r, t), place(r, b), place(l, b)];
      }
      const own = this.corners(camera);
      for (const k of [0, 1, 2, 0, 2, 3]) {
        corners.push(own[k]);
        places.push(box[k]);
      }
    }
    this.renderer.addPictures(corners, places, sheet);
    if (this.showsCameras) this.move();
  }

  private measureLines(): Line[] {
    const lines: Line[] = [];
    for (const at of this.measured) {
      const size = distance(at, this.pose.eye) * 0.012;
      for (let k = 0; k < 3; ++k) {
        const by = scale(row(this.pose.camFromWorld, k), size);
        lines.push({ from: subtract(at, by), to: add(at, by), color: [0.85, 0.05, 0.3, 1] });
      }
    }
    if (this.measured.length === 2) {
      lines.push({ from: this.measured[0], to: this.measured[1], color: [0.85, 0.05, 0.3, 1] });
    }
    return lines;
  }

  // --- The link ---

  link(): string {
    const digits = (values: number[]) => values.map((value) => Number(value.toPrecision(6))).join(",");
    const hidden = this.shows.flatMap((show, k) => (show === Show.Full ? [] : [`${k}${show === Show.Dim ? "d" : ""}`]));
    const parts = [
      this.camera >= 0
        ? `photo=${this.camera}`
        : `view=${digits([...this.pose.eye, ...row(this.pose.camFromWorld, 2), ...row(this.pose.camFromWorld, 1), this.focal])}`,
      `mode=${this.mode}`,
    ];
    if (hidden.length > 0) parts.push(`hide=${hidden.join(",")}`);
    if (this.isolated >= 0) parts.push(`only=${this.isolated}`);
    if (this.chosen >= 0) parts.push(`object=${this.chosen}`);
    if (this.meshes !== Meshes.None) parts.push(`meshes=${this.meshes}`);
    if (this.showsCameras) parts.push("cameras=1");
    if (this.showsPoints) parts.push("points=1");
    if (this.slice > 0) parts.push(`slice=${this.slice},${digits([this.sliceAt, ...this.sliceNormal])}`);
    if (this.explosion > 0) parts.push(`apart=${this.explosion}`);
    return `#${parts.join("&")}`;
  }

  // Restores the view of a link; ignores what it cannot read.
  follow(link: string): void {
    const values = new URLSearchParams(link.replace(/^#/, ""));
    const whole = (name: string, below: number): number => {
      const value = Number(values.get(name) ?? NaN);
      return Number.isInteger(value) && value >= 0 && value < below ? value : -1;
    };
    const labels = this.report.labels.length;
    const photo = whole("photo", this.report.cameras.length);
    const view = (values.get("view") ?? "").split(",").map(Number);
    if (photo >= 0) {
      this.lookThrough(photo);
    } else if (view.length === 10 && view.every(Number.isFinite) && view[9] > 0.05) {
      this.camera = -1;
      const forward = view.slice(3, 6) as Vector, down = view.slice(6, 9) as Vector;
      this.pose = { eye: view.slice(0, 3) as Vector, camFromWorld: lookAlong(forward, scale(down, -1)) };
      this.focal = view[9];
    }
    if (whole("mode", 5) >= 0) this.mode = whole("mode", 5);
    if (whole("meshes", 3) >= 0) this.meshes = whole("meshes", 3);
    for (const one of (values.get("hide") ?? "").split(",")) {
      const match = /^(\d+)(d?)$/.exec(one);
      if (match && Number(match[1]) < labels) this.shows[Number(match[1])] = match[2] ? Show.Dim : Show.Hidden;
    }
    this.isolated = whole("only", labels);
    this.chosen = whole("object", labels);
    this.showsCameras = values.get("cameras") === "1";
    this.showsPoints = values.get("points") === "1";
    const slice = (values.get("slice") ?? "").split(",").map(Number);
    if (slice.length === 5 && slice.every(Number.isFinite) && (slice[0] === 1 || slice[0] === 2)) {
      this.setSlice(slice[0], Math.max(0, Math.min(1, slice[1])), slice.slice(2) as Vector);
    }
    const apart = Number(values.get("apart") ?? 0);
    if (apart > 0 && apart <= 3) this.setExplosion(apart);
    this.applyStates();
  }
}
