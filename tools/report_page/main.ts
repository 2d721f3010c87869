// SPDX-License-Identifier: MIT
import { Benchmark, benchmark } from "./benchmark";
import { control, kKeys } from "./controls";
import { byId, choices, count, duration, make, number } from "./dom";
import { Edits } from "./edits";
import { readFoam, unpack } from "./foam_data";
import { Meshes, Mode } from "./foam_renderer";
import { Marker } from "./marks";
import { ObjectTable } from "./objects";
import { showPlot } from "./plot";
import { Report } from "./report";
import { showViews } from "./views";
import { distance } from "./vector";
import { Viewer } from "./viewer";

const report: Report = JSON.parse(byId("report").textContent!);

function showHead(): void {
  document.title = `${report.scene}, Semantic Foam report`;
  byId("scene").textContent = report.scene;
  byId("subtitle").textContent = [
    report.date,
    `${count(report.photos)} photos`,
    `${count(report.cells)} cells`,
    report.seconds === null ? "" : `trained in ${duration(report.seconds)}${report.quality ? ` (${report.quality})` : ""}`,
  ].filter((part) => part !== "").join("  ·  ");
  const figures = byId("figures"), scores = report.scores;
  const figure = (name: string, value: string) => {
    figures.append(make("div", {}, make("dt", { textContent: name }), make("dd", { textContent: value })));
  };
  if (scores) {
    const of = report.views_are_held_out ? report.held_out : report.photos;
    const some = scores.views < of ? ` (${scores.views} of ${of} views)` : "";
    const held = report.views_are_held_out ? "held-out " : "training ";
    if (scores.psnr !== null) figure(`${held}PSNR${some}`, `${scores.psnr.toFixed(2)} dB`);
    figure("SSIM", scores.ssim.toFixed(3));
    const logged = report.curve.length > 0 ? report.curve[report.curve.length - 1][2] : null;
    if (scores.miou !== undefined) figure("mIoU", scores.miou.toFixed(3));
    else if (logged !== null) figure("mIoU against the masks", logged.toFixed(3));
  }
  if (report.objects.length > 0) figure("objects", count(report.objects.length));
  byId("footer").textContent =
    `Written by ${report.program}. Lengths, areas and volumes are in ${report.units}. ` +
    "Everything is in this file; nothing is loaded, nothing is sent.";
}

function showLists(): void {
  if (report.warnings.length > 0) {
    byId("warnings").hidden = false;
    byId("warnings").querySelector("ul")!.append(...report.warnings.map((text) => make("li", { textContent: text })));
  }
  if (report.effects.length > 0) {
    byId("effects").hidden = false;
    byId("effects").querySelector("ul")!.append(
      ...report.effects.map((effect) =>
        make("li", { textContent: `${effect.effect}: ${effect.on ? "on" : "off"} (${effect.evidence})` })));
  }
}

// For those who test the page: set when everything is shown, or with the reason why not.
interface Page {
  ready: boolean;
  error?: string;
  viewer?: Viewer;
  edits?: Edits;
  benchmark?: Benchmark;
  report: Report;
  // From the opening of the page to its first and to its finest picture.
  firstPicture?: number;
  finestPicture?: number;
}
const page: Page = { ready: false, report };
(window as unknown as { semfoam: Page }).semfoam = page;

const kModes = ["Colour", "Labels", "Confidence", "Depth", "Cells"];
const kMeshes = ["Surfaces", "Surfaces over the foam", "Surfaces alone"];

// The row of controls below the view, and what follows the pointer.
function addTools(viewer: Viewer, table: ObjectTable, edits: Edits): void {
  const tools = byId("tools"), measure = byId("measure"), hover = byId("hover"), keys = byId("keys");
  const photo = byId<HTMLImageElement>("photo");
  let measuring = false;

  const modes = choices(kModes, viewer.mode, (k) => viewer.setMode(k as Mode));
  const toggle = (text: string, act: () => void) => {
    const button = make("button", { type: "button", textContent: text });
    button.addEventListener("click", act);
    return button;
  };
  const range = (text: string, from: number, to: number, value: number, act: (value: number) => void) => {
    const input = make("input", { type: "range", min: String(from), max: String(to), step: "0.005", value: String(value) });
    input.addEventListener("input", () => act(Number(input.value)));
    return { input, label: make("label", {}, text, input) };
  };
  const toggleMeasure = () => {
    measuring = !measuring;
    viewer.measured = [];
    viewer.present();
    update();
  };
  const toggleKeys = () => (keys.hidden = !keys.hidden);
  const marker = new Marker(report, viewer, edits);
  const toggleMarks = () => {
    if (report.cameras.length === 0) return;
    marker.toggle();
    if (marker.isOn) setFade(1);
    update();
  };
  const meshes = toggle("Surfaces", () => viewer.setMeshes(((viewer.meshes + 1) % 3) as Meshes));
  const cameras = toggle("Cameras", () => viewer.setShowsCameras(!viewer.showsCameras));
  const points = toggle("Points", () => viewer.setShowsPoints(!viewer.showsPoints));
  const marks = toggle("Mark", toggleMarks);
  marks.title = "Mark things on photos, to give them a label";
  const measurer = toggle("Measure", toggleMeasure);
  const slicer = toggle("Slice", () => viewer.setSlice((viewer.slice + 1) % 3, viewer.sliceAt));
  const slice = range("cut", 0, 1, 0.5, (value) => viewer.setSlice(viewer.slice, value));
  const apart = range("apart", 0, 1.5, 0, (value) => viewer.setExplosion(value));
  const fade = range("photo", 0, 1, 0, () => place());
  const setFade = (share: number) => {
    fade.input.value = String(share);
    place();
  };
  // The photo comes up over the render, so that one sees both.
  viewer.arrived = () => {
    const begin = performance.now();
    const step = (now: number) => {
      if (viewer.camera < 0) return;
      setFade(Math.max(0, Math.min(1, (now - begin) / 900)));
      if (now - begin < 900) requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  };
  const all = toggle("Show all", () => viewer.showAll());
  tools.append(modes.element);
  if (report.objects.length > 0) tools.append(meshes);
  if (report.cameras.length > 0) tools.append(cameras);
  if (report.overlays.points) tools.append(points);
  tools.append(measurer, slicer, slice.label);
  if (report.cameras.length > 0) tools.append(marks);
  if (report.objects.length > 1) tools.append(apart.label);
  tools.append(fade.label, all, toggle("Keys", toggleKeys));
  keys.append(
    make("table", {}, ...kKeys.map(([key, what]) =>
      make("tr", {}, make("td", { textContent: key }), make("td", { textContent: what })))));

  // Lays the photo over the view while that looks through its camera.
  const place = () => {
    const camera = report.cameras[viewer.camera];
    const source = camera && (report.views.find((view) => view.camera === viewer.camera)?.photo ?? camera.thumbnail);
    photo.hidden = !source;
    fade.label.hidden = !source;
    marker.show(camera ? viewer.photoPlace(camera) : null);
    if (!camera || !source) return;
    if (photo.src !== source) photo.src = source;
    const box = viewer.photoPlace(camera);
    Object.assign(photo.style, {
      left: `${box.x}px`,
      top: `${box.y}px`,
      width: `${box.width}px`,
      height: `${box.height}px`,
      opacity: fade.input.value,
    });
  };

  const update = () => {
    modes.press(viewer.mode);
    cameras.setAttribute("aria-pressed", String(viewer.showsCameras));
    points.setAttribute("aria-pressed", String(viewer.showsPoints));
    meshes.setAttribute("aria-pressed", String(viewer.meshes !== Meshes.None));
    meshes.textContent = kMeshes[viewer.meshes];
    marks.setAttribute("aria-pressed", String(marker.isOn));
    measurer.setAttribute("aria-pressed", String(measuring));
    slicer.setAttribute("aria-pressed", String(viewer.slice > 0));
    slicer.textContent = ["Slice", "Slice from above", "Slice from here"][viewer.slice];
    slice.label.hidden = viewer.slice === 0;
    viewer.canvas.classList.toggle("pointing", measuring);
    measure.hidden = !measuring;
    const [a, b] = viewer.measured;
    measure.textContent = b
      ? `Distance: ${number(distance(a, b) * report.world_units_per_unit, 4)} ${report.units}`
      : a ? "Click the second point." : "Click the first point.";
    all.hidden = viewer.isolated < 0 && report.labels.every((_, k) => viewer.showOf(k) === 0);
    place();
    table.update();
    edits.show();
  };
  viewer.changed = update;
  edits.changed = update;
  viewer.presented = (isFine) => {
    if (page.firstPicture === undefined) {
      page.firstPicture = performance.now();
      byId("progress").hidden = true;
      // The first picture does not wait for what it does not show.
      setTimeout(() => loadOverlays(viewer, report), 0);
    }
    if (!isFine) return;
    try {
      history.replaceState(null, "", viewer.link());
    } catch {
      // Some browsers refuse it for files; the view then has no link.
    }
  };

  control(viewer, byId("viewer"), {
    hover: (x, y) => {
      const picked = viewer.pick(x, y);
      const text = picked.camera >= 0
        ? `${report.cameras[picked.camera].name}${report.cameras[picked.camera].held_out ? ", held out" : ""}`
        : picked.sfmPoint >= 0
          ? "a point of the COLMAP model"
          : picked.label >= 0 ? `${edits.nameOf(picked.label)}, ${Math.round(100 * picked.confidence)} %` : "";
      hover.hidden = text === "";
      hover.textContent = text;
      hover.style.left = `${Math.min(x + 14, viewer.canvas.clientWidth - 120)}px`;
      hover.style.top = `${Math.max(4, y - 34)}px`;
    },
    leave: () => (hover.hidden = true),
    click: (x, y) => {
      const picked = viewer.pick(x, y);
      if (picked.camera >= 0 && !measuring) return viewer.flyToCamera(picked.camera);
      if (table.mergesInto(picked.label)) return;
      if (!measuring) return viewer.choose(picked.label === viewer.chosen ? -1 : picked.label);
      if (!picked.point) return;
      viewer.measured = viewer.measured.length === 2 ? [picked.point] : [...viewer.measured, picked.point];
      viewer.present();
      update();
    },
    toggleKeys,
    toggleMeasure,
    toggleMarks,
  });
  table.choose = (label) => {
    viewer.choose(label);
    viewer.flyToObject(label);
    byId("viewer").scrollIntoView({ behavior: "smooth", block: "nearest" });
  };
  update();
}

// Loads the surfaces of objects, the points, and the photos in the frusta of their cameras.
function loadOverlays(viewer: Viewer, report: Report): void {
  void unpack(byId("overlays").textContent!, report.overlays.bytes).then((overlays) => {
    viewer.renderer.addOverlays(overlays);
    byId("overlays").remove();
    if (viewer.meshes !== Meshes.None || viewer.showsPoints) viewer.move();
  });
  void viewer.loadPictures();
}

// Waits until the browser has shown what the page holds now, for compiling shaders keeps it busy for
// long; no longer than a moment, as it shows no frame of a page in the background.
const painted = (): Promise<void> =>
  new Promise((done) => {
    requestAnimationFrame(() => setTimeout(done, 0));
    setTimeout(done, 200);
  });

async function start(): Promise<void> {
  showHead();
  showLists();
  showPlot(report);
  let viewer: Viewer | null = null;
  showViews(report, (camera) => {
    viewer?.flyToCamera(camera);
    byId("viewer").scrollIntoView({ behavior: "smooth", block: "nearest" });
  });
  const progress = byId("progress");
  try {
    if (!document.createElement("canvas").getContext("webgl2")) {
      throw new Error("This browser has no WebGL2, so the foam cannot be shown in 3D. Everything below works without.");
    }
    if (typeof DecompressionStream === "undefined") {
      throw new Error("This browser is too old to unpack the foam; any browser since 2023 can. Everything below works without.");
    }
    const bar = progress.querySelector("i")!;
    const bytes = await unpack(byId("foam").textContent!, report.foam.bytes, (share) => {
      bar.style.width = `${Math.round(100 * share)}%`;
    });
    byId("foam").remove();
    const foam = readFoam(bytes, report.foam);
    progress.querySelector("span")!.textContent = "Preparing the first picture";
    await painted();
    viewer = new Viewer(byId<HTMLCanvasElement>("canvas"), foam, report);
    if (location.hash === "#benchmark") {
      page.benchmark = benchmark(viewer, foam, report);
      byId("viewer").after(make("pre", { id: "benchmark", textContent: JSON.stringify(page.benchmark) }));
    }
    if (location.hash) viewer.follow(location.hash);
  } catch (error) {
    page.error = error instanceof Error ? error.message : String(error);
    progress.textContent = page.error;
    byId("tools").hidden = true;
  }
  const edits = new Edits(report, viewer);
  edits.addButtons();
  const table = new ObjectTable(report, viewer, edits);
  page.edits = edits;
  page.viewer = viewer ?? undefined;
  if (viewer) {
    addTools(viewer, table, edits);
    const shown = viewer;
    const wait = () => {
      if (!shown.isDone()) return void setTimeout(wait, 50);
      page.finestPicture ??= performance.now();
      void table.drawThumbnails().then(() => (page.ready = true));
    };
    wait();
  } else {
    edits.changed = () => edits.show();
    page.ready = true;
  }
}

void start();
