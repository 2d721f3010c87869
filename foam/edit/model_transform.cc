// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/edit/model_transform.h"

#include "foam/edit/model_sites.h"
#include "foam/model/sh_rotation.h"

namespace semfoam {
namespace {

// Turns the foam about the origin of the normalised frame.
void TurnFoam(const Eigen::Matrix3d& rotation, Foam* foam) {
  for (Eigen::Vector3f& x : foam->positions) x = (rotation * x.cast<double>()).cast<float>();
  for (size_t k = 0; k < foam->color_gradient.size(); k += kColorGradientDim) {
    // Rows are axes.
    using Gradient = Eigen::Matrix<float, 3, 3, Eigen::RowMajor>;
    Eigen::Map<Gradient> gradient(&foam->color_gradient[k]);
    gradient = (rotation * gradient.cast<double>()).cast<float>().eval();
  }
  const ShRotation turn(foam->sh_degree, rotation);
  for (size_t i = 0; i < foam->NumSites(); ++i) turn.Apply(&foam->sh[i * foam->ShStride()]);
}

}  // namespace

void TransformModel(const Sim3& target_from_source, Model* model) {
  const double scale = target_from_source.scale;
  const Eigen::Matrix3d& rotation = target_from_source.rotation;
  const bool is_turned = rotation != Eigen::Matrix3d::Identity();
  Similarity& frame = model->world_from_normalized;
  frame = {scale * frame.scale, target_from_source.Apply(frame.translation)};
  for (PhotoRecord& photo : model->photos) {
    const Eigen::Matrix3d turned =
        photo.cam_from_world_rotation.toRotationMatrix() * rotation.transpose();
    // Without a turn the same bytes stay.
    if (is_turned) photo.cam_from_world_rotation = Eigen::Quaterniond(turned).normalized();
    photo.cam_from_world_translation =
        scale * photo.cam_from_world_translation - turned * target_from_source.translation;
  }
  if (!is_turned) return;
  TurnFoam(rotation, &model->foam);
  SortSites(model);
}

}  // namespace semfoam
