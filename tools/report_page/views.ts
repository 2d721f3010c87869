// SPDX-License-Identifier: MIT
import { byId, choices, make } from "./dom";
import { Report, View } from "./report";

function figure(view: View, fly: (camera: number) => void): HTMLElement {
  const under = make("img", { src: view.photo, alt: `Photo ${view.name}`, loading: "lazy", draggable: false });
  const over = make("img", { src: view.render, alt: `Render of ${view.name}`, loading: "lazy", draggable: false });
  const slider = make("input", { type: "range", min: "0", max: "100", step: "0.1", value: "50" });
  slider.setAttribute("aria-label", `How much of the photo ${view.name} is shown`);
  const right = make("span", { textContent: "render" });
  const pair = make("div", { className: "pair" }, under, over, slider, make("span", { textContent: "photo" }), right);
  slider.addEventListener("input", () => pair.style.setProperty("--at", `${slider.value}%`));
  const pictures: [string, string][] = [["render", view.render]];
  if (view.labels) pictures.push(["labels", view.labels]);
  pictures.push(["error", view.error]);
  const row = choices(pictures.map(([name]) => name), 0, (k) => {
    [right.textContent, over.src] = pictures[k];
  }).element;
  const look = make("button", { type: "button", textContent: "in 3D" });
  look.addEventListener("click", () => fly(view.camera));
  const scores = [
    view.psnr === null || view.psnr === undefined ? "" : `${view.psnr.toFixed(2)} dB`,
    `SSIM ${view.ssim.toFixed(3)}`,
    view.miou === undefined ? "" : `mIoU ${view.miou.toFixed(3)}`,
  ];
  return make(
    "figure",
    {},
    pair,
    make(
      "figcaption",
      {},
      make("b", { textContent: view.name }),
      make("span", { textContent: scores.filter((score) => score !== "").join(", ") }),
    ),
    make("div", { className: "row-tools" }, row, " ", look),
  );
}

// Shows the views, which the program has sorted by error.
export function showViews(report: Report, fly: (camera: number) => void): void {
  if (report.views.length === 0) return;
  const section = byId("views");
  section.hidden = false;
  section.querySelector("h2")!.textContent = report.views_are_held_out
    ? "Views that the training has not seen"
    : "Views of the training";
  section.querySelector(".grid")!.append(...report.views.map((view) => figure(view, fly)));
}
