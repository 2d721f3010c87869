// SPDX-License-Identifier: MIT
import { byId, count, make, number, save } from "./dom";
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

  constructor(private report: Report, private viewer: Viewer | null) {
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
    saver.addEventListener("click", () => save("labels.json", this.labelsJson()));
    section.querySelector(".actions")!.append(saver);
  }

  private row(object: FoamObject): HTMLTableRowElement {
    const label = this.report.labels[object.label];
    const swatch = make("span", { className: "swatch" });
    swatch.style.background = `rgb(${label.color.join(",")})`;
    const name = make("input", { className: "name", value: object.name, spellcheck: false });
    name.setAttribute("aria-label", `Name of object ${object.id}`);
    name.addEventListener("change", () => {
      label.name = object.name = name.value.trim() || object.name;
      name.value = object.name;
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
    }
    const row = make(
      "tr",
      {},
      make("td", {}, make("div", { className: "blank" })),
      make("td", {}, swatch, name),
      tools,
      ...kColumns.map((column) => make("td", { textContent: column.text(object) })),
    );
    row.addEventListener("click", () => this.choose(object.label));
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

  // Shows which object is chosen, and what is hidden.
  update(): void {
    const viewer = this.viewer;
    if (!viewer) return;
    for (const [label, row] of this.rows) {
      row.classList.toggle("chosen", viewer.chosen === label);
      const pressed = [
        viewer.isolated === label,
        viewer.showOf(label) === Show.Hidden,
        viewer.showOf(label) === Show.Dim,
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

  // The names, by the masks' own ids, as the commands read them.
  private labelsJson(): string {
    const labels: Record<string, string> = {};
    for (const label of this.report.labels) if (label.name !== "") labels[label.source_id] = label.name;
    return JSON.stringify({ labels }, null, 1) + "\n";
  }
}
