// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/masks/point_label_files.h"

#include "export/io/byte_writer.h"
#include "export/io/label_sidecar.h"
#include "export/scene/names.h"
#include "foam/util/output_file.h"

#include <algorithm>
#include <set>

#include <Eigen/Geometry>
#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using Json = nlohmann::ordered_json;
using Color = Eigen::Matrix<uint8_t, 3, 1>;

// Of a point that is no object.
constexpr uint8_t kGrey = 128;

Json Triple(const Eigen::Vector3d& v) { return Json::array({v.x(), v.y(), v.z()}); }

// What the points of one label have in common.
struct Group {
  int64_t points = 0;
  double confidence = 0;  // sum
  Eigen::AlignedBox3d box;
  std::set<int32_t> views;
};

std::vector<Group> GroupByLabel(const Reconstruction& model,
                                const MaskedPhotos& photos,
                                const std::vector<PointLabel>& points,
                                size_t num_labels) {
  std::vector<Group> groups(num_labels);
  for (size_t i = 0; i < points.size(); ++i) {
    if (points[i].class_index == kUnlabelled) continue;
    Group& group = groups[Value(points[i].class_index)];
    ++group.points;
    group.confidence += points[i].confidence;
    if (model.points[i].position.allFinite()) group.box.extend(model.points[i].position);
    for (const PixelObservation& observation : photos.observations[i])
      group.views.insert(observation.view);
  }
  return groups;
}

Json Summary(const Label& label, const Group& group, const std::vector<PhotoRecord>& photos) {
  Json summary = {
      {"id", Value(label.id)},
      {"name", DisplayName(label.id, label.name)},
      {"color", LabelColor(label.id)},
      {"points", group.points},
      {"confidence", group.points > 0 ? group.confidence / static_cast<double>(group.points) : 0}};
  if (!group.box.isEmpty()) {
    summary["bounding_box"] = Json::array({Triple(group.box.min()), Triple(group.box.max())});
  }
  summary["photos"] = Json::array();
  for (const int32_t view : group.views) summary["photos"].push_back(photos[view].name);
  return summary;
}

}  // namespace

Reconstruction ColoredByLabel(const Reconstruction& model,
                              const std::vector<PointLabel>& points,
                              const std::vector<Label>& labels) {
  CHECK_EQ(model.points.size(), points.size());
  Reconstruction colored = model;
  for (size_t i = 0; i < points.size(); ++i) {
    const LabelId id = LabelIdOf(labels, points[i].class_index);
    const auto color = LabelColor(id);
    colored.points[i].color =
        id == kNoObject ? Color(kGrey, kGrey, kGrey) : Color(color[0], color[1], color[2]);
  }
  return colored;
}

void WritePointsPly(const std::filesystem::path& path,
                    const Reconstruction& model,
                    const std::vector<PointLabel>& points,
                    const std::vector<Label>& labels) {
  CHECK_EQ(model.points.size(), points.size());
  ByteWriter file(path);
  file.Text(
      "ply\nformat binary_little_endian 1.0\ncomment Semantic Foam for COLMAP\nelement vertex ");
  file.Number(points.size());
  file.Text(
      "\nproperty double x\nproperty double y\nproperty double z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property int label\nproperty float confidence\nend_header\n");
  for (size_t i = 0; i < points.size(); ++i) {
    for (const double coordinate : model.points[i].position) file.Binary(coordinate);
    for (const uint8_t channel : model.points[i].color) file.Binary(channel);
    file.Binary(Value(LabelIdOf(labels, points[i].class_index)));
    file.Binary(points[i].confidence);
  }
  file.Finish();
}

void WritePointLabelsJson(const std::filesystem::path& path,
                          const Reconstruction& model,
                          const MaskedPhotos& photos,
                          const std::vector<PointLabel>& points,
                          const std::vector<Label>& labels) {
  Json json = Json::parse(LabelTableJson(labels));
  json["points"] = points.size();
  json["labelled"] = std::count_if(points.begin(), points.end(), [&](const PointLabel& point) {
    return LabelIdOf(labels, point.class_index) != kNoObject;
  });
  json["objects"] = Json::array();
  const std::vector<Group> groups = GroupByLabel(model, photos, points, labels.size());
  for (size_t k = 0; k < labels.size(); ++k) {
    if (labels[k].id == kNoObject) continue;
    json["objects"].push_back(Summary(labels[k], groups[k], photos.photos));
  }
  WriteTextFile(path, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace semfoam
