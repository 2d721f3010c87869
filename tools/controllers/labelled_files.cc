// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/labelled_files.h"

#include "export/transfer/mesh_file.h"
#include "foam/util/elapsed_time.h"
#include "foam/util/error.h"
#include "foam/util/json_file.h"
#include "tools/support/progress.h"

#include <chrono>
#include <cmath>
#include <sstream>
#include <vector>

#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSidecar = "labels.json";

}  // namespace

fs::path LabelledFile(const LabelledFiles& files) {
  RequireLabelledFormat(files.input, files.output_path, files.options.split);
  return files.output_path / LabelledName(files.input, RecognizeMeshFormat(files.input));
}

void RequireRoomForLabelled(const LabelledFiles& files) {
  const fs::path labelled = LabelledFile(files);
  const fs::path sidecar = files.output_path / kSidecar;
  std::string ours;
  if (fs::exists(sidecar)) {
    const nlohmann::json json = ReadJsonFile(sidecar);
    const auto transfer = json.is_object() ? json.find("transfer") : json.end();
    if (transfer == json.end() || !transfer->is_object()) {
      throw UserError(sidecar.string(),
                      ": was not written by label_transfer and would be lost; give another ",
                      Field{"output_path"},
                      ".");
    }
    if (const auto name = transfer->find("file"); name != transfer->end() && name->is_string()) {
      ours = name->get<std::string>();
    }
  }
  const auto require_ours = [](const fs::path& target, bool is_ours) {
    if (is_ours || !fs::exists(target)) return;
    throw UserError(target.string(),
                    ": was not written by label_transfer and would be lost; give another ",
                    Field{"output_path"},
                    ".");
  };
  require_ours(labelled, labelled.filename().string() == ours);
  if (files.options.split) require_ours(files.output_path / "objects", !ours.empty());
}

TransferredLabels WriteLabelled(LabelSource* source,
                                const LabelledFiles& files,
                                const std::string& source_checksum) {
  const fs::path& input = files.input;
  const fs::path& folder = files.output_path;
  const fs::path output = LabelledFile(files);
  const auto begin = std::chrono::steady_clock::now();
  TransferredLabels transferred;
  {
    ProgressLine line;
    transferred = TransferLabels(
        source, input, output, files.options, [&](const std::string& what, double done) {
          const std::string text = what + ", " + std::to_string(std::lround(100 * done)) + " %";
          line.Show({what, done, SecondsSince(begin), text});
        });
    line.Clear();
  }
  WriteTransferSidecar(
      folder / kSidecar, *source, transferred, output.filename().string(), source_checksum);
  const bool is_mesh = transferred.faces > 0;
  LOG(INFO) << output.string() << ": " << transferred.vertices
            << (is_mesh ? " vertices and " + std::to_string(transferred.faces) + " faces"
                        : " points")
            << " labelled in " << FormatDuration(SecondsSince(begin));
  if (output.filename() != input.filename()) {
    LOG(INFO) << "  " << input.filename().string()
              << " has no place for labels, so the labelled mesh is a PLY";
  }
  if (transferred.unknown > 0) {
    std::ostringstream share;
    share.precision(2);
    share << 100.0 * static_cast<double>(transferred.unknown) /
                 static_cast<double>(transferred.asked);
    LOG(INFO) << share.str() << " % of the " << (is_mesh ? "vertices" : "points")
              << (source->Tolerance() > 0 ? " are far from all matter of the foam"
                                          : " are seen by no photo");
  }
  for (const WrittenFile& part : transferred.parts)
    LOG(INFO) << "  " << part.path << ": " << part.summary;
  return transferred;
}

}  // namespace semfoam
