// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/checkpoint_state.h"
#include "foam/train/trainer_internal.h"
#include "foam/util/error.h"

#include <memory>
#include <string>
#include <utility>

namespace semfoam {

// What a checkpoint holds: these, and what TopologyUpdater::Save adds. All else is made from that
// again.
template <typename Archive>
void Trainer::SerializeNumbers(Archive* archive) {
  log_.Serialize(archive);
  archive->Number("step_limit_hits", &summary_.step_limit_hits);
  archive->Number("nonfinite_gradients", &summary_.nonfinite_gradients);
  archive->Number("nonfinite_pixels", &summary_.nonfinite_pixels);
  archive->Number("view_adaptations", &num_adaptations_);
  archive->Number("hanging_cell_searches", &num_hanging_cell_searches_);
  archive->Number("hanging_cells", &summary_.hanging_cells);
  evaluator_.Serialize(archive);
  topology_.Serialize(archive);
  sh_degree_.Serialize(archive);
  schedule_.Serialize(archive);
}

template <typename Archive>
void Trainer::SerializeArrays(size_t num_sites, size_t num_reports, Archive* archive) {
  const size_t identities = state_.foam.HasSemantics() ? num_sites * kIdentityDim : 0;
  const size_t classes = state_.foam.num_classes;
  archive->Array("positions", &state_.foam.positions, num_sites);
  archive->Array("raw_density", &state_.foam.raw_density, num_sites);
  archive->Array("sh", &state_.foam.sh, num_sites * state_.foam.ShStride());
  archive->Array("color_gradient",
                 &state_.foam.color_gradient,
                 options_.HasColorGradients() ? num_sites * kColorGradientDim : 0);
  archive->Array("identity", &state_.foam.identity, identities);
  archive->Array("classifier_weight", &state_.foam.classifier_weight, classes * kIdentityDim);
  archive->Array("classifier_bias", &state_.foam.classifier_bias, classes);
  archive->Array("squared_error", &state_.densification.squared_error, num_sites);
  archive->Array("contribution", &state_.densification.contribution, num_sites);
  camera_cells_.Serialize(archive);
  log_.SerializeReports(num_reports, archive);
}

template <typename Archive>
void Trainer::SerializeBlock(size_t num_sites, Archive* archive) {
  archive->Array("is_frozen", &state_.is_frozen, num_sites);
  archive->Array("ancestor", &state_.ancestor, num_sites);
  pixels_.squares().Serialize(views_, archive);
}

namespace {

constexpr char kCpu[] = "cpu", kGpu[] = "cuda";

}  // namespace

void RequireSameDevice(const Checkpoint& checkpoint, DeviceKind device) {
  const auto& state = checkpoint.Texts("state");
  const auto found = state.find("device");
  const std::string saved = found == state.end() ? kCpu : found->second;
  if (saved != kCpu && saved != kGpu) {
    checkpoint.ThrowDamaged("its 'device' is neither 'cpu' nor 'cuda'");
  }
  const bool of_gpu = saved == kGpu;
  if (of_gpu == (device == DeviceKind::kGpu)) return;
  constexpr char kInWords[2][20] = {"the CPU", "a GPU"};
  throw UserError(checkpoint.path().string(),
                  ": this checkpoint was made on ",
                  kInWords[of_gpu],
                  ", and gone on with on ",
                  kInWords[!of_gpu],
                  " the run would end with other bytes; ",
                  Field{"device"},
                  " ",
                  of_gpu ? "cuda:0, or another GPU" : "cpu",
                  ", or training from the beginning, would be right.");
}

void Trainer::Save(CheckpointContents* contents) {
  log_.StampSeconds();
  device_->Download();
  const size_t num_sites = state_.foam.NumSites(), num_reports = log_.reports().size();
  const int num_views = views_.NumViews();
  StateWriter options("training_options", contents), state("state", contents),
      guard("guard", contents);
  TrainingOptions same = options_;
  same.Serialize(&options);
  contents->texts["state"]["device"] = device_->Kind() == DeviceKind::kGpu ? kGpu : kCpu;
  state.Number("views", &num_views);
  state.Number("classes", &state_.foam.num_classes);
  state.Number("sites", &num_sites);
  state.Number("sh_degree", &state_.foam.sh_degree);
  state.Number("reports", &num_reports);
  SerializeNumbers(&state);
  SerializeArrays(num_sites, num_reports, &state);
  if (TrainsBlock()) SerializeBlock(num_sites, &state);
  state_.optimizer->Serialize(&state);
  guard_.Serialize(&guard);
  topology_.Save(contents);
}

// Compares the caller's options and sizes with the checkpoint's.
void Trainer::RequireSameRun(int num_classes, const Checkpoint& checkpoint) const {
  const auto require =
      [&](const std::string& what, const std::string& saved, const std::string& now) {
        if (saved == now) return;
        throw UserError(checkpoint.path().string(),
                        ": this checkpoint is of a run with ",
                        what,
                        " ",
                        saved,
                        ", not ",
                        now,
                        "; the same again, or training from the beginning, would be right.");
      };
  CheckpointContents contents;
  StateWriter writer("training_options", &contents);
  TrainingOptions same = options_;
  same.Serialize(&writer);
  const auto& saved = checkpoint.Texts("training_options");
  for (const auto& [name, value] : contents.texts["training_options"]) {
    const auto found = saved.find(name);
    if (found == saved.end()) checkpoint.ThrowDamaged("it lacks the option '" + name + "'");
    require(name, found->second, value);
  }
  int views = 0, classes = 0;
  StateReader state("state", checkpoint);
  state.Number("views", &views);
  state.Number("classes", &classes);
  require("a number of photos of", FormatNumber(views), FormatNumber(views_.NumViews()));
  require("a number of labels of", FormatNumber(classes), FormatNumber(num_classes));
}

void Trainer::Resume(int num_classes, std::unique_ptr<const Checkpoint> checkpoint) {
  RequireSameRun(num_classes, *checkpoint);
  RequireSameDevice(*checkpoint, device_->Kind());
  StateReader state("state", *checkpoint), guard("guard", *checkpoint);
  state_.foam.num_classes = num_classes;
  size_t num_sites = 0, num_reports = 0;
  state.Number("sites", &num_sites);
  state.Number("sh_degree", &state_.foam.sh_degree);
  state.Number("reports", &num_reports);
  if (state_.foam.sh_degree < 0 || state_.foam.sh_degree > options_.sh_degree) {
    checkpoint->ThrowDamaged("its SH degree is out of range");
  }
  SerializeNumbers(&state);
  if (log_.iteration() < 0 || log_.iteration() >= schedule_.num_iterations()) {
    checkpoint->ThrowDamaged("its iteration is beyond the end of the run");
  }
  SerializeArrays(num_sites, num_reports, &state);
  if (checkpoint->HasArray("is_frozen")) SerializeBlock(num_sites, &state);
  state_.optimizer = std::make_unique<FoamOptimizer>(state_.foam, state_.is_frozen);
  state_.optimizer->Serialize(&state);
  guard_.Serialize(&guard);
  const TopologyUpdater::SavedSites sites = topology_.Read(*checkpoint, log_.iteration());
  checkpoint.reset();  // Triangulating needs the memory.
  topology_.Restore(sites);
  sh_degree_.Restore();
  OpenPixelCache();
  log_.RestartClock();
}

}  // namespace semfoam
