// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/geometry/guard_sites.h"
#include "foam/train/checkpoint_state.h"
#include "foam/train/trainer_internal.h"
#include "foam/util/elapsed_time.h"
#include "foam/util/error.h"
#include "foam/view/view_renderer.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace semfoam {

// What a checkpoint holds: these, and where the sites were when they were triangulated and when
// their planes were made; of a triangulation under way, what it is made of. All else is made from
// that again.
template <typename Archive>
void Trainer::SerializeNumbers(Archive* archive) {
  archive->Number("iteration", &progress_.iteration);
  archive->Number("rays", &progress_.rays);
  archive->Number("seconds", &progress_.seconds);
  archive->Number("seconds_left", &progress_.seconds_left);
  archive->Number("reported_color_loss", &progress_.color_loss);
  archive->Number("reported_opacity_loss", &progress_.opacity_loss);
  archive->Number("reported_quantile_loss", &progress_.quantile_loss);
  archive->Number("reported_identity_loss", &progress_.identity_loss);
  archive->Number("reported_tv_loss", &progress_.tv_loss);
  archive->Number("held_out_psnr", &progress_.held_out_psnr);
  archive->Number("held_out_miou", &progress_.held_out_miou);
  archive->Number("color_loss", &loss_sum_.color);
  archive->Number("opacity_loss", &loss_sum_.opacity);
  archive->Number("quantile_loss", &loss_sum_.quantile);
  archive->Number("identity_loss", &loss_sum_.identity);
  archive->Number("losses", &loss_count_);
  archive->Number("tv_loss", &tv_sum_);
  archive->Number("tv_losses", &tv_count_);
  archive->Number("pieces", &summary_.segments);
  archive->Number("step_limit_hits", &summary_.step_limit_hits);
  archive->Number("triangulations", &summary_.triangulations);
  archive->Number("seconds_triangulating", &summary_.seconds_triangulating);
  archive->Number("nonfinite_gradients", &summary_.nonfinite_gradients);
  archive->Number("nonfinite_pixels", &summary_.nonfinite_pixels);
  archive->Number("evaluations", &evaluations_);
  archive->Number("seconds_evaluating", &seconds_evaluating_);
  archive->Number("densifications", &densifications_);
  archive->Number("last_triangulation", &last_triangulation_);
  archive->Number("triangulated_sites", &triangulated_sites_);
  archive->Number("frozen", &frozen_);
  archive->Number("sh_degree_is_settled", &sh_degree_is_settled_);
  // Of the last batch, an empty one leaves these as they were.
  archive->Number("batch_pieces", &batch_.num_segments);
  archive->Number("batch_clamped_pieces", &batch_.clamped_segments);
  schedule_.Serialize(archive);
}

template <typename Archive>
void Trainer::SerializeArrays(size_t num_sites, size_t num_reports, Archive* archive) {
  static_assert(sizeof(TrainingProgress) == 14 * 8, "reports are saved as they lie");
  const size_t identities = state_.foam.HasSemantics() ? num_sites * kIdentityDim : 0;
  const size_t classes = state_.foam.num_classes;
  archive->Array("positions", &state_.foam.positions, num_sites);
  archive->Array("raw_density", &state_.foam.raw_density, num_sites);
  archive->Array("sh", &state_.foam.sh, num_sites * state_.foam.ShStride());
  archive->Array("identity", &state_.foam.identity, identities);
  archive->Array("classifier_weight", &state_.foam.classifier_weight, classes * kIdentityDim);
  archive->Array("classifier_bias", &state_.foam.classifier_bias, classes);
  archive->Array("squared_error", &state_.densification.squared_error, num_sites);
  archive->Array("contribution", &state_.densification.contribution, num_sites);
  archive->Array("start_cells", &start_cells_, views_.NumViews());
  archive->Array("reports", &summary_.log, num_reports);
}

template <typename Archive>
void Trainer::SerializePending(Archive* archive) {
  Rearrangement& plan = pending_->plan;
  size_t num_sites = plan.positions.size(), num_origins = plan.origin.size();
  archive->Number("iteration", &pending_->iteration);
  archive->Number("sites", &num_sites);
  archive->Number("origins", &num_origins);
  archive->Array("pending_positions", &plan.positions, num_sites);
  archive->Array("pending_origin", &plan.origin, num_origins);
  archive->Array("pending_is_new", &plan.is_new, num_origins);
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
                  " the run would end with other bytes; --device ",
                  of_gpu ? "cuda:0, or another GPU" : "cpu",
                  ", or training from the beginning, would be right.");
}

void Trainer::Save(CheckpointContents* contents) {
  progress_.seconds = SecondsSince(begin_);
  device_->Download();
  const size_t num_sites = state_.foam.NumSites(), num_reports = summary_.log.size();
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
  state_.optimizer->Serialize(&state);
  guard_.Serialize(&guard);
  const std::span planes(state_.topology.geometry().positions.data(), num_sites);
  state.Array("triangulated_positions", &state_.topology.triangulated_sites(), num_sites);
  state.Array("plane_positions", &planes, num_sites);
  if (pending_ != nullptr) {
    StateWriter pending("pending", contents);
    SerializePending(&pending);
  }
}

// The caller's options and sizes against the checkpoint's.
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
    require("--FoamTraining." + name, found->second, value);
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
  if (progress_.iteration < 0 || progress_.iteration >= schedule_.num_iterations()) {
    checkpoint->ThrowDamaged("its iteration is beyond the end of the run");
  }
  SerializeArrays(num_sites, num_reports, &state);
  state_.optimizer = std::make_unique<FoamOptimizer>(state_.foam);
  state_.optimizer->Serialize(&state);
  guard_.Serialize(&guard);
  std::vector<Eigen::Vector3f> triangulated, planes;
  state.Array("triangulated_positions", &triangulated, num_sites);
  state.Array("plane_positions", &planes, num_sites);
  if (!checkpoint->Texts("pending").empty()) {
    pending_ = std::make_unique<PendingTriangulation>();
    StateReader pending("pending", *checkpoint);
    SerializePending(&pending);
    const Rearrangement& plan = pending_->plan;
    const size_t num_pending = plan.positions.size();
    if (num_pending != (plan.origin.empty() ? num_sites : plan.origin.size()) ||
        std::any_of(
            plan.origin.begin(), plan.origin.end(), [&](uint32_t i) { return i >= num_sites; })) {
      checkpoint->ThrowDamaged("its next triangulation has other sites");
    }
    if (pending_->iteration < 0 || pending_->iteration > progress_.iteration) {
      checkpoint->ThrowDamaged("its next triangulation is of an iteration to come");
    }
  }
  std::vector<const std::vector<Eigen::Vector3f>*> all = {
      &state_.foam.positions, &triangulated, &planes};
  if (pending_ != nullptr) all.push_back(&pending_->plan.positions);
  for (const auto* sites : all) {
    for (const Eigen::Vector3f& site : *sites) {
      if (site.norm() > 1.01f * kFarRadius) checkpoint->ThrowDamaged("a site is out of bounds");
    }
  }
  checkpoint.reset();  // Triangulating needs the memory.
  state_.topology.Triangulate(triangulated, free_space_, state_.foam.HasSemantics());
  state_.topology.Follow(planes);
  device_->Upload();
  device_->UploadTopology();
  if (pending_ != nullptr) StartTriangulating();
  if (sh_degree_is_settled_) SettleShDegree(state_.foam.sh_degree);
  MakeCache();
  last_report_ = progress_.seconds;
  using Clock = std::chrono::steady_clock;
  begin_ = Clock::now() - std::chrono::duration_cast<Clock::duration>(
                              std::chrono::duration<double>(progress_.seconds));
}

}  // namespace semfoam
