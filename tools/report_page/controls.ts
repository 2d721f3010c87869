// SPDX-License-Identifier: MIT
import { Meshes, Mode } from "./foam_renderer";
import { Vector } from "./report";
import { distance, dot, row, subtract } from "./vector";
import { Show, Viewer } from "./viewer";

export interface ControlEvents {
  // The pointer rests here, or left.
  hover: (x: number, y: number) => void;
  leave: () => void;
  click: (x: number, y: number) => void;
  toggleKeys: () => void;
  toggleMeasure: () => void;
  toggleMarks: () => void;
}

export const kKeys: [string, string][] = [
  ["drag", "orbit about the point under the pointer"],
  ["right or shift drag", "move sideways"],
  ["wheel, pinch", "closer, farther"],
  ["W A S D, Q E", "fly"],
  ["arrows", "look around"],
  ["click", "choose an object"],
  ["double click, F", "fly to it"],
  ["1 to 5", "colour, labels, confidence, depth, cells"],
  ["I, H, G, U", "isolate, hide, dim, show all"],
  ["B, C, P", "surfaces, cameras, points"],
  ["M, X, N", "measure, slice, mark a photo"],
  ["R", "back to the start"],
];

// Moves the view by mouse, touch and keyboard.
export function control(viewer: Viewer, element: HTMLElement, events: ControlEvents): void {
  const canvas = viewer.canvas;
  const pointers = new Map<number, { x: number; y: number }>();
  let pivot: Vector = viewer.center;
  let depth = viewer.radius;
  let moved = 0;
  let hovering = 0;

  const place = (event: MouseEvent) => {
    const box = canvas.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };
  // The point under the pointer, or the one straight ahead at the depth of the last.
  const aim = (x: number, y: number) => {
    const point = viewer.pick(x, y).point;
    pivot = point ?? viewer.center;
    depth = point ? distance(point, viewer.pose.eye) : Math.max(0.2 * viewer.radius, distance(viewer.center, viewer.pose.eye));
  };
  // Normalised units that a pixel covers at the pivot.
  const unit = () => {
    const away = Math.max(1e-3, dot(subtract(pivot, viewer.pose.eye), row(viewer.pose.camFromWorld, 2)));
    return away / viewer.lens(canvas.clientWidth, canvas.clientHeight).fy;
  };

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, place(event));
    if (pointers.size === 1) {
      moved = 0;
      const { x, y } = place(event);
      aim(x, y);
    }
    events.leave();
    element.focus({ preventScroll: true });
  });

  canvas.addEventListener("pointermove", (event) => {
    const now = place(event), before = pointers.get(event.pointerId);
    if (!before) {
      clearTimeout(hovering);
      hovering = window.setTimeout(() => events.hover(now.x, now.y), 60);
      return;
    }
    const dx = now.x - before.x, dy = now.y - before.y;
    if (pointers.size === 1) {
      moved += Math.abs(dx) + Math.abs(dy);
      if (moved > 4) {
        canvas.classList.add("dragging");
        if (event.buttons & 6 || event.shiftKey) viewer.shift(-dx * unit(), -dy * unit(), 0);
        else viewer.orbit(pivot, dx * 0.006, dy * 0.006);
      }
      pointers.set(event.pointerId, now);
    } else {
      moved = 100;
      const other = [...pointers.entries()].find(([id]) => id !== event.pointerId)![1];
      const apart = (p: { x: number; y: number }) => Math.max(10, Math.hypot(p.x - other.x, p.y - other.y));
      const share = 1 - apart(before) / apart(now);
      viewer.dolly((now.x + other.x) / 2, (now.y + other.y) / 2, share, depth);
      depth *= 1 - share;
      viewer.shift((-dx / 2) * unit(), (-dy / 2) * unit(), 0);
      pointers.set(event.pointerId, now);
    }
  });

  const release = (event: PointerEvent) => {
    const wasDown = pointers.delete(event.pointerId);
    canvas.classList.remove("dragging");
    if (wasDown && event.type === "pointerup" && moved <= 4 && event.button === 0) {
      const { x, y } = place(event);
      events.click(x, y);
    }
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("pointerleave", () => {
    clearTimeout(hovering);
    events.leave();
  });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());

  canvas.addEventListener("dblclick", (event) => {
    const { x, y } = place(event);
    const picked = viewer.pick(x, y);
    if (picked.point) {
      viewer.fly({
        eye: viewer.pose.eye.map((e, k) => e + 0.55 * (picked.point![k] - e)) as Vector,
        camFromWorld: viewer.pose.camFromWorld,
      });
    }
  });

  let wheeled = 0;
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const { x, y } = place(event);
      if (event.timeStamp - wheeled > 300) aim(x, y);
      wheeled = event.timeStamp;
      const pixels = event.deltaY * (event.deltaMode === 1 ? 20 : event.deltaMode === 2 ? 400 : 1);
      const share = 1 - Math.exp(Math.max(-400, Math.min(400, pixels)) * 0.0012);
      viewer.dolly(x, y, share, depth);
      depth *= 1 - share;
    },
    { passive: false },
  );

  const held = new Set<string>();
  element.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const chosen = viewer.chosen;
    if (/^[1-5]$/.test(key)) viewer.setMode((Number(key) - 1) as Mode);
    else if (key === "b") viewer.setMeshes(((viewer.meshes + 1) % 3) as Meshes);
    else if (key === "c") viewer.setShowsCameras(!viewer.showsCameras);
    else if (key === "p") viewer.setShowsPoints(!viewer.showsPoints);
    else if (key === "m") events.toggleMeasure();
    else if (key === "n") events.toggleMarks();
    else if (key === "x") viewer.setSlice((viewer.slice + 1) % 3, viewer.sliceAt);
    else if (key === "u") viewer.showAll();
    else if (key === "i" && chosen >= 0) viewer.isolate(chosen);
    else if (key === "h" && chosen >= 0) viewer.setShow(chosen, viewer.showOf(chosen) === Show.Hidden ? Show.Full : Show.Hidden);
    else if (key === "g" && chosen >= 0) viewer.setShow(chosen, viewer.showOf(chosen) === Show.Dim ? Show.Full : Show.Dim);
    else if (key === "f" && chosen >= 0) viewer.flyToObject(chosen);
    else if (key === "r") viewer.start();
    else if (key === "?" || key === "/") events.toggleKeys();
    else if (key === "Escape") viewer.choose(-1);
    else if (/^([wasdqe]|Arrow(Left|Right|Up|Down))$/.test(key)) held.add(key);
    else return;
    event.preventDefault();
  });
  element.addEventListener("keyup", (event) => held.delete(event.key.length === 1 ? event.key.toLowerCase() : event.key));
  element.addEventListener("blur", () => held.clear());

  let last = performance.now();
  const frame = (now: number) => {
    const seconds = Math.min(0.1, (now - last) / 1000);
    last = now;
    if (held.size > 0) {
      const axis = (plus: string, minus: string) => (held.has(plus) ? 1 : 0) - (held.has(minus) ? 1 : 0);
      const step = viewer.radius * 0.6 * seconds;
      const [right, down, forward] = [axis("d", "a"), axis("q", "e"), axis("w", "s")];
      if (right || down || forward) viewer.shift(right * step, down * step, forward * step);
      const [yaw, pitch] = [axis("ArrowRight", "ArrowLeft"), axis("ArrowDown", "ArrowUp")];
      if (yaw || pitch) viewer.look(yaw * seconds, pitch * seconds);
    }
    viewer.tick(now);
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
}
