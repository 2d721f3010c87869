// SPDX-License-Identifier: MIT
import { byId } from "./dom";
import { Report } from "./report";

const kSpace = "http://www.w3.org/2000/svg";

function svg(tag: string, attributes: Record<string, string | number>, text = ""): SVGElement {
  const element = document.createElementNS(kSpace, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  element.textContent = text;
  return element;
}

// Round steps, about `count` of them, within a range.
function ticks(low: number, high: number, count: number): number[] {
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * ([1, 2, 5, 10].find((factor) => factor * power >= rough) ?? 10);
  const values: number[] = [];
  for (let value = Math.ceil(low / step) * step; value <= high + step * 1e-6; value += step) values.push(value);
  return values;
}

interface Curve {
  name: string;
  color: string;
  points: [number, number][];
  digits: number;
}

function panel(curve: Curve, end: number, width: number, height: number): SVGElement {
  const plot = svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img" });
  plot.setAttribute("aria-label", `${curve.name} over seconds of training`);
  const values = curve.points.map((point) => point[1]);
  let low = Math.min(...values), high = Math.max(...values);
  const margin = Math.max(0.08 * (high - low), 1e-3);
  low -= margin;
  high += margin;
  const x = (seconds: number) => 52 + (seconds / end) * (width - 72);
  const y = (value: number) => height - 34 - ((value - low) / (high - low)) * (height - 60);
  for (const value of ticks(low, high, 4)) {
    plot.append(
      svg("line", { x1: 52, x2: width - 20, y1: y(value), y2: y(value), stroke: "currentColor", "stroke-opacity": 0.12 }),
      svg("text", { x: 44, y: y(value) + 4, "text-anchor": "end" }, value.toFixed(curve.digits)),
    );
  }
  for (const seconds of ticks(0, end, 6)) {
    plot.append(svg("text", { x: x(seconds), y: height - 14, "text-anchor": "middle" }, `${Number(seconds.toPrecision(3))} s`));
  }
  plot.append(
    svg("text", { x: 52, y: 16 }, curve.name),
    svg("polyline", {
      points: curve.points.map(([seconds, value]) => `${x(seconds).toFixed(1)},${y(value).toFixed(1)}`).join(" "),
      fill: "none",
      stroke: curve.color,
      "stroke-width": 2.5,
      "stroke-linejoin": "round",
    }),
  );
  const [seconds, value] = curve.points[curve.points.length - 1];
  plot.append(svg("circle", { cx: x(seconds), cy: y(value), r: 4, fill: curve.color }));
  return plot;
}

// Plots held-out quality over the seconds of the training, as its log has them.
export function showPlot(report: Report): void {
  if (report.curve.length < 2) return;
  byId("quality").hidden = false;
  const end = report.curve[report.curve.length - 1][0];
  const curves: Curve[] = [
    { name: "held-out PSNR, dB", color: "#2f7ec4", digits: 1, points: report.curve.map(([s, psnr]) => [s, psnr]) },
    {
      name: "held-out mIoU",
      color: "#d2762b",
      digits: 2,
      points: report.curve.flatMap(([s, , miou]): [number, number][] => (miou === null ? [] : [[s, miou]])),
    },
  ];
  for (const curve of curves) {
    // The log repeats the last measured quality from line to line.
    curve.points = curve.points.filter(([, value], k) => k === 0 || value !== curve.points[k - 1][1]);
    if (curve.points.length > 1) byId("plot").append(panel(curve, end, 600, 230));
  }
}
