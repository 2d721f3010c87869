// SPDX-License-Identifier: MIT
import { byId, count, make, number, save } from "./dom";
import { Edits } from "./edits";
import { Mode } from "./foam_renderer";
import { FoamObject, Report } from "./report";
import { Show, Viewer } from "./viewer";

interface Column {
  title: string;
  value: (object: FoamObject) => number | string;
  text: (object: FoamObject) => string;
}

const kColumns: Column[] = [
  { title: "cells", value: (o) => o.cells, text: (o) => count(o.cells) },
  { title: "volume", value: (o) => o.volume, text: (o) => number(o.volume) },
  { title: "area", value: (o) => o.area, text: (o) => number(o.area) },
  { title: "size", value: (o) => Math.hypot(...o.size), text: (o) => o.size.map((v) => number(v)).join(" × ") },
  { title: "confidence", value: (o) => o.confidence, text: (o) => `${Math.round(100 * o.confidence)} %` },
  { title: "photos", value: (o) => o.photos, text: (o) => count(o.photos) },
  { title: "files", value: (o) => o.files.length, text: (o) => o.files.map((file) => file.split(".").pop()).join(" ") },
];

// The table of the objects.
export class ObjectTable {
  // Called when the user chooses an object.
  choose: (label: number) => void = () => {};
  private rows = new Map<number, HTMLTableRowElement>();
  private sorted = { column: -1, up: false };
  private body: HTMLElement;

  // The label that waits for another, to be merged into it; -1: none.
  private merging = -1;

  constructor(private report: Report, private viewer: Viewer | null, private edits: Edits) {
    const section = byId("objects");
    this.body = section.querySelector("tbody")!;
    if (report.objects.length === 0) return;
    section.hidden = false;
    const head = make("tr", {}, make("th"), make("th", { textContent: "name" }), make("th"));
    kColumns.forEach((column, k) => {
      const cell = make("th", { textContent: column.title, tabIndex: 0 });
      const sort = () => this.sort(k, head);
      cell.addEventListener("click", sort);
      cell.addEventListener("keydown", (event) => event.key === "Enter" && sort());
      head.append(cell);
    });
    section.querySelector("thead")!.append(head);
    for (const object of report.objects) this.rows.set(object.label, this.row(object));
    this.body.append(...this.rows.values());
    const saver = make("button", { type: "button", textContent: "Save names as labels.json" });
    saver.title = "For --labels_path of the commands that read a foam";
    saver.addEventListener("click", () => save("labels.json", edits.labelsFile()));
    section.querySelector(".actions")!.append(saver);
  }

  private row(object: FoamObject): HTMLTableRowElement {
    const label = this.report.labels[object.label];
    const swatch = make("span", { className: "swatch" });
    swatch.style.background = `rgb(${label.color.join(",")})`;
    const name = make("input", { className: "name", value: object.name, spellcheck: false });
    name.setAttribute("aria-label", `Name of object ${object.id}`);
    name.addEventListener("change", () => {
      this.edits.rename(object.label, name.value.trim() || object.name);
    });
    name.addEventListener("click", (event) => event.stopPropagation());
    const tools = make("td", { className: "row-tools" });
    if (this.viewer) {
      const button = (text: string, title: string, act: () => void) => {
        const made = make("button", { type: "button", textContent: text, title });
        made.addEventListener("click", (event) => {
          event.stopPropagation();
          act();
        });
        tools.append(made, " ");
      };
      const viewer = this.viewer, l = object.label;
      const toggle = (show: Show) => () => viewer.setShow(l, viewer.showOf(l) === show ? Show.Full : show);
      button("only", "Show this object alone", () => viewer.isolate(l));
      button("hide", "Hide this object", toggle(Show.Hidden));
      button("dim", "Show this object faintly", toggle(Show.Dim));
      button("merge", "Merge this object into another", () => {
        this.merging = this.merging === l ? -1 : l;
        this.update();
      });
    }
    const row = make(
      "tr",
      {},
      make("td", {}, make("div", { className: "blank" })),
      make("td", {}, swatch, name),
      tools,
      ...kColumns.map((column) => make("td", { textContent: column.text(object) })),
    );
    row.addEventListener("click", () => this.mergesInto(object.label) || this.choose(object.label));
    row.cells[row.cells.length - 1].title = object.files.join("\n");
    return row;
  }

  private sort(column: number, head: HTMLElement): void {
    this.sorted = { column, up: this.sorted.column === column && !this.sorted.up };
    [...head.children].forEach((cell, k) => {
      cell.classList.toggle("sorted", k === column + 3);
      cell.classList.toggle("up", this.sorted.up);
    });
    const value = kColumns[column].value;
    const order = [...this.report.objects].sort((a, b) => {
      const [x, y] = [value(a), value(b)];
      return (x < y ? 1 : x > y ? -1 : 0) * (this.sorted.up ? -1 : 1);
    });
    this.body.append(...order.map((object) => this.rows.get(object.label)!));
  }

  // Merges the object that waits for it into this one; returns whether one waited.
  mergesInto(label: number): boolean {
    const from = this.merging;
    if (from < 0) return false;
    this.merging = -1;
    if (this.rows.has(label)) this.edits.merge(from, label);
    this.update();
    return true;
  }

  // Shows which object is chosen, and what is hidden or merged.
  update(): void {
    const viewer = this.viewer, roots = this.edits.roots();
    const note = byId("objects").querySelector<HTMLElement>(".note")!;
    note.hidden = this.merging < 0;
    note.textContent = this.merging < 0 ? "" : `Click the object, here or in 3D, that ${this.edits.nameOf(this.merging)} is a part of.`;
    for (const object of this.report.objects) {
      const { label } = object, row = this.rows.get(label)!;
      object.name = this.edits.nameOf(label);
      row.querySelector<HTMLInputElement>(".name")!.value = object.name;
      row.hidden = roots[label] !== label;
      const parts = this.report.objects.filter((one) => roots[one.label] === label);
      row.cells[3].textContent = count(parts.reduce((sum, one) => sum + one.cells, 0));
      row.cells[4].textContent = number(parts.reduce((sum, one) => sum + one.volume, 0));
      if (!viewer) continue;
      row.classList.toggle("chosen", viewer.chosen === label);
      const pressed = [
        viewer.isolated === label,
        viewer.showOf(label) === Show.Hidden,
        viewer.showOf(label) === Show.Dim,
        this.merging === label,
      ];
      row.querySelectorAll(".row-tools button").forEach((button, k) =>
        button.setAttribute("aria-pressed", String(pressed[k])));
    }
  }

  // Renders the objects' small pictures, one after the other, without keeping the view waiting.
  async drawThumbnails(): Promise<void> {
    const viewer = this.viewer;
    if (!viewer) return;
    const width = 144, height = 108;
    for (const object of this.report.objects) {
      await new Promise((resolve) => setTimeout(resolve, 30));
      const pose = viewer.poseFor(object.center, object.radius, 1.2), f = 1.2 * height;
      const renderer = viewer.renderer, keep = renderer.keep, moved = new Map(renderer.moved);
      renderer.setStates(viewer.states(object.label));
      renderer.keep = [0, 0, 0, -1];
      renderer.moved.clear();
      const { colors } = renderer.render(
        pose, { fx: f, fy: f, cx: width / 2, cy: height / 2 }, width, height, Mode.Color, 2);
      renderer.keep = keep;
      moved.forEach((place, label) => renderer.moved.set(label, place));
      renderer.setStates(viewer.states(viewer.isolated));
      const canvas = make("canvas", { width, height });
      canvas.getContext("2d")!.putImageData(new ImageData(colors, width, height), 0, 0);
      const picture = make("img", { src: canvas.toDataURL("image/png"), alt: "" });
      this.rows.get(object.label)!.cells[0].replaceChildren(picture);
    }
  }
}
