// SPDX-License-Identifier: MIT
//
// What the reader of the report wants changed, as label_editor reads it (--edits_path).
import { byId, make, save } from "./dom";
import { Report } from "./report";
import { Show, Viewer } from "./viewer";

// Gives what a mark on a photo shows a label: a point, or an outline; pixels of the photo.
export interface Mark {
  // Name of a label, there already or new.
  label: string;
  camera: number;
  points: [number, number][];
}

interface Merge {
  from: number;
  into: number;
}

// Members of an edits file.
type FileEdit = Record<string, string>;

// Returns a point well inside an outline: the middle of its widest row at half of its height.
function pointInside(outline: [number, number][]): [number, number] {
  const ys = outline.map(([, y]) => y);
  // Beside the middle by what no corner is likely to have.
  const y = (Math.min(...ys) + Math.max(...ys)) / 2 + 0.0137;
  const crossings = outline.flatMap(([x0, y0], k) => {
    const [x1, y1] = outline[(k + 1) % outline.length];
    return y0 > y === y1 > y ? [] : [x0 + ((y - y0) / (y1 - y0)) * (x1 - x0)];
  }).sort((a, b) => a - b);
  let widest = 0, x = outline[0][0];
  for (let k = 0; k + 1 < crossings.length; k += 2) {
    const width = crossings[k + 1] - crossings[k];
    if (width <= widest) continue;
    widest = width;
    x = crossings[k] + width / 2;
  }
  return [x, y];
}

export class Edits {
  // Called when edits changed.
  changed: () => void = () => {};
  readonly marks: Mark[] = [];
  private merges: Merge[] = [];
  private readonly names: string[];

  constructor(private report: Report, private viewer: Viewer | null) {
    this.names = report.labels.map((label) => label.name);
  }

  // Labels as label_editor finds them, whatever they are called.
  private static id(id: number): string {
    return `id:${id}`;
  }

  nameOf(label: number): string {
    const one = this.report.labels[label];
    return one.name || (one.id === 0 ? "unlabelled" : `label_${one.id}`);
  }

  rename(label: number, name: string): void {
    this.report.labels[label].name = name;
    this.update();
  }

  merge(from: number, into: number): void {
    if (from === into) return;
    this.merges.push({ from, into });
    this.update();
  }

  mark(mark: Mark): void {
    this.marks.push(mark);
    this.update();
  }

  // For each label the one that it is merged into, or itself.
  roots(): number[] {
    const roots = this.report.labels.map((_, k) => k);
    for (const { from, into } of this.merges) roots.forEach((root, k) => root === from && (roots[k] = roots[into]));
    return roots;
  }

  private hidden(): number[] {
    const roots = this.roots(), viewer = this.viewer;
    if (!viewer) return [];
    return this.report.objects.map((object) => object.label)
      .filter((label) => roots[label] === label && viewer.showOf(label) === Show.Hidden);
  }

  // Each edit, what it does in words, and how to take it back.
  private list(): { edit: FileEdit; text: string; undo: () => void }[] {
    const { labels } = this.report, id = (label: number) => Edits.id(labels[label].id);
    const remove = <T>(from: T[], one: T) => () => void from.splice(from.indexOf(one), 1);
    const merges = this.merges.map((merge) => ({
      edit: { merge: `${id(merge.into)},${id(merge.from)}` },
      text: `merge ${this.nameOf(merge.from)} into ${this.nameOf(merge.into)}`,
      undo: remove(this.merges, merge),
    }));
    const renames = labels.flatMap((label, k) => (label.name === this.names[k] ? [] : [{
      edit: { rename: Edits.id(label.id), to: label.name },
      text: `rename ${this.names[k] || `label_${label.id}`} to ${label.name}`,
      undo: () => {
        label.name = this.names[k];
      },
    }]));
    // A label that is merged into another is gone by then.
    const roots = this.roots();
    const kept = renames.filter((_, i) => {
      const k = labels.findIndex((label) => Edits.id(label.id) === renames[i].edit.rename);
      return roots[k] === k;
    });
    const marks = this.marks.map((mark) => {
      const { camera, points } = mark, { name } = this.report.cameras[camera];
      const shown = points.length === 1 ? `what this point of ${name}` : `what this outline in ${name}`;
      const known = labels.findIndex((label, k) => label.id !== 0 && roots[k] === k && this.nameOf(k) === mark.label);
      const place = [name, ...points.flat().map((value) => Math.floor(value))].join(",");
      return {
        edit: { assign: known >= 0 ? id(known) : mark.label, [points.length === 1 ? "pick" : "outline"]: place },
        text: `make ${shown} shows ${mark.label}`,
        undo: remove(this.marks, mark),
      };
    });
    const drops = this.hidden().map((label) => ({
      edit: { drop: id(label) },
      text: `drop ${this.nameOf(label)}, which is hidden`,
      undo: () => this.viewer!.setShow(label, Show.Full),
    }));
    return [...merges, ...kept, ...marks, ...drops];
  }

  // The edits as a file of label_editor.
  file(): string {
    return JSON.stringify({ edits: this.list().map((one) => one.edit) }, null, 1) + "\n";
  }

  // The marks, as shapes of LabelMe: a list of photos, for foam_labeler and mask_importer. An outline
  // has a point in it, which says that nothing is known of what is around it.
  marksFile(): string {
    const photos = this.report.cameras.map((camera, k) => ({ camera, marks: this.marks.filter((mark) => mark.camera === k) }));
    const shape = (label: string, shape_type: string, points: [number, number][]) => ({
      label,
      points: points.map(([x, y]) => [Math.round(x * 10) / 10, Math.round(y * 10) / 10]),
      group_id: null,
      shape_type,
      flags: {},
    });
    return JSON.stringify(photos.filter(({ marks }) => marks.length > 0).map(({ camera, marks }) => ({
      version: "5.0.1",
      flags: {},
      shapes: marks.flatMap(({ label, points }) => points.length === 1
        ? [shape(label, "point", points)]
        : [shape(label, "polygon", points), shape(label, "point", [pointInside(points)])]),
      imagePath: camera.name,
      imageData: null,
      imageHeight: camera.height,
      imageWidth: camera.width,
    })), null, 1) + "\n";
  }

  // The names alone, by the masks' own ids, as all commands read them.
  labelsFile(): string {
    const labels: Record<string, string> = {};
    for (const label of this.report.labels) if (label.name !== "") labels[label.source_id] = label.name;
    return JSON.stringify({ labels }, null, 1) + "\n";
  }

  // Applies everything anew, and tells.
  private update(): void {
    this.viewer?.setRoots(this.roots());
    this.changed();
  }

  // Lists the edits on the page.
  show(): void {
    const section = byId("edits"), all = this.list();
    section.hidden = all.length === 0;
    // Of a foam without labels nothing can be edited.
    const hasLabels = this.report.objects.length > 0;
    for (const part of section.querySelectorAll<HTMLElement>(".editing")) part.hidden = !hasLabels;
    for (const part of section.querySelectorAll<HTMLElement>(".marking")) part.hidden = this.marks.length === 0;
    section.querySelector("ul")!.replaceChildren(...all.map(({ text, undo }) => {
      const button = make("button", { type: "button", textContent: "undo" });
      button.addEventListener("click", () => {
        undo();
        this.update();
      });
      return make("li", {}, make("span", { textContent: text }), button);
    }));
  }

  addButtons(): void {
    const add = (use: string, name: string, text: () => string) => {
      const button = make("button", { type: "button", textContent: `Save ${name}`, className: use });
      button.addEventListener("click", () => save(name, text()));
      byId("edits").querySelector(".actions")!.append(button);
    };
    add("editing", "edits.json", () => this.file());
    add("marking", "marks.json", () => this.marksFile());
  }
}
