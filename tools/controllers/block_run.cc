// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/block_run.h"

#include "foam/edit/model_sites.h"
#include "foam/geometry/guard_sites.h"
#include "foam/geometry/voronoi.h"
#include "foam/optim/initialization.h"
#include "foam/train/block_checkpoint.h"
#include "foam/train/block_sites.h"
#include "foam/train/checkpoint_state.h"
#include "foam/train/label_spreading.h"
#include "foam/train/memory_plan.h"
#include "foam/train/training_schedule.h"
#include "foam/util/array_rows.h"
#include "foam/util/checksummed_file.h"
#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/json_file.h"
#include "foam/util/number_text.h"
#include "foam/util/output_file.h"
#include "foam/util/scratch_folder.h"
#include "foam/view/view_renderer.h"
#include "tools/controllers/effects_report.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/training_log.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr int kRecordVersion = 2;
constexpr char kRecord[] = "blocks.json";
constexpr char kSplit[] = "split.ckpt";
constexpr char kStart[] = "start.ckpt";
constexpr char kResult[] = "block.ckpt";
constexpr char kPolished[] = "polished.foam";
constexpr char kRun[] = "run.foam";
constexpr char kEffects[] = "effects.json";
constexpr char kLog[] = "training_log.csv";
constexpr char kFindings[] = "photos.ckpt";
constexpr char kSweep[] = "sweep.ckpt";
// Among the options of the models in kRun and kPolished, and in the latter.
constexpr char kSplitOption[] = "split";
constexpr char kBlockOption[] = "block";

// Most blocks along one axis.
constexpr int kMostBlocksAcross = 64;

std::string NameOfBlock(size_t number, size_t count) {
  char name[16];
  std::snprintf(name, sizeof(name), "%0*zu", count > 100 ? 4 : 2, number);
  return name;
}

// JSON has no infinity.
Json CornerJson(const Eigen::Vector3f& corner) {
  Json json = Json::array();
  for (const float x : corner) json.push_back(std::isfinite(x) ? Json(x) : Json());
  return json;
}

Json RecordJson(const BlocksRecord& record) {
  Json blocks = Json::array();
  for (const BlockRecord& block : record.blocks) {
    blocks.push_back({{"name", block.name},
                      {"low", CornerJson(block.box.low)},
                      {"high", CornerJson(block.box.high)},
                      {"own_sites", block.own_sites},
                      {"sites", block.sites},
                      {"ray_share", block.ray_share},
                      {"memory_bytes", block.memory_bytes},
                      {"seconds", block.seconds},
                      {"photos", block.photos}});
  }
  return {{"version", kRecordVersion},
          {"split", record.split},
          {"split_iteration", record.split_iteration},
          {"merge_iteration", record.merge_iteration},
          {"num_iterations", record.num_iterations},
          {"halo", record.halo},
          {"polishes_blocks", record.polishes_blocks},
          {"blocks", std::move(blocks)}};
}

Eigen::Vector3f CornerOf(const Json& json, float unbounded) {
  Eigen::Vector3f corner;
  for (int a = 0; a < 3; ++a) {
    corner[a] = json.at(a).is_null() ? unbounded : json.at(a).get<float>();
  }
  return corner;
}

BlockRecord BlockOf(const Json& json) {
  BlockRecord block;
  block.name = json.at("name").get<std::string>();
  block.box.low = CornerOf(json.at("low"), block.box.low[0]);
  block.box.high = CornerOf(json.at("high"), block.box.high[0]);
  block.own_sites = json.at("own_sites").get<int64_t>();
  block.sites = json.at("sites").get<int64_t>();
  block.ray_share = json.at("ray_share").get<double>();
  block.memory_bytes = json.at("memory_bytes").get<int64_t>();
  block.seconds = json.at("seconds").get<double>();
  block.photos = json.at("photos").get<std::vector<std::string>>();
  return block;
}

// The texts by which the checkpoints of a block are recognised.
std::map<std::string, std::string> TextsOf(const BlocksRecord& record, const BlockRecord& block) {
  return {{"split", record.split}, {"name", block.name}};
}

// Returns the record's block in the folder `block_path`.
const BlockRecord& FindBlock(const BlocksRecord& record, const fs::path& block_path) {
  const std::string name = block_path.filename().string();
  const auto found = std::find_if(record.blocks.begin(),
                                  record.blocks.end(),
                                  [&](const BlockRecord& block) { return block.name == name; });
  if (found == record.blocks.end()) {
    throw UserError(block_path.string(),
                    ": is no block of ",
                    (block_path.parent_path() / kRecord).string(),
                    ", which has ",
                    record.blocks.front().name,
                    " to ",
                    record.blocks.back().name,
                    "; one of these folders would be right.");
  }
  return *found;
}

// Throws UserError where the checkpoint is not of this block of this split.
void RequireOfBlock(const Checkpoint& checkpoint,
                    const BlocksRecord& record,
                    const BlockRecord& block) {
  const auto& texts = checkpoint.Texts("block");
  const auto wanted = TextsOf(record, block);
  if (texts == wanted) return;
  const auto split = texts.find("split"), name = texts.find("name");
  const bool is_of_split = split != texts.end() && split->second == record.split;
  throw UserError(
      checkpoint.path().string(),
      ": is of ",
      is_of_split && name != texts.end() ? "block " + name->second : "another split of the space",
      ", not of block ",
      block.name,
      " of this one; training this block would be right.");
}

// Reads the result of a block, or the arrays of it that are named. Throws UserError where it is
// missing, incomplete or another's.
std::unique_ptr<const Checkpoint> ReadResult(
    const fs::path& blocks_path,
    const BlocksRecord& record,
    const BlockRecord& block,
    const std::optional<std::set<std::string>>& arrays = std::nullopt) {
  const fs::path path = blocks_path / block.name / kResult;
  if (!fs::exists(path)) {
    throw UserError(path.string(),
                    ": there is no such file, because block ",
                    block.name,
                    " is not trained; its line of jobs.txt would write it.");
  }
  auto result = std::make_unique<const Checkpoint>(
      path,
      [&](const std::string& name) { return !arrays || arrays->count(name) > 0; },
      "training this block again");
  RequireOfBlock(*result, record, block);
  return result;
}

// Returns the path of a file that a split writes. Throws UserError where there is none.
fs::path KnownBySplit(const fs::path& path) {
  if (fs::exists(path)) return path;
  throw UserError(path.string(),
                  ": there is no such file, because the split is of an older version of the "
                  "program; a split by this version would be right.");
}

// Writes what the foams of all blocks have in common.
void WriteRun(const fs::path& path,
              const TrainingAtStop& stopped,
              const Checkpoint& split,
              const BlocksRecord& record) {
  const TrainingScene& scene = stopped.scene;
  const Foam coarse = FoamOf(split);
  Model run;
  run.foam.sh_degree = coarse.sh_degree;
  run.foam.num_classes = coarse.num_classes;
  run.foam.classifier_weight = coarse.classifier_weight;
  run.foam.classifier_bias = coarse.classifier_bias;
  run.world_from_normalized = scene.WorldFromNormalized();
  run.labels = scene.Labels();
  run.photos = scene.Photos();
  run.options = stopped.model_options;
  run.options[kSplitOption] = record.split;
  WriteModel(path, run);
}

// Reads that. Throws UserError where it is missing, damaged or of another split.
Model ReadRun(const fs::path& path, const BlocksRecord& record) {
  if (!fs::exists(path)) {
    throw UserError(path.string(),
                    ": there is no such file, because the split is of an older version of the "
                    "program; merging the blocks, or a split by this version, would be right.");
  }
  Model run = ReadModel(path);
  const auto split = run.options.find(kSplitOption);
  if (split == run.options.end() || split->second != record.split || run.foam.NumSites() > 0) {
    throw UserError(path.string(),
                    ": is not of the split in ",
                    (path.parent_path() / kRecord).string(),
                    "; the file that scene_splitter has written there would be right.");
  }
  return run;
}

// The plan of all blocks of a split.
struct SplitPlan {
  std::vector<BlockRays> rays;
  BlocksRecord record;
};

// Plans blocks of a foam.
class BlockPlanner {
 public:
  BlockPlanner(const Foam& foam,
               const ViewRenderer& renderer,
               const TrainingScene& scene,
               std::vector<double> expected,
               float halo)
      : foam_(foam),
        renderer_(renderer),
        scene_(scene),
        expected_(std::move(expected)),
        halo_(halo) {}

  // Plans columns x rows blocks, with names, boxes and sites.
  SplitPlan Plan(int columns, int rows) const { return WithRays(Boxes(columns, rows)); }

  // Plans as many blocks as it takes for none to have more than `max_sites` in its training; up to
  // a quarter more than that, as each try chooses the rays of all blocks. Throws UserError where no
  // number of blocks keeps to it.
  SplitPlan PlanForSites(int64_t max_sites) const {
    const auto [widest, second] = SpreadOfSites(foam_.positions, expected_);
    const double aspect = second > 0 ? widest / second : 1;
    int64_t fewest = std::numeric_limits<int64_t>::max();
    const double total = std::accumulate(expected_.begin(), expected_.end(), 0.0);
    const double least = std::ceil(total / static_cast<double>(max_sites));
    int num_blocks =
        static_cast<int>(std::min(least, double(kMostBlocksAcross) * kMostBlocksAcross));
    int columns = 0, rows = 0, vain_tries = 0;
    // Where every block sees nearly all of the scene, smaller blocks have no fewer sites.
    constexpr int kMostVainTries = 3;
    constexpr double kLeastGain = 0.98;
    while (vain_tries < kMostVainTries) {
      // Blocks about as wide as they are long, as far as whole numbers allow.
      const double across = std::round(std::sqrt(num_blocks * aspect));
      columns = static_cast<int>(std::clamp(across, 1.0, double(kMostBlocksAcross)));
      columns = std::min(columns, num_blocks);
      rows = std::min((num_blocks + columns - 1) / columns, kMostBlocksAcross);
      Candidate boxes = Boxes(columns, rows);
      if (boxes.MostSites() <= max_sites) {
        SplitPlan plan = WithRays(std::move(boxes));
        const int64_t most = MostSites(plan.record);
        if (most <= max_sites) return plan;
        vain_tries = double(most) < kLeastGain * double(fewest) ? 0 : vain_tries + 1;
        fewest = std::min(fewest, most);
      } else {
        fewest = std::min(fewest, boxes.MostSites());
      }
      if (columns == kMostBlocksAcross && rows == kMostBlocksAcross) break;
      num_blocks = std::max(columns * rows, num_blocks + (num_blocks + 3) / 4);
    }
    throw FieldError(
        "max_sites",
        " is ",
        max_sites,
        ", and with up to ",
        columns,
        "x",
        rows,
        " blocks, each with the sites that it sees around it, the largest block has at least ",
        fewest,
        "; more than that would be right.");
  }

 private:
  // Boxes before their rays are known.
  struct Candidate {
    BlocksRecord record;
    // [blocks] Sites expected in the padded box; number of those now in it.
    std::vector<double> expected;
    std::vector<int64_t> num_now;

    int64_t MostSites() const {
      return std::llround(*std::max_element(expected.begin(), expected.end()));
    }
  };

  static int64_t MostSites(const BlocksRecord& record) {
    int64_t most = 0;
    for (const BlockRecord& block : record.blocks) most = std::max(most, block.sites);
    return most;
  }

  Candidate Boxes(int columns, int rows) const {
    Candidate candidate;
    candidate.record.halo = halo_;
    const std::vector<BlockBox> boxes = SplitSpace(foam_.positions, expected_, columns, rows);
    for (const BlockBox& box : boxes) {
      BlockRecord block;
      block.name = NameOfBlock(candidate.record.blocks.size(), boxes.size());
      block.box = box;
      const BlockBox padded = box.Padded(halo_);
      double own = 0, in_padded = 0;
      int64_t num_now = 0;
      for (size_t i = 0; i < foam_.NumSites(); ++i) {
        if (box.Contains(foam_.positions[i])) own += expected_[i];
        if (!padded.Contains(foam_.positions[i])) continue;
        in_padded += expected_[i];
        ++num_now;
      }
      block.own_sites = std::llround(own);
      candidate.expected.push_back(in_padded);
      candidate.num_now.push_back(num_now);
      candidate.record.blocks.push_back(std::move(block));
    }
    return candidate;
  }

  // Chooses the rays of the boxes. Of the sites around a padded box, those stay that they meet.
  SplitPlan WithRays(Candidate candidate) const {
    SplitPlan plan;
    std::vector<BlockBox> boxes;
    for (const BlockRecord& block : candidate.record.blocks) boxes.push_back(block.box);
    plan.rays = ChooseRays(scene_, renderer_, boxes, halo_);
    plan.record = std::move(candidate.record);
    for (size_t b = 0; b < plan.rays.size(); ++b) {
      BlockRecord& block = plan.record.blocks[b];
      for (const int view : plan.rays[b].views) block.photos.push_back(scene_.Photos()[view].name);
      block.ray_share = plan.rays[b].share;
      const auto num_start = std::ssize(
          ChooseStartSites(foam_.positions, block.box.Padded(halo_), plan.rays[b].is_met).origin);
      block.sites = std::llround(candidate.expected[b]) + num_start - candidate.num_now[b];
    }
    return plan;
  }

  const Foam& foam_;
  const ViewRenderer& renderer_;
  const TrainingScene& scene_;
  // [sites] ExpectedSites.
  std::vector<double> expected_;
  float halo_;
};

// Returns whether the end of the run is trained block by block.
bool ChoosePolish(const SplitOptions& options, const TrainingScene& scene) {
  const bool spreads_labels = scene.NumClasses() > 0 && FewViewsHaveLabels(scene);
  if (!options.polishes_blocks) return options.coarse_sites > 0 && !spreads_labels;
  if (*options.polishes_blocks && spreads_labels) {
    LOG(WARNING) << "Few photos have masks, and blocks that are polished apart do not spread their "
                    "labels over the foam; polishing all together (polish_by_block 0) would.";
  }
  return *options.polishes_blocks;
}

// Returns what identifies a split: the same for the same run and blocks.
std::string IdentityOfSplit(const Checkpoint& split, const BlocksRecord& record) {
  Json json = {{"options", split.Texts("training_options")},
               {"inputs", split.Texts("inputs")},
               {"split_iteration", record.split_iteration},
               {"merge_iteration", record.merge_iteration},
               {"halo", record.halo},
               {"polishes_blocks", record.polishes_blocks},
               {"boxes", Json::array()}};
  for (const BlockRecord& block : record.blocks) {
    json["boxes"].push_back({CornerJson(block.box.low), CornerJson(block.box.high)});
  }
  const std::string text = json.dump();
  return ChecksumText({std::as_bytes(std::span(text)),
                       split.Array("positions"),
                       split.Array("raw_density"),
                       split.Array("sh"),
                       split.Array("identity")});
}

// Cuts the state in `path` into blocks.
SplitPlan PlanSplit(const SplitOptions& options,
                    const TrainingRun& run,
                    const TrainingScene& scene,
                    const Checkpoint& split,
                    int64_t merge_iteration,
                    double seconds) {
  const Foam foam = FoamOf(split);
  const DensificationStatistics statistics = StatisticsOf(split);
  const ViewRenderer renderer(foam, run.device);
  const float halo =
      HaloWidth(foam, CellRadii(WithGuardSites(foam.positions), renderer.delaunay()), statistics);
  const BlockPlanner planner(
      foam, renderer, scene, ExpectedSites(statistics, run.training.final_sites), halo);
  SplitPlan plan = options.max_sites > 0 ? planner.PlanForSites(options.max_sites)
                                         : planner.Plan(options.columns, options.rows);
  plan.record.split_iteration = IterationOf(split);
  plan.record.merge_iteration = std::max(merge_iteration, plan.record.split_iteration);
  plan.record.num_iterations = TrainingSchedule(run.training).num_iterations();
  plan.record.polishes_blocks = ChoosePolish(options, scene);
  plan.record.split = IdentityOfSplit(split, plan.record);
  const double seconds_per_iteration = seconds / double(plan.record.split_iteration);
  for (BlockRecord& block : plan.record.blocks) {
    const auto iterations = double(plan.record.merge_iteration - plan.record.split_iteration);
    // Most of an iteration of many cells goes into these.
    const double growth = std::max(1.0, double(block.sites) / double(foam.NumSites()));
    block.seconds = iterations * seconds_per_iteration * block.ray_share * growth;
    block.memory_bytes = PlanMemory(OptionsOfBlock(run.training, block.sites),
                                    scene.NumClasses(),
                                    /*num_seeds=*/0,
                                    /*photo_bytes=*/0)
                             .Total();
  }
  return plan;
}

// Sets what a training of the block in `path` takes over from its split.
void TakeWhatSplitKnows(const fs::path& path, const BlockRecord& block, TrainingRun* run) {
  run->block_sites = block.sites;
  run->block_photos = block.photos;
  run->known_findings = KnownBySplit(path.parent_path() / kFindings);
  if (Sweeps(*run)) run->known_sweep = KnownBySplit(path.parent_path() / kSweep);
}

// Reads the polished sites of a block. Throws UserError where the file is missing, damaged or
// another's.
Model ReadPolished(const fs::path& blocks_path,
                   const BlocksRecord& record,
                   const BlockRecord& block) {
  const fs::path path = blocks_path / block.name / kPolished;
  Model polished = ReadModel(path);
  const auto is_option = [&](const char* name, const std::string& value) {
    const auto found = polished.options.find(name);
    return found != polished.options.end() && found->second == value;
  };
  if (is_option(kSplitOption, record.split) && is_option(kBlockOption, block.name)) return polished;
  throw UserError(path.string(),
                  ": is not of block ",
                  block.name,
                  " of this split of the space; removing it, so that the block is polished again, "
                  "would be right.");
}

// Returns the foam with SH degree 0, without gradients of colour and the classifier's weights: in
// the mean colours that photos show, where these were measured.
Foam WithoutDetail(Model model) {
  Foam& foam = model.foam;
  Foam constant;
  constant.num_classes = foam.num_classes;
  constant.positions = std::move(foam.positions);
  constant.raw_density = std::move(foam.raw_density);
  constant.sh = ResizeRows(foam.sh, foam.ShStride(), constant.ShStride(), constant.ShStride());
  constant.identity = std::move(foam.identity);
  const std::vector<Eigen::Vector3f>& colors = model.statistics.mean_color;
  for (size_t i = 0; i < colors.size(); ++i) {
    for (int c = 0; c < 3; ++c) constant.sh[3 * i + c] = ShOfSeedColor(colors[i][c]);
  }
  return constant;
}

// Returns the reports of a run in polished blocks: those up to the split, and one of its end.
std::vector<TrainingProgress> LogOfBlocks(const fs::path& blocks_path,
                                          const BlocksRecord& record,
                                          int64_t num_sites) {
  std::vector<TrainingProgress> log;
  TrainingProgress end;
  end.iteration = record.num_iterations;
  end.sites = num_sites;
  double seconds_of_split = 0;
  int64_t rays_of_split = 0;
  for (const BlockRecord& block : record.blocks) {
    const std::vector<TrainingProgress> reports = ReadTrainingLog(blocks_path / block.name / kLog);
    const auto after = std::find_if(reports.begin(), reports.end(), [&](const auto& report) {
      return report.iteration > record.split_iteration;
    });
    if (log.empty()) {
      log.assign(reports.begin(), after);
      if (!log.empty()) {
        seconds_of_split = log.back().seconds;
        rays_of_split = log.back().rays;
      }
    }
    if (after == reports.end()) continue;
    end.seconds += reports.back().seconds - seconds_of_split;
    end.rays += reports.back().rays - rays_of_split;
  }
  end.seconds += seconds_of_split;
  end.rays += rays_of_split;
  log.push_back(end);
  return log;
}

// Writes the model with refined poses of a split, where it has refined them.
void WritePosesOf(const fs::path& blocks_path,
                  const Model& model,
                  const TrainingRun& run,
                  const fs::path& model_path) {
  Effect poses;
  poses.name = "poses";
  poses.on = model.options.count(poses.name) > 0;
  for (const Json& effect : ReadJsonFile(blocks_path / kEffects)["effects"]) {
    if (effect.value("effect", "") == poses.name) poses.evidence = effect.value("evidence", "");
  }
  WriteRefinedPoses(run.scene.input_path, model.photos, poses, model_path);
}

// Joins the polished blocks, and writes what TrainAndWrite writes. Holds the foam, and one block
// besides.
Model JoinPolished(const fs::path& blocks_path,
                   const BlocksRecord& record,
                   const TrainingRun& run,
                   TrainingFolder* folder) {
  Model model = ReadRun(blocks_path / kRun, record);
  model.options.erase(kSplitOption);
  for (const BlockRecord& block : record.blocks) {
    AppendSites(ReadPolished(blocks_path, record, block), &model);
  }
  SortSites(&model);
  const std::vector<TrainingProgress> log =
      LogOfBlocks(blocks_path, record, static_cast<int64_t>(model.foam.NumSites()));
  folder->SetIdentity({{"options", {{"blocks", record.split}}}});
  folder->Begin();
  WritePosesOf(blocks_path, model, run, folder->path() / "sparse" / "0");
  WriteModel(folder->path() / "scene.foam", model);
  WriteTextFile(folder->path() / kEffects,
                ReadFileBytes(blocks_path / kEffects, "the effects of a split"));
  WriteTextFile(folder->path() / kLog, FormatTrainingLog(log));
  if (run.when_written) run.when_written(log, *folder);
  folder->EndTraining();
  return model;
}

}  // namespace

BlocksRecord ReadBlocksRecord(const fs::path& blocks_path) {
  const fs::path path = blocks_path / kRecord;
  if (!fs::exists(path)) {
    throw UserError(path.string(),
                    ": there is no such file; a folder that scene_splitter has finished would be "
                    "right.");
  }
  const Json json = ReadJsonFile(path);
  const auto version = json.is_object() && json.contains("version")
                           ? JsonInteger(json["version"], 0, 1'000'000)
                           : std::nullopt;
  if (version && *version != kRecordVersion) {
    throw UserError(path.string(),
                    ": has format version ",
                    *version,
                    ", and this program reads version ",
                    kRecordVersion,
                    "; a split by this version of the program would be right.");
  }
  try {
    BlocksRecord record;
    record.split = json.at("split").get<std::string>();
    record.split_iteration = json.at("split_iteration").get<int64_t>();
    record.merge_iteration = json.at("merge_iteration").get<int64_t>();
    record.num_iterations = json.at("num_iterations").get<int64_t>();
    record.halo = json.at("halo").get<float>();
    record.polishes_blocks = json.at("polishes_blocks").get<bool>();
    for (const Json& block : json.at("blocks")) record.blocks.push_back(BlockOf(block));
    if (version && !record.blocks.empty()) return record;
  } catch (const Json::exception&) {
    // As below.
  }
  throw UserError(path.string(),
                  ": is not what scene_splitter writes; a folder that it has finished would be "
                  "right.");
}

void RequireValid(const SplitOptions& options) {
  const auto blocks_in_range = [](int count) { return count >= 1 && count <= kMostBlocksAcross; };
  if (options.max_sites < 0) {
    throw FieldError("max_sites", " is ", options.max_sites, "; it must be 1 or more.");
  }
  if (options.max_sites == 0 &&
      (!blocks_in_range(options.columns) || !blocks_in_range(options.rows))) {
    throw FieldError("blocks",
                     " is ",
                     options.columns,
                     "x",
                     options.rows,
                     "; it must be from 1x1 to ",
                     kMostBlocksAcross,
                     "x",
                     kMostBlocksAcross,
                     ".");
  }
  constexpr int64_t kFewestSites = 64;
  if (options.coarse_sites < 0 ||
      (options.coarse_sites > 0 && options.coarse_sites < kFewestSites)) {
    throw FieldError("coarse_sites",
                     " is ",
                     options.coarse_sites,
                     "; it must be 0, -1 or at least ",
                     kFewestSites,
                     ".");
  }
  for (const auto& [name, share] :
       {std::pair("coarse_share", options.coarse_share), {"polish_share", options.polish_share}}) {
    if (share > 0 && share < 1) continue;
    throw FieldError(name, " is ", share, "; it must be greater than 0 and less than 1.");
  }
  if (options.coarse_share + options.polish_share > 1) {
    throw FieldError(
        "polish_share", " is ", options.polish_share, "; with coarse_share it must be at most 1.");
  }
}

void RequireSplittable(const SplitOptions& options, const TrainingRun& run) {
  if (run.time_budget > 0) {
    throw FieldError("time_budget",
                     " is ",
                     run.time_budget,
                     "; a run in blocks has a schedule of fixed numbers, so 0 would be right.");
  }
  if (run.device.kind() != DeviceKind::kCpu) {
    throw FieldError("device", " is a GPU; blocks are trained on the CPU, so cpu would be right.");
  }
  if (options.coarse_sites == 0) return;
  if (options.coarse_sites >= run.training.final_sites) {
    throw FieldError("coarse_sites",
                     " is ",
                     options.coarse_sites,
                     ", and the run ends with ",
                     run.training.final_sites,
                     " sites (final_sites); less than that would be right.");
  }
  if (run.training.late_rays > 0) {
    throw FieldError("late_rays",
                     " is ",
                     run.training.late_rays,
                     "; the blocks of a coarse foam are densified later than densify_until, so 0 "
                     "would be right.");
  }
}

BlocksRecord SplitRun(const SplitOptions& options, TrainingFolder* folder, TrainingRun* run) {
  RequireValid(options);
  RequireSplittable(options, *run);
  if (options.coarse_sites == 0 && options.max_sites > 0 &&
      options.max_sites < run->training.final_sites) {
    LOG(INFO) << "The split itself trains up to " << run->training.final_sites
              << " sites, more than max_sites; coarse_sites " << options.max_sites
              << " would keep it as small as its blocks";
  }
  const fs::path path = folder->path();
  const int64_t num_iterations = TrainingSchedule(run->training).num_iterations();
  const auto fraction = [&](int64_t iteration) {
    return double(iteration) / double(num_iterations);
  };
  const auto split_iteration =
      static_cast<int64_t>(std::ceil(options.coarse_share * double(num_iterations)));
  const auto merge_iteration =
      static_cast<int64_t>(std::floor((1 - options.polish_share) * double(num_iterations)));
  run->coarse_sites = static_cast<int>(options.coarse_sites);
  run->coarse_share = options.coarse_share;
  // Blocks that go their own ways to the end keep the light that the split has found. A coarse foam
  // is ready for that by then.
  if (options.coarse_sites > 0 || options.polishes_blocks.value_or(false)) {
    run->adapted_part = options.coarse_share;
  }
  run->more_identity["coarse_sites"] = FormatNumber(run->coarse_sites);
  run->more_identity["coarse_share"] = FormatNumber(run->coarse_share);
  run->between_iterations = [&](int64_t iteration, const TrainingHooks::Save& save) {
    if (iteration < split_iteration) return;
    {
      CheckpointContents contents;
      save(&contents);
      if (!CanBeSplit(contents)) return;
      // The joined blocks go on as the run.
      contents.texts.erase("training_options");
      StateWriter whole("training_options", &contents);
      TrainingOptions(run->training).Serialize(&whole);
      WriteCheckpoint(path / kSplit, contents);
    }
    throw TrainingStopped();
  };
  run->findings_path = path / kFindings;
  run->sweep_path = path / kSweep;
  BlocksRecord record;
  run->when_stopped = [&](const TrainingAtStop& stopped) {
    const TrainingScene& scene = stopped.scene;
    const Checkpoint split(path / kSplit, /*keeps=*/{}, kRemedyOfSplit);
    double seconds = 0;
    ParseNumber(split.Texts("state").at("seconds"), &seconds);
    SplitPlan plan = PlanSplit(options, *run, scene, split, merge_iteration, seconds);
    for (size_t b = 0; b < plan.rays.size(); ++b) {
      const BlockRecord& block = plan.record.blocks[b];
      BlockTraining training;
      training.box = block.box;
      training.halo = plan.record.halo;
      training.rays = std::move(plan.rays[b]);
      training.seeds = stopped.seeds;
      training.options = OptionsOfBlock(run->training, block.sites);
      if (run->coarse_sites > 0) {
        training.refines = true;
        training.options = WithDensificationBetween(training.options,
                                                    fraction(plan.record.split_iteration),
                                                    fraction(plan.record.merge_iteration));
      }
      OwnedContents start = BlockStart(split, scene, std::move(training));
      start.contents.texts["block"] = TextsOf(plan.record, block);
      WriteCheckpoint(path / block.name / kStart, start.contents);
    }
    WriteRun(path / kRun, stopped, split, plan.record);
    WriteEffects(path / kEffects, stopped.effects, scene.Photos());
    record = std::move(plan.record);
  };
  try {
    TrainAndWrite(folder, run);
  } catch (const TrainingStopped&) {
    WriteTextFile(path / kRecord, RecordJson(record).dump(1) + "\n");
    return record;
  }
  throw FieldError("num_rays",
                   " is ",
                   run->training.num_rays,
                   ", and the run has ended before it could be split; more would be right.");
}

bool PolishesBlocks(const fs::path& blocks_path) {
  return ReadBlocksRecord(blocks_path).polishes_blocks;
}

bool IsPolished(const fs::path& block_path) { return fs::exists(block_path / kPolished); }

std::vector<fs::path> UnpolishedBlocks(const fs::path& blocks_path) {
  const BlocksRecord record = ReadBlocksRecord(blocks_path);
  std::vector<fs::path> paths;
  if (!record.polishes_blocks) return paths;
  for (const BlockRecord& block : record.blocks) {
    if (!IsPolished(blocks_path / block.name)) paths.push_back(blocks_path / block.name);
  }
  return paths;
}

bool IsTrained(const fs::path& block_path) { return fs::exists(block_path / kResult); }

void TrainBlock(TrainingFolder* folder, TrainingRun* run) {
  const fs::path path = folder->path();
  const BlocksRecord record = ReadBlocksRecord(path.parent_path());
  const BlockRecord& block = FindBlock(record, path);
  TakeWhatSplitKnows(path, block, run);
  run->begin_from = [&] { return path / kStart; };
  const auto write_result = [&](const CheckpointContents& contents) {
    const OwnedContents result = BlockResult(contents, block.box, record.split_iteration);
    WriteCheckpoint(path / kResult, result.contents);
  };
  {
    const Checkpoint start(path / kStart, /*keeps=*/{}, kRemedyOfSplit);
    RequireOfBlock(start, record, block);
    run->block_seeds = SeedsOf(start);
    run->block_ground = GroundOf(start);
    if (IterationOf(start) >= record.merge_iteration) {
      write_result(start.Contents());
      return;
    }
  }
  run->between_iterations = [&](int64_t iteration, const TrainingHooks::Save& save) {
    if (iteration < record.merge_iteration) return;
    CheckpointContents contents;
    save(&contents);
    write_result(contents);
    throw TrainingStopped();
  };
  try {
    TrainAndWrite(folder, run);
  } catch (const TrainingStopped&) {
    return;
  }
  LOG(FATAL) << "the run has ended before its merge";
}

void PolishBlock(TrainingFolder* folder, TrainingRun* run) {
  const fs::path path = folder->path(), blocks_path = path.parent_path();
  const BlocksRecord record = ReadBlocksRecord(blocks_path);
  const BlockRecord& block = FindBlock(record, path);
  if (!record.polishes_blocks) {
    throw UserError((blocks_path / kRecord).string(),
                    ": is of a split whose blocks are polished all together, by foam_merger; a "
                    "split with ",
                    Field{"polish_by_block"},
                    " 1 would be right.");
  }
  const BlockBox padded = block.box.Padded(record.halo);
  // The blocks that have sites there.
  std::vector<size_t> near;
  for (size_t b = 0; b < record.blocks.size(); ++b) {
    if (record.blocks[b].box.Meets(padded)) near.push_back(b);
  }
  const auto own = static_cast<size_t>(&block - record.blocks.data());
  const std::set<std::string> no_arrays;
  for (const size_t b : near) ReadResult(blocks_path, record, record.blocks[b], no_arrays);

  TakeWhatSplitKnows(path, block, run);
  {
    const Checkpoint start(path / kStart, IsOfRun, kRemedyOfSplit);
    RequireOfBlock(start, record, block);
    run->block_seeds = SeedsOf(start);
    run->block_ground = GroundOf(start);
  }
  const ScratchFolder scratch(path);
  run->begin_from = [&] {
    const fs::path begin_path = scratch.path() / "polish.ckpt";
    const Checkpoint start(path / kStart, /*keeps=*/{}, kRemedyOfSplit);
    const OwnedContents contents = PolishStart(start, padded, own, near, [&](size_t b) {
      return ReadResult(blocks_path, record, record.blocks[b]);
    });
    WriteCheckpoint(begin_path, contents.contents);
    return begin_path;
  };
  run->measured_rays = [padded](const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) {
    return padded.IsMetBefore(origin, direction, std::numeric_limits<float>::infinity());
  };
  run->take_result = [&](const Model& model, const std::vector<TrainingProgress>& log) {
    std::vector<uint32_t> inside;
    for (uint32_t i = 0; i < model.foam.NumSites(); ++i) {
      if (block.box.Contains(model.foam.positions[i])) inside.push_back(i);
    }
    Model polished = WithSites(model, inside);
    for (const auto& [name, text] : TextsOf(record, block)) {
      polished.options[name == "name" ? kBlockOption : kSplitOption] = text;
    }
    WriteTextFile(path / kLog, FormatTrainingLog(log));
    WriteModel(path / kPolished, polished);
  };
  TrainAndWrite(folder, run);
}

void RequireTrained(const fs::path& blocks_path) {
  const BlocksRecord record = ReadBlocksRecord(blocks_path);
  const std::set<std::string> no_arrays;
  for (const BlockRecord& block : record.blocks) {
    ReadResult(blocks_path, record, block, no_arrays);
  }
}

fs::path RunPath(const fs::path& blocks_path) { return blocks_path / kRun; }

std::string ChecksumOfBlocks(const fs::path& blocks_path) {
  const std::string run = ModelChecksum(RunPath(blocks_path));
  const BlocksRecord record = ReadBlocksRecord(blocks_path);
  if (!record.polishes_blocks || !UnpolishedBlocks(blocks_path).empty()) return run;
  const std::string polished = run + " polished";
  return ChecksumText({std::as_bytes(std::span(polished))});
}

FoamBlocks OpenBlocks(const fs::path& blocks_path) {
  RequireTrained(blocks_path);
  const BlocksRecord record = ReadBlocksRecord(blocks_path);
  FoamBlocks blocks;
  blocks.run = ReadRun(blocks_path / kRun, record);
  blocks.halo = record.halo;
  blocks.num_blocks = record.blocks.size();
  if (record.polishes_blocks && UnpolishedBlocks(blocks_path).empty()) {
    blocks.read_positions = [blocks_path, record](size_t block) {
      return ReadPolished(blocks_path, record, record.blocks[block]).foam.positions;
    };
    blocks.read_foam = [blocks_path, record](size_t block) {
      return WithoutDetail(ReadPolished(blocks_path, record, record.blocks[block]));
    };
    return blocks;
  }
  blocks.read_positions = [blocks_path, record](size_t block) {
    return SitesOfBlock(*ReadResult(blocks_path, record, record.blocks[block], ArraysOfSites()));
  };
  const int num_classes = blocks.run.foam.num_classes;
  blocks.read_foam = [blocks_path, record, num_classes](size_t block) {
    const auto result = ReadResult(blocks_path, record, record.blocks[block], ArraysOfFoam());
    Foam foam = FoamOfBlock(*result);
    if (foam.num_classes != num_classes) {
      result->ThrowDamaged("its number of classes is not that of its run");
    }
    return foam;
  };
  return blocks;
}

void RequireKnownSweep(const fs::path& blocks_path, const TrainingRun& run) {
  if (Sweeps(run)) KnownBySplit(blocks_path / kSweep);
}

Model MergeBlocks(const fs::path& blocks_path, TrainingFolder* folder, TrainingRun* run) {
  const BlocksRecord record = ReadBlocksRecord(blocks_path);
  if (record.polishes_blocks) return JoinPolished(blocks_path, record, *run, folder);
  const ScratchFolder scratch(folder->path());
  const fs::path joined_path = scratch.path() / "joined.ckpt";
  run->more_identity["blocks"] = record.split;
  if (Sweeps(*run)) run->known_sweep = KnownBySplit(blocks_path / kSweep);
  run->begin_from = [&] {
    const Checkpoint split(blocks_path / kSplit, /*keeps=*/{}, kRemedyOfSplit);
    std::vector<std::unique_ptr<const Checkpoint>> blocks;
    std::vector<const Checkpoint*> pointers;
    for (const BlockRecord& block : record.blocks) {
      blocks.push_back(ReadResult(blocks_path, record, block));
      pointers.push_back(blocks.back().get());
    }
    OwnedContents joined = JoinBlocks(split, pointers);
    joined.contents.texts["options"]["blocks"] = record.split;
    WriteCheckpoint(joined_path, joined.contents);
    return joined_path;
  };
  return TrainAndWrite(folder, run);
}

}  // namespace semfoam
