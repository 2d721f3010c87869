// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/edit/object_editing.h"

#include "foam/edit/class_table.h"
#include "foam/edit/model_sites.h"
#include "foam/model/classifier.h"
#include "foam/optim/optimizer.h"

#include <algorithm>

#include <Eigen/Core>
#include <glog/logging.h>

namespace semfoam {
namespace {

std::vector<int32_t> ObjectOfSite(const Model& model, const std::vector<ObjectCells>& objects) {
  std::vector<int32_t> object_of_site(model.foam.NumSites(), -1);
  for (size_t k = 0; k < objects.size(); ++k) {
    const int32_t class_index = Value(objects[k].class_index);
    CHECK(class_index >= 0 && class_index < model.foam.num_classes);
    for (const uint32_t cell : objects[k].cells) {
      CHECK_EQ(object_of_site[cell], -1);
      object_of_site[cell] = static_cast<int32_t>(k);
    }
  }
  return object_of_site;
}

int32_t ClassOf(const Foam& foam, uint32_t site, std::vector<float>* logits) {
  logits->resize(foam.num_classes);
  ClassLogits(foam, &foam.identity[site * kIdentityDim], logits->data());
  return ArgmaxSoftmax(*logits).class_index;
}

// Every cell of an object is of the object's class: those that are not get the mean of the others'
// features, which is of that class because a linear classifier's classes are convex. Class k of the
// model is that of object k.
void LabelHiddenCells(const std::vector<int32_t>& object_of_site, Foam* foam) {
  using Feature = Eigen::Matrix<double, kIdentityDim, 1>;
  const auto feature = [&](size_t i) {
    return Eigen::Map<Eigen::Matrix<float, kIdentityDim, 1>>(&foam->identity[i * kIdentityDim]);
  };
  std::vector<Feature> sum(foam->num_classes, Feature::Zero());
  std::vector<size_t> count(foam->num_classes, 0);
  std::vector<uint32_t> strangers;
  std::vector<float> logits;
  for (uint32_t i = 0; i < object_of_site.size(); ++i) {
    const int32_t object = object_of_site[i];
    if (object < 0) continue;
    if (ClassOf(*foam, i, &logits) != object) {
      strangers.push_back(i);
      continue;
    }
    sum[object] += feature(i).cast<double>();
    ++count[object];
  }
  for (const uint32_t i : strangers) {
    const int32_t object = object_of_site[i];
    CHECK_GT(count[object], 0u) << "an object without a cell of its class";
    feature(i) = (sum[object] / static_cast<double>(count[object])).cast<float>();
  }
}

}  // namespace

ExtractedObjects ExtractObjects(const Model& model,
                                const Delaunay& delaunay,
                                const std::vector<ObjectCells>& objects) {
  const std::vector<int32_t> object_of_site = ObjectOfSite(model, objects);
  std::vector<uint8_t> is_kept(model.foam.NumSites(), 0);
  for (uint32_t i = 0; i < delaunay.num_sites; ++i) {
    if (object_of_site[i] < 0) continue;
    is_kept[i] = 1;
    for (const uint32_t next : delaunay.Neighbors(i)) {
      if (next < delaunay.num_sites) is_kept[next] = 1;
    }
  }
  std::vector<uint32_t> kept;
  ExtractedObjects extracted;
  for (uint32_t i = 0; i < delaunay.num_sites; ++i) {
    if (!is_kept[i]) continue;
    kept.push_back(i);
    extracted.object_of_site.push_back(object_of_site[i]);
  }
  extracted.model = WithSites(model, kept);
  extracted.model.foam.assumed_density.clear();
  std::vector<ClassIndex> classes(objects.size());
  for (size_t k = 0; k < objects.size(); ++k) classes[k] = objects[k].class_index;
  KeepClasses(classes, &extracted.model);
  LabelHiddenCells(extracted.object_of_site, &extracted.model.foam);
  for (uint32_t i = 0; i < kept.size(); ++i) {
    if (extracted.object_of_site[i] < 0) MakeEmpty(i, &extracted.model);
  }
  return extracted;
}

Model RemoveObjects(const Model& model,
                    const Delaunay& delaunay,
                    const CellLabels& cell_labels,
                    const std::vector<uint8_t>& is_in_object,
                    const std::vector<ObjectCells>& objects) {
  const std::vector<int32_t> object_of_site = ObjectOfSite(model, objects);
  const CellStatistics& statistics = model.statistics;
  Model edited = model;
  // What was assumed behind the objects would stand where they were.
  edited.foam.assumed_density.clear();
  for (const ObjectCells& object : objects) {
    std::vector<uint8_t> is_reached(delaunay.num_sites, 0);
    std::vector<uint32_t> reached = object.cells;
    for (size_t k = 0; k < reached.size(); ++k) {
      const bool is_first_ring = k < object.cells.size();
      for (const uint32_t next : delaunay.Neighbors(reached[k])) {
        if (next >= delaunay.num_sites || is_reached[next] || is_in_object[next]) continue;
        if (!is_first_ring && cell_labels.class_index[next] != object.class_index) continue;
        const bool lets_light_pass =
            !statistics.passed.empty() && statistics.passed[next] > statistics.stopped[next];
        if (cell_labels.solid[next] && !lets_light_pass) continue;
        is_reached[next] = 1;
        edited.foam.raw_density[next] = kTransparentRawDensity;
        if (cell_labels.class_index[next] == object.class_index) reached.push_back(next);
      }
    }
  }

  std::vector<uint32_t> kept;
  for (uint32_t i = 0; i < delaunay.num_sites; ++i) {
    const auto around = delaunay.Neighbors(i);
    const auto is_outside = [&](uint32_t j) {
      return j >= delaunay.num_sites || object_of_site[j] < 0;
    };
    if (object_of_site[i] < 0) {
      kept.push_back(i);
    } else if (std::any_of(around.begin(), around.end(), is_outside)) {
      kept.push_back(i);
      MakeEmpty(i, &edited);
    }
  }
  std::vector<ClassIndex> classes;
  for (int32_t k = 0; k < model.foam.num_classes; ++k) {
    if (std::none_of(objects.begin(), objects.end(), [&](const ObjectCells& object) {
          return object.class_index == ClassIndex{k};
        })) {
      classes.push_back(ClassIndex{k});
    }
  }
  KeepClasses(classes, &edited);
  return WithSites(edited, kept);
}

}  // namespace semfoam
