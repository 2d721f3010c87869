// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/rank_decisions.h"

#include "tools/controllers/mask_importing.h"

#include <cstddef>
#include <cstring>
#include <span>
#include <string>

namespace semfoam {

void ImportMasksOnce(RankGroup* ranks, const std::filesystem::path& folder, SceneOptions* scene) {
  if (IsFirstRank(ranks)) ImportMasksOf(scene, folder);
  scene->mask_path = FromFirstRank(ranks, scene->mask_path.string());
  scene->mask_consistency = FromFirstRank(ranks, scene->mask_consistency);
}

void RequireOneRun(RankGroup* ranks, const CheckpointTexts& identity) {
  std::string text = SEMFOAM_VERSION;
  for (const auto& [group, values] : identity) {
    for (const auto& [name, value] : values) text += "\n" + group + " " + name + " " + value;
  }
  RequireAgreement(ranks,
                   text,
                   "options or files",
                   "the same version of the program, command and files on all machines");
}

std::unique_ptr<Checkpoint> NewestCheckpointOf(RankGroup* ranks,
                                               DeviceKind device,
                                               TrainingFolder* folder) {
  std::unique_ptr<Checkpoint> checkpoint;
  if (IsFirstRank(ranks)) checkpoint = folder->NewestCheckpoint(device);
  const std::string path =
      FromFirstRank(ranks, checkpoint == nullptr ? "" : checkpoint->path().string());
  if (!IsFirstRank(ranks) && !path.empty()) checkpoint = folder->CheckpointAt(path, device);
  return checkpoint;
}

AfterIteration DecideAfterIteration(RankGroup* ranks, const AfterIteration& own) {
  if (ranks == nullptr) return own;
  AfterIteration decision;
  const auto all = ranks->Gather(std::as_bytes(std::span(&own, 1)));
  for (auto of_rank = all.rbegin(); of_rank != all.rend(); ++of_rank) {
    AfterIteration wish;
    std::memcpy(&wish, of_rank->data(), sizeof(wish));
    if (wish.signal != 0) decision.signal = wish.signal;
    decision.checkpoint_is_due = wish.checkpoint_is_due;
  }
  return decision;
}

}  // namespace semfoam
