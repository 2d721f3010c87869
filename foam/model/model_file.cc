// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/model/model.h"
#include "foam/util/checksummed_file.h"
#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/json_file.h"
#include "foam/util/photo_name.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>

#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float), "positions are written as they lie");

using Json = nlohmann::json;

constexpr ChecksummedFormat kFormat = {
    .magic = {'S', 'E', 'M', 'F', 'O', 'A', 'M', '\n'}, .version = 2, .alignment = 64};
// Cells of version 1 are of one colour each.
constexpr uint32_t kOldestVersion = 1;
constexpr int kMaxClasses = 65536;
constexpr int kMaxPhotoSide = 1'000'000;

// One float array of the model: its name in the file, where it lies in memory, and the shape that
// the rest of the model implies.
struct ArrayView {
  std::string name;
  std::vector<size_t> shape;
  std::span<const float> values;
};

std::span<const float> Floats(std::span<const float> v) { return v; }
std::span<const float> Floats(const std::vector<Eigen::Vector3f>& v) {
  return {reinterpret_cast<const float*>(v.data()), 3 * v.size()};
}

// Returns the embeddings of the labels that have one, row after row; `*dimension` is the length of
// a row, 0 where there are none.
std::vector<float> EmbeddingsOf(const std::vector<Label>& labels, size_t* dimension) {
  std::vector<float> rows;
  *dimension = 0;
  for (const Label& label : labels) {
    const std::vector<float>& embedding = label.features.embedding;
    if (embedding.empty()) continue;
    CHECK(*dimension == 0 || *dimension == embedding.size()) << "embeddings of different lengths";
    *dimension = embedding.size();
    rows.insert(rows.end(), embedding.begin(), embedding.end());
  }
  return rows;
}

// `embeddings` is the result of EmbeddingsOf.
std::vector<ArrayView> Arrays(const Model& model,
                              const std::vector<float>& embeddings,
                              size_t embedding_dimension) {
  const Foam& foam = model.foam;
  const size_t n = foam.NumSites();
  const size_t k = foam.num_classes;
  const size_t sh = NumShCoefficients(foam.sh_degree);
  std::vector<ArrayView> arrays = {{"positions", {n, 3}, Floats(foam.positions)},
                                   {"raw_density", {n}, Floats(foam.raw_density)},
                                   {"sh", {n, sh, 3}, Floats(foam.sh)}};
  // What a model does not have takes no bytes.
  if (!foam.assumed_density.empty()) {
    arrays.push_back({"assumed_density", {n}, Floats(foam.assumed_density)});
  }
  if (foam.HasColorGradients()) {
    arrays.push_back({"color_gradient", {n, 3, 3}, Floats(foam.color_gradient)});
  }
  if (foam.HasSemantics()) {
    arrays.push_back({"identity", {n, kIdentityDim}, Floats(foam.identity)});
    arrays.push_back({"classifier_weight", {k, kIdentityDim}, Floats(foam.classifier_weight)});
    arrays.push_back({"classifier_bias", {k}, Floats(foam.classifier_bias)});
  }
  if (!model.statistics.contribution.empty()) {
    arrays.push_back({"contribution", {n}, Floats(model.statistics.contribution)});
    arrays.push_back({"mean_color", {n, 3}, Floats(model.statistics.mean_color)});
  }
  if (!model.statistics.passed.empty()) {
    arrays.push_back({"passed", {n}, Floats(model.statistics.passed)});
    arrays.push_back({"stopped", {n}, Floats(model.statistics.stopped)});
  }
  if (!embeddings.empty()) {
    arrays.push_back({"label_embeddings",
                      {embeddings.size() / embedding_dimension, embedding_dimension},
                      Floats(embeddings)});
  }
  return arrays;
}

Json VectorToJson(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json Header(const Model& model) {
  Json header;
  header["sites"] = model.foam.NumSites();
  header["sh_degree"] = model.foam.sh_degree;
  header["classes"] = model.foam.num_classes;
  header["identity_dimension"] = kIdentityDim;
  header["world_from_normalized"] = {
      {"scale", model.world_from_normalized.scale},
      {"translation", VectorToJson(model.world_from_normalized.translation)}};
  header["labels"] = Json::array();
  for (const Label& label : model.labels) {
    Json entry = {
        {"id", Value(label.id)}, {"source_id", Value(label.source_id)}, {"name", label.name}};
    const LabelFeatures& features = label.features;
    if (!features.class_name.empty()) entry["class"] = features.class_name;
    if (features.score) entry["score"] = *features.score;
    if (!features.embedding.empty()) {
      entry["has_embedding"] = true;
      header["embedding_dimension"] = features.embedding.size();
    }
    header["labels"].push_back(std::move(entry));
  }
  header["photos"] = Json::array();
  for (const PhotoRecord& photo : model.photos) {
    const Eigen::Quaterniond& q = photo.cam_from_world_rotation;
    header["photos"].push_back(
        {{"name", photo.name},
         {"camera_model", photo.camera_model},
         {"width", photo.width},
         {"height", photo.height},
         {"camera_params", photo.camera_params},
         {"cam_from_world_rotation_wxyz", {q.w(), q.x(), q.y(), q.z()}},
         {"cam_from_world_translation", VectorToJson(photo.cam_from_world_translation)},
         {"held_out", photo.held_out}});
  }
  header["options"] = model.options;
  return header;
}

// Returns a whole number of the header: get<int>() would make one of 1e300, and of 2^32 as well.
template <typename T>
T Whole(const Json& json, const std::string& key, int64_t low, int64_t high) {
  const auto number = JsonInteger(json.at(key), low, high);
  if (number.has_value()) return static_cast<T>(*number);
  throw "its '" + key + "' is not " + std::to_string(low) + " to " + std::to_string(high);
}

Eigen::Vector3d VectorFromJson(const Json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()};
}

// Fills everything but the arrays. Throws Json::exception or std::string (what is wrong) where the
// header is not as Header() writes it.
void ParseHeader(const Json& header, Model* model) {
  Foam& foam = model->foam;
  foam.sh_degree = Whole<int>(header, "sh_degree", 0, 3);
  foam.num_classes = Whole<int>(header, "classes", 0, kMaxClasses);
  Whole<int>(header, "identity_dimension", kIdentityDim, kIdentityDim);
  const Json& similarity = header.at("world_from_normalized");
  model->world_from_normalized.scale = similarity.at("scale").get<double>();
  model->world_from_normalized.translation = VectorFromJson(similarity.at("translation"));
  if (!(model->world_from_normalized.scale > 0) ||
      !std::isfinite(model->world_from_normalized.scale)) {
    throw std::string("its scale is not positive");
  }
  std::set<LabelId> ids;
  for (const Json& entry : header.at("labels")) {
    Label& label = model->labels.emplace_back();
    label.id = LabelId{Whole<int32_t>(entry, "id", 0, kMaxClasses - 1)};
    label.source_id =
        MaskId{Whole<uint32_t>(entry, "source_id", 0, std::numeric_limits<uint32_t>::max())};
    label.name = entry.at("name").get<std::string>();
    label.features.class_name = entry.value("class", "");
    if (entry.contains("score")) {
      label.features.score = entry.at("score").get<double>();
      if (!(*label.features.score >= 0)) throw std::string("the score of a label is negative");
    }
    if (!ids.insert(label.id).second) {
      throw "it has two labels of id " + std::to_string(Value(label.id));
    }
  }
  if (model->labels.size() != static_cast<size_t>(foam.num_classes)) {
    throw std::string("its label table has another length than its classifier");
  }
  for (const Json& entry : header.at("photos")) {
    PhotoRecord& photo = model->photos.emplace_back();
    photo.name = entry.at("name").get<std::string>();
    if (!StaysBelowFolder(photo.name)) {
      throw "a photo's name, \"" + photo.name + "\", leaves the image folder";
    }
    photo.camera_model = entry.at("camera_model").get<std::string>();
    photo.width = Whole<int>(entry, "width", 1, kMaxPhotoSide);
    photo.height = Whole<int>(entry, "height", 1, kMaxPhotoSide);
    photo.camera_params = entry.at("camera_params").get<std::vector<double>>();
    const Json& q = entry.at("cam_from_world_rotation_wxyz");
    photo.cam_from_world_rotation = Eigen::Quaterniond(
        q.at(0).get<double>(), q.at(1).get<double>(), q.at(2).get<double>(), q.at(3).get<double>());
    if (!(std::abs(photo.cam_from_world_rotation.norm() - 1) < 1e-3)) {
      throw "the rotation of photo '" + Shortened(photo.name) + "' has another length than 1";
    }
    photo.cam_from_world_translation = VectorFromJson(entry.at("cam_from_world_translation"));
    photo.held_out = entry.at("held_out").get<bool>();
  }
  model->options = header.at("options").get<std::map<std::string, std::string>>();
}

// What a file holds between its preamble and its checksum.
struct Content {
  std::string bytes;  // the header, then the arrays
  size_t header_bytes = 0;
  uint64_t file_bytes = 0;  // of the whole file

  std::string_view HeaderText() const { return std::string_view(bytes).substr(0, header_bytes); }
};

// Reads and verifies a file. Throws UserError where it is no foam model, of another version or
// damaged.
Content ReadContent(const std::filesystem::path& path) {
  const std::string name = path.string();
  ChecksummedReader file(path, "a foam model such as foam_trainer's scene.foam", kFormat);
  if (file.size() < ChecksummedFormat::kPreambleBytes + ChecksummedFormat::kChecksumBytes ||
      !file.HasMagic()) {
    throw UserError(name, ": this is not a foam model; foam_trainer writes one named scene.foam.");
  }
  if (file.version() < kOldestVersion || file.version() > kFormat.version) {
    throw UserError(name,
                    ": it has format version ",
                    file.version(),
                    ", and this program reads versions ",
                    kOldestVersion,
                    " to ",
                    kFormat.version,
                    "; use the program version that wrote it.");
  }
  Content content;
  content.file_bytes = file.size();
  content.bytes.resize(file.left() - ChecksummedFormat::kChecksumBytes);
  if (!file.Read(content.bytes.data(), content.bytes.size()) || !file.ChecksumMatches()) {
    throw UserError(name, ": it is damaged or cut (its checksum does not match); copy it again.");
  }
  if (file.header_bytes() > content.bytes.size()) {
    throw UserError(name, ": it is damaged (its header is longer than the file); train it again.");
  }
  content.header_bytes = file.header_bytes();
  return content;
}

// Copies one array of the file to `out`, whose length the header has set; the table, whose offsets
// count from the end of the header, must agree with it and lie in the file.
void ReadArray(const Content& content,
               const Json& table,
               const std::string& name,
               size_t num_values,
               float* out) {
  const Json& entry = table.at(name);
  const auto file_size = static_cast<int64_t>(content.file_bytes);
  const auto offset = content.header_bytes + Whole<size_t>(entry, "offset", 0, file_size);
  size_t in_file = 1;
  for (const Json& extent : entry.at("shape")) {
    const auto length = JsonInteger(extent, 0, file_size);
    if (!length) throw "array '" + name + "' is larger than the file";
    in_file *= static_cast<size_t>(*length);
    if (in_file > content.file_bytes) throw "array '" + name + "' is larger than the file";
  }
  if (entry.at("type") != "float32" || in_file != num_values) {
    throw "array '" + name + "' has another size than the header says";
  }
  const size_t end = content.bytes.size();
  if (offset > end || num_values * sizeof(float) > end - offset) {
    throw "array '" + name + "' reaches beyond the end of the file";
  }
  std::memcpy(out, content.bytes.data() + offset, num_values * sizeof(float));
  for (size_t i = 0; i < num_values; ++i) {
    if (!std::isfinite(out[i])) throw "array '" + name + "' holds a number that is not finite";
  }
}

void ReadArrays(const Content& content, const Json& header, Model* model) {
  const Json& table = header.at("arrays");
  // Bounded before anything is allocated: every site has at least its 12 bytes of position in the
  // file.
  const auto most = static_cast<int64_t>(content.file_bytes / sizeof(Eigen::Vector3f));
  const auto n = Whole<size_t>(header, "sites", 0, most);
  const auto read = [&](const std::string& name, size_t length, auto* out) {
    if (length > content.file_bytes / sizeof(float)) {
      throw "array '" + name + "' is larger than the file";
    }
    out->resize(length);
    ReadArray(content, table, name, length, out->data());
  };
  const auto read_vectors = [&](const std::string& name, std::vector<Eigen::Vector3f>* out) {
    out->resize(n);
    ReadArray(content, table, name, 3 * n, reinterpret_cast<float*>(out->data()));
  };
  Foam& foam = model->foam;
  read_vectors("positions", &foam.positions);
  read("raw_density", n, &foam.raw_density);
  read("sh", n * foam.ShStride(), &foam.sh);
  if (table.contains("assumed_density")) {
    read("assumed_density", n, &foam.assumed_density);
    if (std::any_of(foam.assumed_density.begin(), foam.assumed_density.end(), [](float density) {
          return density < 0;
        })) {
      throw std::string("array 'assumed_density' holds a negative density");
    }
  }
  if (table.contains("color_gradient")) {
    read("color_gradient", n * kColorGradientDim, &foam.color_gradient);
  }
  if (foam.HasSemantics()) {
    const size_t k = foam.num_classes;
    read("identity", n * kIdentityDim, &foam.identity);
    read("classifier_weight", k * kIdentityDim, &foam.classifier_weight);
    read("classifier_bias", k, &foam.classifier_bias);
  }
  if (table.contains("contribution")) {
    read("contribution", n, &model->statistics.contribution);
    read_vectors("mean_color", &model->statistics.mean_color);
  }
  if (table.contains("passed")) {
    read("passed", n, &model->statistics.passed);
    read("stopped", n, &model->statistics.stopped);
  }
  if (table.contains("label_embeddings")) {
    std::vector<Label*> with_embedding;
    for (size_t k = 0; k < model->labels.size(); ++k) {
      if (header.at("labels").at(k).value("has_embedding", false)) {
        with_embedding.push_back(&model->labels[k]);
      }
    }
    const auto dimension =
        Whole<size_t>(header, "embedding_dimension", 1, static_cast<int64_t>(content.file_bytes));
    std::vector<float> rows;
    read("label_embeddings", with_embedding.size() * dimension, &rows);
    auto row = rows.begin();
    for (Label* label : with_embedding) {
      label->features.embedding.assign(row, row + static_cast<ptrdiff_t>(dimension));
      row += static_cast<ptrdiff_t>(dimension);
    }
  }
}

}  // namespace

void WriteModel(const std::filesystem::path& path, const Model& model) {
  CHECK_EQ(model.labels.size(), static_cast<size_t>(model.foam.num_classes));
  size_t embedding_dimension = 0;
  const std::vector<float> embeddings = EmbeddingsOf(model.labels, &embedding_dimension);
  const std::vector<ArrayView> arrays = Arrays(model, embeddings, embedding_dimension);
  Json header = Header(model);
  // Offsets count from the first byte after the header, so that they do not depend on the header's
  // own length.
  size_t offset = 0;
  for (const ArrayView& array : arrays) {
    size_t length = 1;
    for (const size_t extent : array.shape) length *= extent;
    CHECK_EQ(array.values.size(), length) << array.name;
    header["arrays"][array.name] = {
        {"type", "float32"}, {"shape", array.shape}, {"offset", offset}};
    offset = kFormat.Aligned(offset + length * sizeof(float));
  }
  ChecksummedWriter file(path, kFormat, HeaderText(path, header, "a photo's or label"));
  for (const ArrayView& array : arrays) file.Write(std::as_bytes(array.values));
  file.WriteChecksum();
  file.Commit();
}

Model ReadModel(const std::filesystem::path& path) {
  const Content content = ReadContent(path);
  Model model;
  try {
    const std::optional<Json> header = ParseHeaderText(content.HeaderText());
    if (!header) throw std::string("its header is not as it was written");
    ParseHeader(*header, &model);
    ReadArrays(content, *header, &model);
  } catch (const Json::exception& error) {
    // Behind the library's name for the fault.
    const std::string reason = error.what();
    throw UserError(path.string(),
                    ": its header is damaged (",
                    reason.substr(reason.find("] ") + 2),
                    "); train it again.");
  } catch (const std::string& reason) {
    throw UserError(path.string(), ": it is damaged (", reason, "); train it again.");
  }
  return model;
}

}  // namespace semfoam
