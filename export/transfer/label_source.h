// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/transfer/matter_search.h"
#include "export/transfer/polygon_mesh.h"
#include "foam/model/model.h"

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// What knows the labels of places: a foam, or photos with masks.
class LabelSource {
 public:
  virtual ~LabelSource() = default;

  // The table of all labels.
  virtual const std::vector<Label>& labels() const = 0;

  // Whether LookAt must be called with the whole file before the first place is labelled.
  virtual bool NeedsWholeFile() const = 0;
  virtual void LookAt(const PolygonMesh& mesh) = 0;

  // The length, in units of the file, of what the source can tell apart; after LookAt.
  virtual double Resolution() const = 0;
  // The distance up to which it knows a place; 0: it has none.
  virtual double Tolerance() const = 0;

  struct Answer {
    SurfaceLabel label;
    // Whether it knows the place at all.
    bool is_known = false;
  };
  // Labels a place with its normal (of any length and either sign; zero: unknown), in the frame of
  // the file. `*hint` is 0 at first, and then what the call for a place nearby has left. May be
  // called from several threads.
  virtual Answer Ask(const Eigen::Vector3d& x,
                     const Eigen::Vector3d& normal,
                     uint32_t* hint) const = 0;

  // Whether faces that it does not know have no label (of a foam, there is nothing), rather than
  // those of the faces around them (photos have not seen them).
  virtual bool UnknownIsUnlabelled() const = 0;

  // Of places of which it does not know most: what is wrong with them, as the end of a sentence
  // that begins "90 % of its vertices ".
  virtual std::string Why(const std::vector<Eigen::Vector3d>& places) const = 0;
};

// The labels of a foam: those of the matter nearest to a place (MatterSearch).
class FoamLabels : public LabelSource {
 public:
  // `scene` must outlive this; `tolerance` as in MatterSearch.
  FoamLabels(const ExportableScene& scene, double tolerance)
      : scene_(scene), search_(scene, tolerance) {}

  const std::vector<Label>& labels() const override { return scene_.label_table; }
  bool NeedsWholeFile() const override { return false; }
  void LookAt(const PolygonMesh&) override {}
  double Resolution() const override { return search_.resolution(); }
  double Tolerance() const override { return search_.tolerance(); }
  Answer Ask(const Eigen::Vector3d& x,
             const Eigen::Vector3d& normal,
             uint32_t* hint) const override;
  bool UnknownIsUnlabelled() const override { return true; }
  std::string Why(const std::vector<Eigen::Vector3d>& places) const override;

 private:
  const ExportableScene& scene_;
  const MatterSearch search_;
};

// Returns ", and their mean, (x, y, z), is off that of `what`, (x, y, z), by 12", for the sentences
// of LabelSource::Why.
std::string MeansApart(const std::vector<Eigen::Vector3d>& places,
                       const std::string& what,
                       const Eigen::Vector3d& mean_of_what);

}  // namespace semfoam
