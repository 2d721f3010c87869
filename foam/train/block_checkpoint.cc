// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/block_checkpoint.h"

#include "foam/optim/initialization.h"
#include "foam/train/block_sites.h"
#include "foam/train/checkpoint_state.h"
#include "foam/util/number_text.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <numeric>
#include <span>
#include <string>
#include <tuple>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

// The arrays of a checkpoint with one row for each site that is not frozen.
constexpr const char* kMomentArrays[] = {"first_moments", "second_moments", "steps"};

// The arrays with one row a site.
constexpr const char* kSiteArrays[] = {"positions",
                                       "raw_density",
                                       "sh",
                                       "color_gradient",
                                       "identity",
                                       "squared_error",
                                       "contribution",
                                       "triangulated_positions",
                                       "plane_positions",
                                       "is_frozen",
                                       "ancestor"};

// Numbers of the state that count what was done, and add up over the blocks.
constexpr const char* kCounts[] = {"rays",
                                   "step_limit_hits",
                                   "nonfinite_gradients",
                                   "nonfinite_pixels",
                                   "pieces",
                                   "triangulations",
                                   "triangulated_sites"};
constexpr const char* kSeconds[] = {"seconds", "seconds_triangulating"};

// Numbers of the state: how many densifications there were, and the iteration since which the cells
// are watched for the next one.
constexpr char kDensifications[] = "densifications";
constexpr char kWatchedSince[] = "watched_since";

// Numbers of the state that say how far the schedule has come, the same for all blocks.
constexpr const char* kProgress[] = {"iteration", kDensifications, "frozen"};

// The array that tells which sites are frozen.
constexpr char kIsFrozen[] = "is_frozen";

// The iteration of the last triangulation, of which blocks that found theirs stale have one of
// their own.
constexpr char kLastTriangulation[] = "last_triangulation";

// The array of the reports of the log.
constexpr char kReports[] = "reports";

// The array of a block's start that holds the positions of the seeds.
constexpr char kSeeds[] = "seeds";
// ... and that of what things stand on, where that is known.
constexpr char kGround[] = "ground";

// Share of the sites that a block will train, which are there when it begins to refine.
constexpr double kFilled = 0.65;

template <size_t N>
bool IsAmong(const char* const (&names)[N], const std::string& name) {
  return std::find(std::begin(names), std::end(names), name) != std::end(names);
}

template <typename T>
T Number(const CheckpointContents& contents, const std::string& name) {
  T value{};
  CHECK(ParseNumber(contents.texts.at("state").at(name), &value)) << name;
  return value;
}

std::span<const std::byte> ArrayOf(const CheckpointContents& contents, const std::string& name) {
  for (const CheckpointContents::Array& array : contents.arrays) {
    if (array.name == name) return array.bytes;
  }
  LOG(FATAL) << "no array " << name;
}

template <typename T>
std::span<const T> ValuesOf(const CheckpointContents& contents, const std::string& name) {
  const auto bytes = ArrayOf(contents, name);
  return {reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)};
}

// Replaces or adds an array.
template <typename T>
void SetArray(const std::string& name, std::span<const T> values, OwnedContents* owned) {
  const auto bytes = std::as_bytes(values);
  owned->bytes.emplace_back(bytes.begin(), bytes.end());
  for (CheckpointContents::Array& array : owned->contents.arrays) {
    if (array.name != name) continue;
    array.bytes = owned->bytes.back();
    return;
  }
  owned->contents.arrays.push_back({name, owned->bytes.back()});
}

template <typename T>
void SetArray(const std::string& name, const std::vector<T>& values, OwnedContents* owned) {
  SetArray(name, std::span<const T>(values), owned);
}

// Appends a row of an array with `num_rows` rows.
void AppendRow(std::span<const std::byte> array,
               size_t num_rows,
               size_t row,
               std::vector<std::byte>* rows) {
  const size_t size = array.size() / num_rows;
  rows->insert(rows->end(), array.begin() + row * size, array.begin() + (row + 1) * size);
}

// Adds an array with these rows of one with `num_rows` rows.
void AddRows(const CheckpointContents::Array& array,
             size_t num_rows,
             const std::vector<size_t>& chosen,
             OwnedContents* owned) {
  owned->bytes.emplace_back();
  std::vector<std::byte>& rows = owned->bytes.back();
  if (num_rows > 0) rows.reserve(array.bytes.size() / num_rows * chosen.size());
  for (const size_t row : chosen) AppendRow(array.bytes, num_rows, row, &rows);
  owned->contents.arrays.push_back({array.name, rows});
}

// Edits these rows of an array with `num_rows` rows: calls set(i, row) for the i-th of them.
template <typename T, typename Set>
void EditRows(const std::string& name,
              size_t num_rows,
              const std::vector<size_t>& rows,
              const Set& set,
              OwnedContents* owned) {
  const auto values = ValuesOf<T>(owned->contents, name);
  std::vector<T> edited(values.begin(), values.end());
  const size_t stride = edited.size() / num_rows;
  for (size_t i = 0; i < rows.size(); ++i) {
    set(i, std::span<T>(edited).subspan(rows[i] * stride, stride));
  }
  SetArray(name, edited, owned);
}

// Makes the new sites of a start such as those at the points with which a run begins. They keep the
// identity of their origins, and the density where it is greater: else they would open holes in
// what is opaque.
void PlaceNewSites(const StartSites& sites, OwnedContents* start) {
  const size_t num_sites = sites.origin.size();
  // Among the sites, and among those that have moments.
  std::vector<size_t> rows, moment_rows;
  size_t num_moments = 0;
  for (size_t k = 0; k < num_sites; ++k) {
    if (sites.is_new[k]) {
      rows.push_back(k);
      moment_rows.push_back(num_moments);
    }
    if (!sites.is_frozen[k]) ++num_moments;
  }
  if (rows.empty()) return;
  for (const char* name : {"positions", "triangulated_positions", "plane_positions"}) {
    const auto place = [&](size_t i, std::span<Eigen::Vector3f> row) {
      row[0] = sites.points[i].position;
    };
    EditRows<Eigen::Vector3f>(name, num_sites, rows, place, start);
  }
  const auto color = [&](size_t i, std::span<float> row) {
    std::fill(row.begin(), row.end(), 0.f);
    for (int c = 0; c < 3; ++c) row[c] = ShOfSeedColor(sites.points[i].color[c]);
  };
  EditRows<float>("sh", num_sites, rows, color, start);
  const auto make_opaque = [](size_t, std::span<float> row) {
    row[0] = std::max(row[0], RawDensityOfSeed());
  };
  EditRows<float>("raw_density", num_sites, rows, make_opaque, start);
  const auto clear = [](size_t, auto row) { std::fill(row.begin(), row.end(), 0); };
  EditRows<float>("color_gradient", num_sites, rows, clear, start);
  EditRows<float>("first_moments", num_moments, moment_rows, clear, start);
  EditRows<float>("second_moments", num_moments, moment_rows, clear, start);
  EditRows<uint32_t>("steps", num_moments, moment_rows, clear, start);
}

// Returns the statistics with which a block begins: those of the sites of the split or, where its
// densification begins anew, none. Frozen sites are neither pruned nor divided.
DensificationStatistics StatisticsOfStart(const CheckpointContents& start,
                                          const std::vector<uint8_t>& is_frozen,
                                          bool begins_anew) {
  DensificationStatistics statistics;
  statistics.Reset(is_frozen.size(), is_frozen);
  if (begins_anew) return statistics;
  const auto errors = ValuesOf<float>(start, "squared_error");
  const auto contributions = ValuesOf<float>(start, "contribution");
  for (size_t k = 0; k < is_frozen.size(); ++k) {
    if (is_frozen[k]) continue;
    statistics.squared_error[k] = errors[k];
    statistics.contribution[k] = contributions[k];
  }
  return statistics;
}

// Returns the places of a block's sites in its file, in the order of JoinBlocks.
std::vector<uint32_t> OrderOfJoined(const Checkpoint& block, size_t num_sites) {
  std::vector<uint32_t> ancestor;
  StateReader("state", block).Array("ancestor", &ancestor, num_sites);
  std::vector<uint32_t> order(num_sites);
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return ancestor[a] < ancestor[b];
  });
  return order;
}

// Throws DamagedCheckpoint where the schedule of a block has not come as far as that of the blocks
// before it, whose progress is given; empty: it is the first.
void RequireSameProgress(const Checkpoint& block, std::map<std::string, std::string>* progress) {
  const auto& state = block.Texts("state");
  for (const char* name : kProgress) {
    const auto found = state.find(name);
    if (found != state.end() &&
        progress->emplace(name, found->second).first->second == found->second)
      continue;
    block.ThrowDamaged("its '" + std::string(name) + "' is not that of other blocks");
  }
}

// Collects sites of several checkpoints, which it orders as JoinBlocks does.
class SiteCollector {
 public:
  // Adds these of the `num_rows` sites of a checkpoint, each of which has moments unless they are
  // frozen. Throws DamagedCheckpoint where an array has another length.
  void Add(const Checkpoint& checkpoint,
           size_t num_rows,
           const std::vector<size_t>& chosen,
           bool are_frozen) {
    const auto add = [&](const char* name) {
      const auto bytes = checkpoint.Array(name);
      if (num_rows > 0 && bytes.size() % num_rows != 0) {
        checkpoint.ThrowDamaged("its array '" + std::string(name) + "' has another length");
      }
      std::vector<std::byte>& rows = arrays_[name];
      for (const size_t row : chosen) AppendRow(bytes, num_rows, row, &rows);
    };
    for (const char* name : kSiteArrays) {
      if (std::string(name) != kIsFrozen) add(name);
    }
    if (!are_frozen) {
      for (const char* name : kMomentArrays) add(name);
    }
    is_frozen_.insert(is_frozen_.end(), chosen.size(), are_frozen ? 1 : 0);
  }

  size_t NumSites() const { return is_frozen_.size(); }

  // Adds the arrays of all sites. Call it once.
  void Finish(OwnedContents* contents) {
    const size_t num_sites = NumSites();
    const auto ancestors = reinterpret_cast<const uint32_t*>(arrays_["ancestor"].data());
    std::vector<size_t> order(num_sites);
    std::iota(order.begin(), order.end(), size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
      return ancestors[a] < ancestors[b];
    });
    // The rows of the moments, in this order.
    std::vector<size_t> moment_of(num_sites), moments;
    size_t num_moments = 0;
    for (size_t i = 0; i < num_sites; ++i) moment_of[i] = is_frozen_[i] ? 0 : num_moments++;
    for (const size_t i : order) {
      if (!is_frozen_[i]) moments.push_back(moment_of[i]);
    }
    arrays_[kIsFrozen].resize(num_sites);
    std::memcpy(arrays_[kIsFrozen].data(), is_frozen_.data(), num_sites);
    for (auto& [name, rows] : arrays_) {
      const bool of_moments = IsAmong(kMomentArrays, name);
      AddRows({name, rows},
              of_moments ? num_moments : num_sites,
              of_moments ? moments : order,
              contents);
      rows = {};
    }
  }

 private:
  std::map<std::string, std::vector<std::byte>> arrays_;
  std::vector<uint8_t> is_frozen_;
};

// Returns the first `row` of every `stride` values of an array, in this order of its rows.
template <typename Vector>
void TakeRows(const Vector& values,
              size_t stride,
              size_t row,
              const std::vector<uint32_t>& order,
              Vector* taken) {
  taken->reserve(order.size() * row);
  for (const uint32_t site : order) {
    const auto begin = values.begin() + site * stride;
    taken->insert(taken->end(), begin, begin + row);
  }
}

}  // namespace

Foam FoamOf(const Checkpoint& checkpoint) {
  StateReader state("state", checkpoint);
  Foam foam;
  size_t num_sites = 0;
  state.Number("sites", &num_sites);
  state.Number("classes", &foam.num_classes);
  state.Number("sh_degree", &foam.sh_degree);
  if (foam.sh_degree < 0 || foam.sh_degree > 3 || foam.num_classes < 0) {
    checkpoint.ThrowDamaged("its sizes are out of range");
  }
  state.Array("positions", &foam.positions, num_sites);
  state.Array("raw_density", &foam.raw_density, num_sites);
  state.Array("sh", &foam.sh, num_sites * foam.ShStride());
  if (!checkpoint.Array("color_gradient").empty()) {
    state.Array("color_gradient", &foam.color_gradient, num_sites * kColorGradientDim);
  }
  if (!foam.HasSemantics()) return foam;
  const size_t classes = foam.num_classes;
  state.Array("identity", &foam.identity, num_sites * kIdentityDim);
  state.Array("classifier_weight", &foam.classifier_weight, classes * kIdentityDim);
  state.Array("classifier_bias", &foam.classifier_bias, classes);
  return foam;
}

DensificationStatistics StatisticsOf(const Checkpoint& checkpoint) {
  StateReader state("state", checkpoint);
  size_t num_sites = 0;
  state.Number("sites", &num_sites);
  DensificationStatistics statistics;
  state.Array("squared_error", &statistics.squared_error, num_sites);
  state.Array("contribution", &statistics.contribution, num_sites);
  return statistics;
}

int64_t IterationOf(const Checkpoint& checkpoint) {
  int64_t iteration = 0;
  StateReader("state", checkpoint).Number("iteration", &iteration);
  return iteration;
}

bool IsOfRun(const std::string& array) { return array == kSeeds || array == kGround; }

std::vector<SeedPoint> SeedsOf(const Checkpoint& start) {
  const auto positions = ValuesOf<Eigen::Vector3f>(start.Contents(), kSeeds);
  std::vector<SeedPoint> seeds;
  for (const Eigen::Vector3f& position : positions) {
    seeds.push_back({position, Eigen::Vector3f::Zero(), /*is_dense=*/false});
  }
  return seeds;
}

std::optional<SolidGround> GroundOf(const Checkpoint& start) {
  const CheckpointContents contents = start.Contents();
  const bool is_known = std::any_of(contents.arrays.begin(),
                                    contents.arrays.end(),
                                    [](auto& array) { return array.name == kGround; });
  if (!is_known) return std::nullopt;
  return ValuesOf<SolidGround>(contents, kGround).front();
}

bool CanBeSplit(const CheckpointContents& contents) {
  const auto pending = contents.texts.find("pending");
  return (pending == contents.texts.end() || pending->second.empty()) &&
         contents.texts.at("state").at("sh_degree_is_settled") == "1";
}

TrainingOptions OptionsOfBlock(const TrainingOptions& options, int64_t block_sites) {
  TrainingOptions block = options;
  block.final_sites = static_cast<int>(std::max<int64_t>(block_sites, 64));
  // The variations are means over all cells.
  const double share = double(block.final_sites) / options.final_sites;
  block.tv_weight *= share;
  block.color_tv_weight *= share;
  block.classifier_rate = 0;
  return block;
}

void ReadOptions(const Checkpoint& checkpoint, TrainingOptions* options) {
  StateReader reader("training_options", checkpoint);
  options->Serialize(&reader);
}

TrainingOptions OptionsOfCoarse(const TrainingOptions& options, int coarse_sites, double share) {
  TrainingOptions coarse = options;
  coarse.final_sites = coarse_sites;
  constexpr double kDensified = 0.75;
  coarse.densify_until = std::min(options.densify_until, kDensified * share);
  coarse.densify_from = std::min(options.densify_from, coarse.densify_until);
  const double duration = options.densify_until - options.densify_from;
  if (duration > 0) {
    const double part = (coarse.densify_until - coarse.densify_from) / duration;
    coarse.densify_events =
        std::max(1, static_cast<int>(std::lround(part * options.densify_events)));
  }
  coarse.fixed_sh_degree = true;
  coarse.sh_degree_interval = std::min(options.sh_degree_interval, share / (options.sh_degree + 1));
  return coarse;
}

TrainingOptions WithDensificationBetween(TrainingOptions options, double begin, double end) {
  CHECK_EQ(options.late_rays, 0);
  CHECK_LE(begin, end);
  const double duration = std::min(options.densify_until - options.densify_from, (end - begin) / 2);
  // New sites are watched before the first one.
  const double interval = duration / std::max(1, options.densify_events);
  options.fixed_sh_degree = true;
  options.densify_from = begin + interval;
  options.densify_until = begin + duration;
  return options;
}

OwnedContents BlockStart(const Checkpoint& split, const TrainingViews& views, BlockTraining block) {
  const CheckpointContents all = split.Contents();
  const auto positions = ValuesOf<Eigen::Vector3f>(all, "positions");
  const BlockBox padded = block.box.Padded(block.halo);
  StartSites sites = ChooseStartSites(positions, padded, block.rays.is_met);
  if (block.refines) {
    const auto num_frozen = static_cast<int64_t>(sites.NumFrozen());
    const double most = kFilled * double(block.options.final_sites - num_frozen);
    AddSitesAtSeeds(block.seeds, positions, padded, std::llround(most), &sites);
  }
  const std::vector<uint8_t>& is_frozen = sites.is_frozen;
  const size_t num_sites = sites.origin.size();
  const std::vector<size_t> rows(sites.origin.begin(), sites.origin.end());
  std::vector<size_t> trained;
  for (size_t k = 0; k < num_sites; ++k) {
    if (!is_frozen[k]) trained.push_back(rows[k]);
  }

  OwnedContents start;
  start.contents.texts = all.texts;
  for (const CheckpointContents::Array& array : all.arrays) {
    if (IsAmong(kSiteArrays, array.name)) {
      AddRows(array, positions.size(), rows, &start);
    } else if (IsAmong(kMomentArrays, array.name)) {
      AddRows(array, positions.size(), trained, &start);
    } else {
      start.contents.arrays.push_back(array);
    }
  }
  PlaceNewSites(sites, &start);
  auto& state = start.contents.texts["state"];
  if (block.refines) {
    state[kDensifications] = "0";
    state[kWatchedSince] = state.at("iteration");
  }
  const DensificationStatistics statistics =
      StatisticsOfStart(start.contents, is_frozen, block.refines);
  SetArray("is_frozen", is_frozen, &start);
  SetArray("ancestor", sites.origin, &start);
  SetArray("squared_error", statistics.squared_error, &start);
  SetArray("contribution", statistics.contribution, &start);
  // The cells of the cameras are found anew.
  SetArray("start_cells", std::vector<uint32_t>(views.NumViews(), 0), &start);
  state["sites"] = FormatNumber(num_sites);
  CheckpointContents own;
  StateWriter squares("state", &own), options("training_options", &own);
  block.rays.squares.Serialize(views, &squares);
  SetArray("drawn_squares", ValuesOf<uint8_t>(own, "drawn_squares"), &start);
  block.options.Serialize(&options);
  start.contents.texts["training_options"] = own.texts["training_options"];
  std::vector<Eigen::Vector3f> seeds;
  for (const SeedPoint& seed : block.seeds) seeds.push_back(seed.position);
  SetArray(kSeeds, seeds, &start);
  if (const std::optional<SolidGround> ground = views.Ground()) {
    SetArray(kGround, std::vector<SolidGround>{*ground}, &start);
  }
  return start;
}

OwnedContents BlockResult(const CheckpointContents& trained, const BlockBox& box, int64_t begin) {
  OwnedContents result;
  result.contents.texts = trained.texts;
  const auto positions = ValuesOf<Eigen::Vector3f>(trained, "positions");
  const auto is_frozen = ValuesOf<uint8_t>(trained, "is_frozen");
  // The sites in the box, none of which is frozen, and the rows of their moments.
  std::vector<size_t> own, own_moments;
  size_t num_moments = 0;
  for (size_t i = 0; i < positions.size(); ++i) {
    if (is_frozen[i]) continue;
    if (box.Contains(positions[i])) {
      own.push_back(i);
      own_moments.push_back(num_moments);
    }
    ++num_moments;
  }
  result.contents.texts["state"]["sites"] = FormatNumber(own.size());
  const bool is_trained = Number<int64_t>(trained, "iteration") > begin;
  for (const char* name : kSiteArrays) {
    // The topology of the joined foam is that of all blocks' last positions.
    const bool is_topology =
        std::string(name) == "triangulated_positions" || std::string(name) == "plane_positions";
    const auto bytes = ArrayOf(trained, is_topology && is_trained ? "positions" : name);
    AddRows({name, bytes}, positions.size(), own, &result);
  }
  for (const char* name : kMomentArrays) {
    AddRows({name, ArrayOf(trained, name)}, num_moments, own_moments, &result);
  }
  result.contents.arrays.push_back({kReports, ArrayOf(trained, kReports)});
  return result;
}

OwnedContents PolishStart(const Checkpoint& start,
                          const BlockBox& padded,
                          size_t own,
                          const std::vector<size_t>& blocks,
                          const ReadBlock& read) {
  OwnedContents polish;
  SiteCollector sites;
  {
    const CheckpointContents contents = start.Contents();
    const auto is_frozen = ValuesOf<uint8_t>(contents, "is_frozen");
    std::vector<size_t> frozen;
    for (size_t i = 0; i < is_frozen.size(); ++i) {
      if (is_frozen[i]) frozen.push_back(i);
    }
    sites.Add(start, is_frozen.size(), frozen, /*are_frozen=*/true);
    for (const CheckpointContents::Array& array : contents.arrays) {
      if (IsAmong(kSiteArrays, array.name) || IsAmong(kMomentArrays, array.name)) continue;
      polish.bytes.emplace_back(array.bytes.begin(), array.bytes.end());
      polish.contents.arrays.push_back({array.name, polish.bytes.back()});
    }
  }
  int64_t oldest_triangulation = std::numeric_limits<int64_t>::max();
  std::map<std::string, std::string> progress;
  for (const size_t b : blocks) {
    const std::unique_ptr<const Checkpoint> result = read(b);
    size_t num_sites = 0;
    int64_t last_triangulation = 0;
    StateReader state("state", *result);
    state.Number("sites", &num_sites);
    state.Number(kLastTriangulation, &last_triangulation);
    oldest_triangulation = std::min(oldest_triangulation, last_triangulation);
    RequireSameProgress(*result, &progress);
    std::vector<Eigen::Vector3f> positions;
    state.Array("positions", &positions, num_sites);
    std::vector<size_t> inside;
    for (size_t i = 0; i < num_sites; ++i) {
      if (padded.Contains(positions[i])) inside.push_back(i);
    }
    sites.Add(*result, num_sites, inside, /*are_frozen=*/false);
    if (b != own) continue;
    polish.contents.texts = result->Contents().texts;
    SetArray(kReports, ValuesOf<std::byte>(result->Contents(), kReports), &polish);
  }
  // The cells of the cameras are found anew, and the topology is that of the last positions.
  SetArray("start_cells",
           std::vector<uint32_t>(start.Array("start_cells").size() / sizeof(uint32_t), 0),
           &polish);
  polish.contents.texts.erase("pending");
  auto& state = polish.contents.texts["state"];
  state["sites"] = FormatNumber(sites.NumSites());
  state[kLastTriangulation] = FormatNumber(oldest_triangulation);
  sites.Finish(&polish);
  return polish;
}

std::vector<Eigen::Vector3f> SitesOfBlock(const Checkpoint& block) {
  StateReader state("state", block);
  size_t num_sites = 0;
  state.Number("sites", &num_sites);
  std::vector<Eigen::Vector3f> stored, positions;
  state.Array("positions", &stored, num_sites);
  TakeRows(stored, 1, 1, OrderOfJoined(block, num_sites), &positions);
  return positions;
}

std::set<std::string> ArraysOfSites() { return {"ancestor", "positions"}; }

std::set<std::string> ArraysOfFoam() {
  return {"ancestor", "positions", "raw_density", "sh", "identity"};
}

Foam FoamOfBlock(const Checkpoint& block) {
  StateReader state("state", block);
  size_t num_sites = 0;
  state.Number("sites", &num_sites);
  Foam stored, foam;
  state.Number("sh_degree", &stored.sh_degree);
  state.Number("classes", &foam.num_classes);
  if (stored.sh_degree < 0 || stored.sh_degree > 3 || foam.num_classes < 0) {
    block.ThrowDamaged("its sizes are out of range");
  }
  state.Array("positions", &stored.positions, num_sites);
  state.Array("raw_density", &stored.raw_density, num_sites);
  state.Array("sh", &stored.sh, num_sites * stored.ShStride());
  const std::vector<uint32_t> order = OrderOfJoined(block, num_sites);
  TakeRows(stored.positions, 1, 1, order, &foam.positions);
  TakeRows(stored.raw_density, 1, 1, order, &foam.raw_density);
  TakeRows(stored.sh, stored.ShStride(), foam.ShStride(), order, &foam.sh);
  if (!foam.HasSemantics()) return foam;
  state.Array("identity", &stored.identity, num_sites * kIdentityDim);
  TakeRows(stored.identity, kIdentityDim, kIdentityDim, order, &foam.identity);
  return foam;
}

OwnedContents JoinBlocks(const Checkpoint& split, const std::vector<const Checkpoint*>& blocks) {
  CHECK(!blocks.empty());
  OwnedContents joined;
  joined.contents = split.Contents();
  auto& state = joined.contents.texts["state"];
  std::vector<CheckpointContents> parts;
  std::vector<size_t> num_sites(blocks.size());
  // (ancestor, block, site) of each site.
  std::vector<std::tuple<uint32_t, uint32_t, uint32_t>> order;
  int64_t oldest_triangulation = std::numeric_limits<int64_t>::max();
  std::map<std::string, std::string> progress;
  for (size_t b = 0; b < blocks.size(); ++b) {
    StateReader reader("state", *blocks[b]);
    reader.Number("sites", &num_sites[b]);
    int64_t last_triangulation = 0;
    reader.Number(kLastTriangulation, &last_triangulation);
    oldest_triangulation = std::min(oldest_triangulation, last_triangulation);
    std::vector<uint32_t> ancestor;
    reader.Array("ancestor", &ancestor, num_sites[b]);
    for (uint32_t i = 0; i < num_sites[b]; ++i) order.emplace_back(ancestor[i], b, i);
    RequireSameProgress(*blocks[b], &progress);
    parts.push_back(blocks[b]->Contents());
  }
  std::sort(order.begin(), order.end());
  joined.contents.arrays.clear();
  for (const CheckpointContents::Array& array : split.Contents().arrays) {
    if (!IsAmong(kSiteArrays, array.name) && !IsAmong(kMomentArrays, array.name)) {
      joined.contents.arrays.push_back(array);
      continue;
    }
    joined.bytes.emplace_back();
    std::vector<std::byte>& rows = joined.bytes.back();
    std::vector<std::span<const std::byte>> arrays;
    for (size_t b = 0; b < blocks.size(); ++b) {
      arrays.push_back(blocks[b]->Array(array.name));
      if (num_sites[b] > 0 && arrays[b].size() % num_sites[b] != 0) {
        blocks[b]->ThrowDamaged("its array '" + array.name + "' has another length");
      }
    }
    for (const auto& [ancestor, block, site] : order) {
      AppendRow(arrays[block], num_sites[block], site, &rows);
    }
    joined.contents.arrays.push_back({array.name, rows});
  }
  // The cells of the cameras are found anew.
  const std::vector<uint32_t> start_cells(split.Array("start_cells").size() / sizeof(uint32_t), 0);
  SetArray("start_cells", start_cells, &joined);

  state["sites"] = FormatNumber(order.size());
  for (const auto& [name, value] : progress) state[name] = value;
  state[kLastTriangulation] = FormatNumber(oldest_triangulation);
  const CheckpointContents before = split.Contents();
  for (const char* name : kCounts) {
    auto sum = Number<int64_t>(before, name);
    for (const CheckpointContents& part : parts) {
      sum += Number<int64_t>(part, name) - Number<int64_t>(before, name);
    }
    state[name] = FormatNumber(sum);
  }
  for (const char* name : kSeconds) {
    auto sum = Number<double>(before, name);
    for (const CheckpointContents& part : parts) {
      sum += Number<double>(part, name) - Number<double>(before, name);
    }
    state[name] = FormatNumber(sum);
  }
  return joined;
}

}  // namespace semfoam
