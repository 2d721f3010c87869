// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/edit/label_editing.h"

#include "foam/edit/class_table.h"
#include "foam/model/classifier.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

using Sums = std::array<double, kIdentityDim>;

ClassIndex ClassOfCell(const Foam& foam, size_t cell, std::vector<float>* logits) {
  logits->resize(foam.num_classes);
  ClassLogits(foam, &foam.identity[cell * kIdentityDim], logits->data());
  return ClassIndex{ArgmaxSoftmax(*logits).class_index};
}

void RequireClass(ClassIndex class_index, const Model& model) {
  CHECK(model.foam.HasSemantics());
  CHECK(Value(class_index) >= 0 && Value(class_index) < static_cast<int>(model.labels.size()));
}

std::vector<uint32_t> CellsWith(ClassIndex class_index, const Foam& foam) {
  const std::vector<ClassIndex> classes = ClassesOfCells(foam);
  std::vector<uint32_t> cells;
  for (uint32_t i = 0; i < classes.size(); ++i) {
    if (classes[i] == class_index) cells.push_back(i);
  }
  return cells;
}

// Takes a class that no cell has out of the table.
void RemoveClass(ClassIndex removed, Model* model) {
  std::vector<ClassIndex> kept;
  for (int32_t k = 0; k < static_cast<int32_t>(model->labels.size()); ++k) {
    if (ClassIndex{k} != removed) kept.push_back(ClassIndex{k});
  }
  KeepClasses(kept, model);
}

}  // namespace

std::vector<ClassIndex> ClassesOfCells(const Foam& foam) {
  CHECK(foam.HasSemantics());
  std::vector<ClassIndex> classes(foam.NumSites());
  std::vector<float> logits;
  for (size_t i = 0; i < classes.size(); ++i) classes[i] = ClassOfCell(foam, i, &logits);
  return classes;
}

void GiveCells(const std::vector<uint32_t>& cells, ClassIndex class_index, Model* model) {
  RequireClass(class_index, *model);
  Foam& foam = model->foam;
  const std::vector<ClassIndex> classes = ClassesOfCells(foam);
  Sums sum = {};
  int64_t count = 0;
  for (size_t i = 0; i < classes.size(); ++i) {
    if (classes[i] != class_index) continue;
    for (int c = 0; c < kIdentityDim; ++c) sum[c] += foam.identity[i * kIdentityDim + c];
    ++count;
  }
  CHECK_GT(count, 0) << "no cell has the class";
  for (const uint32_t cell : cells) {
    if (classes[cell] == class_index) continue;
    for (int c = 0; c < kIdentityDim; ++c) {
      foam.identity[size_t{cell} * kIdentityDim + c] =
          static_cast<float>(sum[c] / static_cast<double>(count));
    }
  }
}

void GiveCellsNewLabel(const std::vector<uint32_t>& cells, const Label& label, Model* model) {
  const IdentityFeature feature = AddClass(label, model);
  for (const uint32_t cell : cells) {
    std::copy(feature.begin(),
              feature.end(),
              model->foam.identity.begin() + static_cast<int64_t>(cell) * kIdentityDim);
  }
}

void MergeClass(ClassIndex from, ClassIndex into, Model* model) {
  RequireClass(from, *model);
  CHECK(from != into);
  if (const std::vector<uint32_t> cells = CellsWith(from, model->foam); !cells.empty()) {
    GiveCells(cells, into, model);
  }
  RemoveClass(from, model);
}

void DropClass(ClassIndex class_index, Model* model) {
  RequireClass(class_index, *model);
  const auto none = std::find_if(model->labels.begin(),
                                 model->labels.end(),
                                 [](const Label& label) { return label.id == kNoObject; });
  const std::vector<uint32_t> cells = CellsWith(class_index, model->foam);
  const ClassIndex unlabelled{static_cast<int32_t>(none - model->labels.begin())};
  if (none == model->labels.end() || CellsWith(unlabelled, model->foam).empty()) {
    if (none != model->labels.end()) {
      RemoveClass(unlabelled, model);
      if (unlabelled < class_index) class_index = ClassIndex{Value(class_index) - 1};
    }
    GiveCellsNewLabel(cells, Label{kNoObject, MaskId{0}, ""}, model);
  } else {
    GiveCells(cells, unlabelled, model);
  }
  RemoveClass(class_index, model);
}

std::vector<std::vector<uint32_t>> ComponentsOf(const std::vector<uint32_t>& cells,
                                                const Delaunay& delaunay) {
  std::vector<uint8_t> is_open(delaunay.num_cells, 0);
  for (const uint32_t cell : cells) is_open[cell] = 1;
  std::vector<uint32_t> sorted = cells;
  std::sort(sorted.begin(), sorted.end());
  std::vector<std::vector<uint32_t>> components;
  for (const uint32_t first : sorted) {
    if (is_open[first] == 0) continue;
    std::vector<uint32_t>& component = components.emplace_back();
    component.push_back(first);
    is_open[first] = 0;
    for (size_t next = 0; next < component.size(); ++next) {
      for (const uint32_t neighbor : delaunay.Neighbors(component[next])) {
        if (is_open[neighbor] == 0) continue;
        is_open[neighbor] = 0;
        component.push_back(neighbor);
      }
    }
    std::sort(component.begin(), component.end());
  }
  std::stable_sort(components.begin(), components.end(), [](const auto& a, const auto& b) {
    return a.size() > b.size();
  });
  return components;
}

}  // namespace semfoam
