// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/radiant_foam_ply.h"

#include "export/io/byte_writer.h"
#include "export/io/ply_file.h"
#include "foam/geometry/delaunay.h"
#include "foam/geometry/guard_sites.h"
#include "foam/model/activation.h"
#include "foam/model/spherical_harmonics.h"
#include "foam/util/error.h"
#include "foam/util/median.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// The smallest density that is told from none; an activation that is never 0 has no raw value for
// 0.
constexpr double kLeastDensity = 1e-9;

// Of a cell's radius: by so much floats may move its site.
constexpr double kLargestError = 0.01;

// So that the sites lie around the origin, at about unit distance.
Similarity FrameOfSites(const std::vector<Eigen::Vector3d>& sites) {
  Similarity frame;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values(sites.size());
    for (size_t i = 0; i < sites.size(); ++i) values[i] = sites[i][axis];
    frame.translation[axis] = Median(std::move(values));
  }
  std::vector<double> distances(sites.size());
  for (size_t i = 0; i < sites.size(); ++i) distances[i] = (sites[i] - frame.translation).norm();
  const double farthest = *std::max_element(distances.begin(), distances.end());
  frame.scale = std::max(Median(std::move(distances)), farthest / (0.99 * kFarRadius));
  if (!(frame.scale > 0)) frame.scale = 1;  // all in one place
  return frame;
}

int DegreeOf(const PlyFile& ply) {
  size_t num_rest = 0;
  for (const std::string& name : ply.Properties("vertex")) {
    num_rest += name.rfind("color_sh_", 0) == 0;
  }
  for (int degree = 0; degree <= 3; ++degree) {
    if (num_rest == 3 * static_cast<size_t>(NumShCoefficients(degree) - 1)) return degree;
  }
  throw UserError(ply.path().string(),
                  ": has ",
                  num_rest,
                  " properties color_sh_*; 0, 9, 24 or 45 would be right, of degree 0 to 3.");
}

void CheckAdjacency(const PlyFile& ply) {
  const double num_sites = static_cast<double>(ply.Count("vertex"));
  double last = 0;
  for (const double end : ply.Values("vertex", "adjacency_offset")) {
    if (end < last) {
      throw UserError(ply.path().string(),
                      ": has adjacency_offsets that do not ascend; is it damaged?");
    }
    last = end;
  }
  if (last != static_cast<double>(ply.Count("adjacency"))) {
    throw UserError(ply.path().string(),
                    ": has ",
                    ply.Count("adjacency"),
                    " neighbours, while the last adjacency_offset is ",
                    static_cast<uint64_t>(last),
                    "; both would be the same; is it damaged?");
  }
  if (last == 0) return;
  for (const double neighbor : ply.Values("adjacency", "adjacency")) {
    if (neighbor >= num_sites) {
      throw UserError(ply.path().string(),
                      ": names a neighbour ",
                      static_cast<uint64_t>(neighbor),
                      " of ",
                      ply.Count("vertex"),
                      " sites, of which the first is 0; is it damaged?");
    }
  }
}

// Reads the sites, in the file's frame.
std::vector<Eigen::Vector3d> ReadSites(const PlyFile& ply) {
  std::vector<Eigen::Vector3d> sites(ply.Count("vertex"));
  for (const auto& [axis, name] : {std::pair(0, "x"), {1, "y"}, {2, "z"}}) {
    const std::vector<double> values = ply.Values("vertex", name);
    for (size_t i = 0; i < sites.size(); ++i) sites[i][axis] = values[i];
  }
  for (size_t i = 0; i < sites.size(); ++i) {
    if (sites[i].allFinite()) continue;
    throw UserError(
        ply.path().string(), ": site ", i, " has a position that is not finite; is it damaged?");
  }
  return sites;
}

// Reads the coefficients of the spherical harmonics, [ShStride][sites], in the order of Foam::sh.
std::vector<std::vector<double>> ReadSh(const PlyFile& ply, int sh_stride) {
  std::vector<std::vector<double>> sh;
  for (const char* name : {"red", "green", "blue"}) {
    sh.push_back(ply.Values("vertex", name));
    for (double& value : sh.back()) value = (value / 255 - 0.5) / kShDc;
  }
  for (int k = 0; k < sh_stride - 3; ++k) {
    sh.push_back(ply.Values("vertex", "color_sh_" + std::to_string(k)));
  }
  return sh;
}

// Returns the raw density, normalised frame, of a density per unit of the file.
float NormalizedRawDensity(double density, double scale, uint32_t site, const fs::path& path) {
  const double normalized = density * scale;
  const auto raw = static_cast<float>(RawDensity(std::max(normalized, kLeastDensity)));
  if (!(normalized >= 0 && std::isfinite(raw))) {
    throw UserError(path.string(),
                    ": site ",
                    site,
                    " has the density ",
                    density,
                    "; finite and not negative would be right.");
  }
  return raw;
}

// Returns one line for each property of the file, up to the end of the header.
std::string MakeHeader(uint32_t num_sites, int num_rest, size_t num_adjacent) {
  std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(num_sites) + "\n";
  for (const char* name : {"float x",
                           "float y",
                           "float z",
                           "uchar red",
                           "uchar green",
                           "uchar blue",
                           "float density",
                           "uint adjacency_offset"}) {
    header += std::string("property ") + name + "\n";
  }
  for (int k = 0; k < num_rest; ++k) {
    header += "property float color_sh_" + std::to_string(k) + "\n";
  }
  return header + "element adjacency " + std::to_string(num_adjacent) +
         "\nproperty uint adjacency\nend_header\n";
}

// Returns the sites in the COLMAP frame. Throws UserError where floats would move the cells.
std::vector<Eigen::Vector3f> FloatSites(const Foam& foam,
                                        const ExportableScene& scene,
                                        const fs::path& path) {
  const Similarity& frame = scene.colmap_from_normalized;
  std::vector<Eigen::Vector3f> positions;
  std::vector<double> errors;
  std::vector<double> radii;
  for (uint32_t i = 0; i < foam.NumSites(); ++i) {
    const Eigen::Vector3d exact = frame.Apply(foam.positions[i].cast<double>());
    positions.push_back(exact.cast<float>());
    errors.push_back((positions.back().cast<double>() - exact).norm());
    radii.push_back(frame.scale * scene.radius[i]);
  }
  if (!positions.empty() && Median(errors) > kLargestError * Median(radii)) {
    throw UserError(
        path.string(),
        ": cannot be written: the COLMAP model lies so far from its origin that Radiant "
        "Foam's floats would move the cells; a model moved to its origin (colmap "
        "model_transformer) would be right.");
  }
  return positions;
}

}  // namespace

void WriteRadiantFoamPly(const fs::path& path, const Model& model, const ExportableScene& scene) {
  const Foam& foam = model.foam;
  const uint32_t num_sites = scene.NumSites();
  CHECK_EQ(foam.NumSites(), num_sites);
  const std::vector<Eigen::Vector3f> positions = FloatSites(foam, scene, path);

  std::vector<uint32_t> adjacency;
  std::vector<uint32_t> ends;
  for (uint32_t i = 0; i < num_sites; ++i) {
    for (const uint32_t j : scene.delaunay.Neighbors(i)) {
      if (j < num_sites) adjacency.push_back(j);
    }
    ends.push_back(static_cast<uint32_t>(adjacency.size()));
  }

  const int num_rest = foam.ShStride() - 3;
  ByteWriter out(path);
  out.Text(MakeHeader(num_sites, num_rest, adjacency.size()));
  for (uint32_t i = 0; i < num_sites; ++i) {
    for (const float coordinate : positions[i]) out.Binary(coordinate);
    const float* sh = &foam.sh[static_cast<size_t>(i) * foam.ShStride()];
    for (int c = 0; c < 3; ++c) {
      const double display = std::clamp(0.5 + kShDc * sh[c], 0.0, 1.0);
      out.Binary(static_cast<uint8_t>(std::lround(255 * display)));
    }
    out.Binary(static_cast<float>(Density<double>(foam.raw_density[i]) /
                                  scene.colmap_from_normalized.scale));
    out.Binary(ends[i]);
    for (int k = 0; k < num_rest; ++k) out.Binary(sh[3 + k]);
  }
  for (const uint32_t neighbor : adjacency) out.Binary(neighbor);
  out.Finish();
}

Model ReadRadiantFoamPly(const fs::path& path) {
  const PlyFile ply(path);
  if (ply.Count("vertex") == 0) {
    throw UserError(path.string(),
                    ": has no sites; an element vertex with one at least would be right.");
  }
  Model model;
  model.foam.sh_degree = DegreeOf(ply);
  CheckAdjacency(ply);
  const std::vector<Eigen::Vector3d> sites = ReadSites(ply);
  model.world_from_normalized = FrameOfSites(sites);
  std::vector<Eigen::Vector3f> positions(sites.size());
  for (size_t i = 0; i < sites.size(); ++i) {
    positions[i] = model.world_from_normalized.Invert(sites[i]).cast<float>();
  }
  const std::vector<double> density = ply.Values("vertex", "density");
  const std::vector<std::vector<double>> sh = ReadSh(ply, model.foam.ShStride());
  for (const uint32_t i : HilbertOrder(positions)) {
    model.foam.positions.push_back(positions[i]);
    model.foam.raw_density.push_back(
        NormalizedRawDensity(density[i], model.world_from_normalized.scale, i, path));
    for (const std::vector<double>& coefficient : sh) {
      if (!std::isfinite(coefficient[i])) {
        throw UserError(
            path.string(), ": site ", i, " has a colour that is not finite; is it damaged?");
      }
      model.foam.sh.push_back(static_cast<float>(coefficient[i]));
    }
  }
  return model;
}

}  // namespace semfoam
