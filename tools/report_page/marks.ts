// SPDX-License-Identifier: MIT
import { byId, make } from "./dom";
import { Edits } from "./edits";
import { Report } from "./report";
import { Viewer } from "./viewer";

const kSpace = "http://www.w3.org/2000/svg";
const kStep = 5; // CSS pixels between points of an outline

// Lets the reader mark points and outlines on the photo that is looked through.
export class Marker {
  isOn = false;
  private readonly svg: SVGSVGElement;
  private readonly name: HTMLInputElement;
  private readonly bar: HTMLElement;
  private readonly unused: HTMLElement;
  private path: [number, number][] = [];

  constructor(private report: Report, private viewer: Viewer, private edits: Edits) {
    this.svg = document.createElementNS(kSpace, "svg");
    this.svg.id = "marks";
    byId("viewer").append(this.svg);
    const list = make("datalist", { id: "names" });
    this.name = make("input", { id: "mark-name", placeholder: "label" });
    this.name.setAttribute("list", "names");
    this.name.setAttribute("aria-label", "Label of the next mark");
    this.name.addEventListener("focus", () =>
      list.replaceChildren(...this.names().map((value) => make("option", { value }))));
    this.unused = make("span", {
      textContent: " This photo was held out of the training: foam_labeler leaves its marks out.",
    });
    this.bar = make("p", { id: "marking", className: "note", hidden: true },
      "Type a label, then click a thing in the photo, or draw around it: ", this.name, list, this.unused);
    byId("measure").before(this.bar);
    this.svg.addEventListener("pointerdown", (event) => {
      if (!this.name.value.trim()) return this.name.focus();
      this.svg.setPointerCapture(event.pointerId);
      this.path = [this.at(event)];
    });
    this.svg.addEventListener("pointermove", (event) => {
      if (this.path.length === 0) return;
      const next = this.at(event), last = this.path[this.path.length - 1];
      if (Math.hypot(next[0] - last[0], next[1] - last[1]) < kStep) return;
      this.path.push(next);
      this.draw();
    });
    this.svg.addEventListener("pointerup", () => this.finish());
    this.svg.addEventListener("pointercancel", () => (this.path = []));
  }

  // Of the labels that there are, and of those of earlier marks.
  private names(): string[] {
    const { report, edits } = this;
    return [...new Set([...report.objects.map((object) => edits.nameOf(object.label)), ...edits.marks.map((mark) => mark.label)])];
  }

  private at(event: PointerEvent): [number, number] {
    const box = this.svg.getBoundingClientRect();
    return [
      Math.max(0, Math.min(box.width - 0.01, event.clientX - box.left)),
      Math.max(0, Math.min(box.height - 0.01, event.clientY - box.top)),
    ];
  }

  // Photo pixels in a CSS pixel.
  private scale(): number {
    return this.report.cameras[this.viewer.camera].width / this.svg.getBoundingClientRect().width;
  }

  private finish(): void {
    if (this.path.length === 0) return;
    const scale = this.scale(), points = this.path.map(([x, y]): [number, number] => [x * scale, y * scale]);
    this.path = [];
    // A comma would separate labels.
    const label = this.name.value.trim().replace(/,/g, " ");
    this.edits.mark({ label, camera: this.viewer.camera, points: points.length < 3 ? [points[0]] : points });
  }

  toggle(): void {
    this.isOn = !this.isOn;
    const { viewer } = this;
    if (this.isOn && viewer.camera < 0) viewer.flyToCamera(viewer.nearestCamera());
    if (this.isOn) this.name.focus();
  }

  // Shows the marks over the photo, which lies at `box` of the canvas; nothing: there is no photo.
  show(box: { x: number; y: number; width: number; height: number } | null): void {
    this.bar.hidden = !this.isOn;
    this.unused.hidden = !this.report.cameras[this.viewer.camera]?.held_out;
    this.svg.style.display = box ? "" : "none";
    this.svg.style.pointerEvents = this.isOn ? "auto" : "none";
    if (!box) return;
    Object.assign(this.svg.style, {
      left: `${box.x}px`, top: `${box.y}px`, width: `${box.width}px`, height: `${box.height}px`,
    });
    this.draw();
  }

  private draw(): void {
    const camera = this.report.cameras[this.viewer.camera];
    if (!camera) return;
    const scale = this.scale();
    const outlines = this.edits.marks.filter((mark) => mark.camera === this.viewer.camera)
      .map(({ label, points }) => ({ label, points: points.map(([x, y]): [number, number] => [x / scale, y / scale]) }));
    if (this.path.length > 0) outlines.push({ label: this.name.value.trim(), points: this.path });
    const names = this.names();
    this.svg.replaceChildren(...outlines.map(({ label, points }) => {
      const shape = document.createElementNS(kSpace, points.length === 1 ? "circle" : "polygon");
      // Hues a golden angle apart differ, however many there are.
      const hue = `${(40 + 137.5 * Math.max(0, names.indexOf(label))) % 360} 100% 55%`;
      const attributes: Record<string, string | number> = points.length === 1
        ? { cx: points[0][0], cy: points[0][1], r: 6 }
        : { points: points.map((point) => point.map((v) => v.toFixed(1)).join(",")).join(" ") };
      shape.style.stroke = `hsl(${hue})`;
      shape.style.fill = `hsl(${hue} / 0.22)`;
      for (const [name, value] of Object.entries(attributes)) shape.setAttribute(name, String(value));
      return shape;
    }));
  }
}
