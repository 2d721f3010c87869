// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/labelled_files.h"

#include "export/transfer/ply_split.h"
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

void RequireRoomForLabelled(const fs::path& output_path, const fs::path& file, bool split) {
  const fs::path sidecar = output_path / kSidecar;
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
  require_ours(output_path / file, file.string() == ours);
  if (split) require_ours(output_path / "objects", !ours.empty());
}

TransferredLabels WriteLabelled(LabelSource* source,
                                const LabelledFiles& files,
                                const std::string& source_checksum) {
  const fs::path& input = files.input;
  const fs::path& folder = files.output_path;
  const fs::path output = folder / input.filename();
  const auto begin = std::chrono::steady_clock::now();
  TransferredLabels transferred;
  {
    ProgressLine line;
    transferred = TransferLabels(
        source, input, output, files.smoothness, [&](const std::string& what, double done) {
          const std::string text = what + ", " + std::to_string(std::lround(100 * done)) + " %";
          line.Show({what, done, SecondsSince(begin), text});
        });
    line.Clear();
  }
  std::vector<WrittenFile> parts;
  if (files.split) parts = SplitLabelledPly(output, folder, source->labels(), files.cap);
  WriteTransferSidecar(
      folder / kSidecar, *source, transferred, input.filename().string(), source_checksum, parts);
  const bool is_mesh = transferred.faces > 0;
  LOG(INFO) << output.string() << ": " << transferred.vertices
            << (is_mesh ? " vertices and " + std::to_string(transferred.faces) + " faces"
                        : " points")
            << " labelled in " << FormatDuration(SecondsSince(begin));
  if (transferred.unknown > 0) {
    std::ostringstream share;
    share.precision(2);
    share << 100.0 * static_cast<double>(transferred.unknown) /
                 static_cast<double>(transferred.asked);
    LOG(INFO) << share.str() << " % of the " << (is_mesh ? "vertices" : "points")
              << (source->Tolerance() > 0 ? " are far from all matter of the foam"
                                          : " are seen by no photo");
  }
  for (const WrittenFile& part : parts) LOG(INFO) << "  " << part.path << ": " << part.summary;
  return transferred;
}

}  // namespace semfoam
