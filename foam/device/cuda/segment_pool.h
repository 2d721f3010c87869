// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/cuda/shared_counter.h"
#include "foam/render/ray_record.h"
#include "foam/util/host_device.h"

#include <cmath>
#include <cstdint>

// Records the segments of thousands of rays that are cast at the same time, in chunks of a shared
// pool, as many as each ray needs. The walk writes a ray's segments; the backward pass reads each
// of them once and overwrites it with the contribution to a cell.

namespace semfoam {

// Either a segment of a ray: its cell, flags, and t_out, tau_in, sigma, colour and slope (all but
// the first only if it is shaded). Or a contribution (CellContribution): its cell, its ray and
// channels, and weight, density, position and centroid.
struct alignas(16) Slot {
  uint32_t cell;
  uint32_t bits;
  float values[10];
};

inline constexpr uint32_t kSlotsPerChunk = 32;
inline constexpr uint32_t kNoChunk = ~0u;

// The chunks of all rays of a batch.
struct SegmentPool {
  // [num_chunks][kSlotsPerChunk]
  Slot* slots = nullptr;
  // [num_chunks] The chunk before, on the same ray.
  uint32_t* previous = nullptr;
  // Number of chunks requested: more than num_chunks if the pool was too small.
  uint32_t* num_taken = nullptr;
  uint32_t num_chunks = 0;
};

// A position between two slots of a ray.
struct SlotCursor {
  uint32_t chunk = kNoChunk;
  uint32_t position = kSlotsPerChunk;

  // Moves back over a slot, and returns its index in the pool.
  SEMFOAM_HOST_DEVICE uint32_t Back(const SegmentPool& pool) {
    if (position == 0) {
      chunk = pool.previous[chunk];
      position = kSlotsPerChunk;
    }
    --position;
    return chunk * kSlotsPerChunk + position;
  }
};

// Records a ray in the pool, with the interface of RayRecord.
class PooledRecord : public RayInProgress<float> {
 public:
  SEMFOAM_HOST_DEVICE explicit PooledRecord(const SegmentPool& pool) : pool_(pool) {}

  SEMFOAM_HOST_DEVICE void Clear() {
    end_ = {};
    end_of_segments_ = {};
    num_segments = num_clamped = 0;
    num_shaded_ = 0;
    overflow = false;
  }
  SEMFOAM_HOST_DEVICE int NumShaded() const { return num_shaded_; }

  SEMFOAM_HOST_DEVICE bool Add(const RecordedSegment<float>& segment,
                               const ShadedSegment<float>* appearance) {
    Slot slot{segment.cell, segment.clamped ? kClamped : 0, {segment.t_out}};
    if (appearance != nullptr) {
      slot.bits |= kShaded;
      slot.values[1] = appearance->tau_in;
      slot.values[2] = appearance->sigma;
      for (int c = 0; c < 3; ++c) slot.values[3 + c] = appearance->color[c];
      for (int c = 0; c < 3; ++c) slot.values[6 + c] = appearance->slope[c];
    }
    if (!Push(slot)) return false;
    end_of_segments_ = end_;
    ++num_segments;
    num_shaded_ += appearance != nullptr;
    num_clamped += segment.clamped;
    last_next_ = segment.next;
    return true;
  }

  // Reserves one more slot, for a contribution that has no segment.
  SEMFOAM_HOST_DEVICE bool AddRoom() { return Push({0, 0, {}}); }

  struct Backwards {
    const PooledRecord& record;
    SlotCursor cursor;
    uint32_t segments_left;
    int shaded_left;
    uint32_t next_cell;
    Slot slot;  // the next segment's

    SEMFOAM_HOST_DEVICE bool Next(RecordedSegment<float>* segment,
                                  ShadedSegment<float>* appearance) {
      if (segments_left == 0) return false;
      const Slot here = slot;
      float t_in = 0;
      if (--segments_left > 0) {
        slot = record.pool_.slots[cursor.Back(record.pool_)];
        t_in = slot.values[0];
      }
      segment->cell = here.cell;
      segment->next = next_cell;
      segment->clamped = (here.bits & kClamped) != 0;
      segment->t_out = here.values[0];
      segment->shaded = -1;
      next_cell = here.cell;
      if ((here.bits & kShaded) == 0) return true;
      segment->shaded = --shaded_left;
      appearance->t_in = t_in;
      appearance->tau_in = here.values[1];
      appearance->sigma = here.values[2];
      appearance->optical_depth = appearance->sigma * (segment->t_out - t_in);  // as in AddSegment
      appearance->weight = std::exp(-appearance->tau_in) * -std::expm1(-appearance->optical_depth);
      appearance->centroid =
          t_in + (segment->t_out - t_in) * CentroidShare(appearance->optical_depth);
      for (int c = 0; c < 3; ++c) appearance->color[c] = here.values[3 + c];
      for (int c = 0; c < 3; ++c) appearance->slope[c] = here.values[6 + c];
      return true;
    }
  };
  SEMFOAM_HOST_DEVICE Backwards FromTheEnd() const {
    Backwards segments{*this, end_of_segments_, num_segments, num_shaded_, last_next_, {}};
    if (num_segments > 0) segments.slot = pool_.slots[segments.cursor.Back(pool_)];
    return segments;
  }

  SEMFOAM_HOST_DEVICE SlotCursor end() const { return end_; }

  uint32_t num_segments = 0;
  uint32_t num_clamped = 0;
  bool overflow = false;  // the pool was too small

 private:
  static constexpr uint32_t kShaded = 1, kClamped = 2;

  SEMFOAM_HOST_DEVICE bool Push(const Slot& slot) {
    if (end_.position == kSlotsPerChunk) {
      const uint32_t chunk = TakeNumber(pool_.num_taken);
      if (chunk >= pool_.num_chunks) {
        overflow = true;
        return false;
      }
      pool_.previous[chunk] = end_.chunk;
      end_ = {chunk, 0};
    }
    pool_.slots[end_.chunk * kSlotsPerChunk + end_.position++] = slot;
    return true;
  }

  const SegmentPool& pool_;
  SlotCursor end_, end_of_segments_;
  int num_shaded_ = 0;
  uint32_t last_next_ = 0;
};

// Writes contributions from the end of a record backwards: at most one for each segment and each
// reserved slot, and for the cell behind a segment only after that segment was read, so that none
// overwrites a segment that is still to be read.
class ContributionWriter {
 public:
  SEMFOAM_HOST_DEVICE ContributionWriter(const SegmentPool& pool, SlotCursor end)
      : pool_(pool), cursor_(end) {}

  SEMFOAM_HOST_DEVICE void Write(uint32_t ray, const CellContribution<float>& c) {
    pool_.slots[cursor_.Back(pool_)] = {
        c.cell,
        ray << 3 | c.color_mask,
        {c.weight, c.density, c.position[0], c.position[1], c.position[2], c.centroid}};
    ++num_written_;
  }
  SEMFOAM_HOST_DEVICE uint32_t num_written() const { return num_written_; }

 private:
  const SegmentPool& pool_;
  SlotCursor cursor_;
  uint32_t num_written_ = 0;
};

// Decode the bits of a contribution.
SEMFOAM_HOST_DEVICE inline uint32_t RayOf(const Slot& slot) { return slot.bits >> 3; }
SEMFOAM_HOST_DEVICE inline CellContribution<float> ContributionIn(const Slot& slot) {
  return {slot.cell,
          slot.bits & 7,
          slot.values[0],
          slot.values[1],
          Eigen::Vector3f(slot.values[2], slot.values[3], slot.values[4]),
          slot.values[5]};
}

}  // namespace semfoam
