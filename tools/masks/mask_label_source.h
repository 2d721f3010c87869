// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/export_transform.h"
#include "export/transfer/label_source.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/mask/corrected_masks.h"
#include "plugin/mask/surface_views.h"

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Geometry>

namespace semfoam {

// The labels of masks for a surface that hides itself from the photos (SurfaceViews): no foam, no
// training.
class MaskLabels : public LabelSource {
 public:
  // The model and the photos must outlive this. `labels` are those of the photos, with names;
  // `transform` leads from the model's frame to that of the file.
  MaskLabels(const Reconstruction& model,
             const CorrectedPhotos& photos,
             std::vector<Label> labels,
             const ExportTransform& transform);

  const std::vector<Label>& labels() const override { return labels_; }
  bool NeedsWholeFile() const override { return true; }
  // Draws the surface, and measures the resolution: three pixels of a mask, in the median over the
  // vertices that photos see.
  void LookAt(const PolygonMesh& mesh) override;
  double Resolution() const override { return resolution_; }
  double Tolerance() const override { return 0; }
  Answer Ask(const Eigen::Vector3d& x,
             const Eigen::Vector3d& normal,
             uint32_t* hint) const override;
  bool UnknownIsUnlabelled() const override { return false; }
  std::string Why(const std::vector<Eigen::Vector3d>& places) const override;

 private:
  Eigen::Vector3d ModelFromFile(const Eigen::Vector3d& x) const;

  const Reconstruction& model_;
  const CorrectedPhotos& photos_;
  const std::vector<Label> labels_;
  const ExportTransform transform_;
  // Beyond it nothing of the model can be: three times as wide as the robust extent of its points.
  // Empty: the model has no points.
  Eigen::AlignedBox3d box_;
  std::unique_ptr<const SurfaceViews> views_;
  double resolution_ = 1;
};

}  // namespace semfoam
