// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/cell_points.h"

#include "export/io/byte_writer.h"
#include "export/io/label_sidecar.h"
#include "export/scene/names.h"
#include "export/scene/object_selection.h"
#include "foam/model/spherical_harmonics.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

std::string Lines(const std::vector<std::string>& properties) {
  std::string text;
  for (const std::string& property : properties) text += "property " + property + "\n";
  return text;
}

uint8_t Display8(float value) {
  return static_cast<uint8_t>(std::lround(255 * std::clamp(value, 0.f, 1.f)));
}

// Place and shape of a cell as a Gaussian, normalised frame.
struct Shape {
  Eigen::Vector3d mean;
  Eigen::Vector3d deviations;        // along the axes
  Eigen::Quaterniond world_of_axes;  // unit length
};

Shape ShapeOf(const ExportableScene& scene, uint32_t cell) {
  const Eigen::Vector3d site = scene.cell_positions[cell].cast<double>();
  const double reach = 3 * scene.radius[cell];
  // Corners in one place, where sites are nearly cospherical, count once: how many tetrahedra meet
  // there says nothing of the shape.
  const double one_place = 0.1 * scene.radius[cell];
  std::vector<Eigen::Vector3d> corners;
  for (const uint32_t tet : scene.tets_of_cells.Of(cell)) {
    const Eigen::Vector3d arm = scene.voronoi_vertices[tet] - site;
    const Eigen::Vector3d corner = site + arm * std::min(1.0, reach / std::max(arm.norm(), 1e-300));
    const bool is_known = std::any_of(corners.begin(), corners.end(), [&](const auto& known) {
      return (known - corner).norm() < one_place;
    });
    if (!is_known) corners.push_back(corner);
  }
  Shape shape;
  shape.mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& corner : corners) {
    shape.mean += corner / static_cast<double>(corners.size());
  }
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& corner : corners) {
    const Eigen::Vector3d arm = corner - shape.mean;
    covariance += arm * arm.transpose() / static_cast<double>(corners.size());
  }
  // A ball's surface has the variance r^2 / 3 along each axis, the ball itself r^2 / 5.
  covariance *= 3.0 / 5.0;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  Eigen::Matrix3d axes = solver.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) = -axes.col(0);
  shape.world_of_axes = Eigen::Quaterniond(axes).normalized();
  if (shape.world_of_axes.w() < 0) shape.world_of_axes.coeffs() *= -1;
  // Cells of cospherical sites can be flat to the last bit; a Gaussian cannot.
  const double least = 1e-3 * scene.radius[cell];
  for (int k = 0; k < 3; ++k) {
    shape.deviations[k] = std::max(std::sqrt(std::max(solver.eigenvalues()[k], 0.0)), least);
  }
  return shape;
}

}  // namespace

std::vector<uint32_t> VisibleCells(const ExportableScene& scene, const LabelFilter& filter) {
  std::vector<uint32_t> cells;
  for (uint32_t cell = 0; cell < scene.NumSites(); ++cell) {
    if (scene.labels.solid[cell] && scene.photographed[cell] && HasCell(scene, filter, cell)) {
      cells.push_back(cell);
    }
  }
  return cells;
}

void WriteCellPoints(const fs::path& path,
                     const ExportableScene& scene,
                     const std::vector<uint32_t>& cells) {
  const double scale = scene.colmap_from_normalized.scale;
  ByteWriter out(path);
  out.Text("ply\nformat binary_little_endian 1.0\ncomment labels " +
           LabelTableJson(scene.label_table) + "\nelement vertex " + std::to_string(cells.size()) +
           "\n" +
           Lines({"double x",
                  "double y",
                  "double z",
                  "uchar red",
                  "uchar green",
                  "uchar blue",
                  "int label",
                  "int object",
                  "float confidence",
                  "float density",
                  "float radius"}) +
           "end_header\n");
  for (const uint32_t cell : cells) {
    const Eigen::Vector3d position =
        scene.colmap_from_normalized.Apply(scene.cell_positions[cell].cast<double>());
    for (const double coordinate : position) out.Binary(coordinate);
    for (const float channel : scene.display_color[cell]) out.Binary(Display8(channel));
    out.Binary(Value(scene.label_id[cell]));
    out.Binary(Value(scene.ObjectId(cell)));
    out.Binary(scene.labels.confidence[cell]);
    out.Binary(static_cast<float>(scene.density[cell] / scale));
    out.Binary(static_cast<float>(scene.radius[cell] * scale));
  }
  out.Finish();
}

void WriteSplats(const fs::path& path,
                 const Model& model,
                 const ExportableScene& scene,
                 const std::vector<uint32_t>& cells,
                 double splat_scale) {
  CHECK_GT(splat_scale, 0);
  constexpr int kSplatRest = 15;  // coefficients of degree 1 to 3
  std::vector<std::string> properties;
  const auto add = [&](const std::string& name, int count) {
    for (int k = 0; k < count; ++k) properties.push_back("float " + name + std::to_string(k));
  };
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) {
    properties.push_back(std::string("float ") + name);
  }
  add("f_dc_", 3);
  add("f_rest_", 3 * kSplatRest);
  properties.push_back("float opacity");
  add("scale_", 3);
  add("rot_", 4);
  properties.push_back("int label");
  properties.push_back("int object");
  properties.push_back("float confidence");

  const Foam& foam = model.foam;
  const Similarity& frame = scene.colmap_from_normalized;
  ByteWriter out(path);
  out.Text("ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(cells.size()) +
           "\n" + Lines(properties) + "end_header\n");
  for (const uint32_t cell : cells) {
    const Shape shape = ShapeOf(scene, cell);
    const Eigen::Vector3f position = frame.Apply(shape.mean).cast<float>();
    for (const float coordinate : position) out.Binary(coordinate);
    for (int k = 0; k < 3; ++k) out.Binary(0.f);
    const float* sh = &foam.sh[static_cast<size_t>(cell) * foam.ShStride()];
    for (int c = 0; c < 3; ++c) out.Binary(sh[c]);
    const int num_rest = NumShCoefficients(foam.sh_degree) - 1;
    for (int c = 0; c < 3; ++c) {
      for (int k = 0; k < kSplatRest; ++k) out.Binary(k < num_rest ? sh[3 * (k + 1) + c] : 0.f);
    }
    // Neither 0 nor 1 has a logit.
    const double opacity =
        std::clamp(-std::expm1(-2.0 * scene.density[cell] * scene.radius[cell]), 1e-4, 1 - 1e-4);
    out.Binary(static_cast<float>(std::log(opacity / (1 - opacity))));
    for (const double deviation : shape.deviations) {
      out.Binary(static_cast<float>(std::log(splat_scale * frame.scale * deviation)));
    }
    const Eigen::Quaterniond& turn = shape.world_of_axes;
    for (const double part : {turn.w(), turn.x(), turn.y(), turn.z()}) {
      out.Binary(static_cast<float>(part));
    }
    out.Binary(Value(scene.label_id[cell]));
    out.Binary(Value(scene.ObjectId(cell)));
    out.Binary(scene.labels.confidence[cell]);
  }
  out.Finish();
}

void WriteFoamText(const fs::path& path, const Model& model, const ExportableScene& scene) {
  const Foam& foam = model.foam;
  const Similarity& frame = scene.colmap_from_normalized;
  ByteWriter out(path);
  const auto number = [&](auto value) {
    out.Number(value);
    out.Text(" ");
  };
  out.Text("# Semantic Foam: " + std::to_string(scene.NumSites()) + " sites, SH degree " +
           std::to_string(foam.sh_degree) + ", " + std::to_string(foam.num_classes) + " classes\n");
  out.Text("# Lengths, volumes and densities (per length) are of the COLMAP frame.\n# x_colmap = ");
  out.Number(frame.scale);
  out.Text(" * x_normalized + (");
  for (int axis = 0; axis < 3; ++axis) {
    out.Number(frame.translation[axis]);
    out.Text(axis < 2 ? ", " : ")\n");
  }
  for (const Label& label : scene.label_table) {
    out.Text("# label " + std::to_string(Value(label.id)) + ": " +
             OneLine(DisplayName(label.id, label.name)) + "\n");
  }
  out.Text(
      "# One line per site. R G B: 0 to 255, as the photos show it. LABEL: of the cell's own "
      "class, 0 = "
      "none.\n"
      "# OBJECT: of which it is a part in the exports, 0 = none. SH[]: " +
      std::to_string(NumShCoefficients(foam.sh_degree)) +
      " coefficients, red green blue of each.\n" +
      (foam.HasColorGradients()
           ? "# GRADIENT[]: of the colour per length along x, y and z, red green blue of each.\n"
           : "") +
      "# NEIGHBORS[]: how many, then their SITEs.\n"
      "# SITE X Y Z DENSITY RADIUS VOLUME LABEL CONFIDENCE R G B OBJECT SH[] " +
      (foam.HasColorGradients() ? "GRADIENT[] " : "") + "NEIGHBORS[]\n");
  for (uint32_t site = 0; site < scene.NumSites(); ++site) {
    number(site);
    const Eigen::Vector3d position = frame.Apply(scene.cell_positions[site].cast<double>());
    for (const double coordinate : position) number(coordinate);
    number(static_cast<float>(scene.density[site] / frame.scale));
    number(static_cast<float>(scene.radius[site] * frame.scale));
    number(static_cast<float>(scene.volume[site] * std::pow(frame.scale, 3)));
    number(Value(scene.label_id[site]));
    number(scene.labels.confidence[site]);
    for (const float channel : scene.display_color[site]) number(int{Display8(channel)});
    number(Value(scene.ObjectId(site)));
    for (int k = 0; k < foam.ShStride(); ++k) {
      number(foam.sh[static_cast<size_t>(site) * foam.ShStride() + k]);
    }
    for (int k = 0; foam.HasColorGradients() && k < kColorGradientDim; ++k) {
      number(static_cast<float>(
          foam.color_gradient[static_cast<size_t>(site) * kColorGradientDim + k] / frame.scale));
    }
    const auto neighbors = scene.delaunay.Neighbors(site);
    const auto is_site = [&](uint32_t cell) { return cell < scene.NumSites(); };
    out.Number(std::count_if(neighbors.begin(), neighbors.end(), is_site));
    for (const uint32_t cell : neighbors) {
      if (!is_site(cell)) continue;
      out.Text(" ");
      out.Number(cell);
    }
    out.Text("\n");
  }
  out.Finish();
}

}  // namespace semfoam
