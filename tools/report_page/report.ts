// SPDX-License-Identifier: MIT
//
// The data of a report, as the program writes them (tools/report/report_content.cc). Lengths,
// areas and volumes are in Report.units, unless they are called normalised.

export type Vector = [number, number, number];
// Row-major.
export type Matrix = number[];

export interface Camera {
  name: string;
  // Pixels. The corner of the picture is (0, 0), its y axis points down.
  width: number;
  height: number;
  fx: number;
  fy: number;
  cx: number;
  cy: number;
  // Camera axes: x right, y down, z forward.
  cam_from_world: Matrix;
  // Normalised.
  center: Vector;
  held_out: boolean;
  thumbnail?: string;
}

export interface View {
  // Index among the cameras.
  camera: number;
  name: string;
  psnr: number | null;
  ssim: number;
  miou?: number;
  photo: string;
  render: string;
  error: string;
  labels?: string;
}

export interface Label {
  id: number;
  // The id in the masks, which labels.json names.
  source_id: number;
  name: string;
  color: Vector;
}

export interface FoamObject {
  // Index among the labels: the class.
  label: number;
  id: number;
  name: string;
  cells: number;
  volume: number;
  area: number;
  size: Vector;
  confidence: number;
  components: number;
  photos: number;
  files: string[];
  // Normalised.
  center: Vector;
  radius: number;
}

export interface FoamHeader {
  num_sites: number;
  num_cells: number;
  num_classes: number;
  num_left_out: number;
  sh_degree: number;
  record_bytes: number;
  classifier_begin: number;
  records_begin: number;
  identities_begin: number;
  neighbors_begin: number;
  bytes: number;
}

// Positions are origin + step * integers, normalised.
export interface PackedPositions {
  begin: number;
  origin: Vector;
  step: Vector;
}

export interface OverlaysHeader {
  surfaces: (PackedPositions & { object: number; vertices: number; triangles: number })[];
  points: (PackedPositions & { points: number }) | null;
  bytes: number;
}

export interface Report {
  scene: string;
  date: string;
  program: string;
  quality: string;
  cells: number;
  photos: number;
  // Photos held out of the training; whether the views are of these.
  held_out: number;
  views_are_held_out: boolean;
  seconds: number | null;
  // Seconds, PSNR, mIoU.
  curve: [number, number, number | null][];
  scores?: { views: number; psnr: number | null; ssim: number; miou?: number };
  effects: { effect: string; on: boolean; evidence: string }[];
  warnings: string[];
  views: View[];
  cameras: Camera[];
  labels: Label[];
  objects: FoamObject[];
  // What lengths are in, such as "m"; volumes are in the cubes of it.
  units: string;
  world_units_per_unit: number;
  negligible_weight: number;
  transmittance_cutoff: number;
  foam: FoamHeader;
  overlays: OverlaysHeader;
}
