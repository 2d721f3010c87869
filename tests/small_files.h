// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/io/byte_writer.h"
#include "foam/model/model.h"

#include <algorithm>
#include <cstdint>
#include <string>

// Small valid files, made by hand, to be spoilt: by the tables of bad inputs and by the fuzzers.
namespace semfoam {

// Three sites, two classes ("mug" and none), a photo.
inline Model SmallFoam(int sh_degree) {
  Model model;
  Foam& foam = model.foam;
  foam.sh_degree = sh_degree;
  foam.num_classes = 2;
  for (int i = 0; i < 3; ++i) {
    foam.positions.push_back(Eigen::Vector3f(0.5f, 1, 2) * static_cast<float>(i));
    foam.raw_density.push_back(1);
  }
  foam.sh.assign(3 * foam.ShStride(), 0.25f);
  foam.identity.assign(3 * kIdentityDim, 0.5f);
  foam.classifier_weight.assign(2 * kIdentityDim, -1);
  foam.classifier_bias.assign(2, 0);
  model.statistics.contribution.assign(3, 1);
  model.statistics.mean_color.assign(3, {0.5f, 0.5f, 0.5f});
  model.statistics.passed.assign(3, 1);
  model.statistics.stopped.assign(3, 1);
  model.labels = {{LabelId{0}, MaskId{0}, ""}, {LabelId{7}, MaskId{0x123456}, "mug"}};
  PhotoRecord photo;
  photo.name = "a/b.jpg";
  photo.camera_model = "PINHOLE";
  photo.width = 64;
  photo.height = 48;
  photo.camera_params = {50, 50, 32, 24};
  photo.held_out = true;
  model.photos = {photo};
  model.options = {{"num_rays", "100"}};
  return model;
}

// Radiant Foam's PLY of three sites with `num_rest` coefficients color_sh_* each, in whose header
// stands `num_sites`.
inline std::string SmallRadiantFoam(const std::string& num_sites, int num_rest) {
  std::string ply = "ply\nformat binary_little_endian 1.0\nelement vertex " + num_sites + "\n";
  for (const char* name : {"float x",
                           "float y",
                           "float z",
                           "uchar red",
                           "uchar green",
                           "uchar blue",
                           "float density",
                           "uint adjacency_offset"}) {
    ply += std::string("property ") + name + "\n";
  }
  for (int k = 0; k < num_rest; ++k) ply += "property float color_sh_" + std::to_string(k) + "\n";
  ply += "element adjacency 2\nproperty uint adjacency\nend_header\n";
  for (const float x : {0.f, 1.f, 2.f}) {
    for (const float value : {x, -x, 1.f}) AppendBinary(value, &ply);
    ply += "abc";
    AppendBinary(0.5f, &ply);
    AppendBinary(uint32_t{x > 0 ? 2u : 1u}, &ply);
    for (int k = 0; k < num_rest; ++k) AppendBinary(0.125f, &ply);
  }
  AppendBinary(uint32_t{1}, &ply);
  AppendBinary(uint32_t{0}, &ply);
  return ply;
}

// A PLY of one triangle in one of the three formats; `corners` is the length of its list, of type
// uint, however many there are.
inline std::string SmallPlyMesh(const std::string& format, uint32_t corners = 3) {
  std::string ply = "ply\nformat " + format +
                    " 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                    "element face 1\nproperty list uint int vertex_indices\nend_header\n";
  if (format == "ascii") {
    return ply + "0 0 0\n1 0 0\n0 1 0\n" + std::to_string(corners) + " 0 1 2\n";
  }
  const auto append = [&](const auto& value) {
    AppendBinary(value, &ply);
    if (format == "binary_big_endian") std::reverse(ply.end() - sizeof(value), ply.end());
  };
  for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) append(x);
  append(corners);
  for (const int32_t corner : {0, 1, 2}) append(corner);
  return ply;
}

// A cloud of three points, red, green and blue, as OpenMVS writes it, with lists of the photos that
// see each, and a face; `number` is the type of the coordinates, `count` stands in the header.
inline std::string SmallCloud(const std::string& format,
                              const std::string& number = "float",
                              const std::string& count = "3") {
  std::string ply = "ply\nformat " + format + " 1.0\nelement vertex " + count + "\n";
  for (const char* name : {"x", "y", "z"}) ply += "property " + number + " " + name + "\n";
  for (const char* name : {"red", "green", "blue"}) {
    ply += std::string("property uchar ") + name + "\n";
  }
  ply +=
      "property list uchar uint view_indices\nproperty list uchar float view_weights\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const bool is_text = format == "ascii";
  const auto append = [&](const auto& value) {
    if (is_text) {
      ply += std::to_string(value) + " ";
      return;
    }
    AppendBinary(value, &ply);
    if (format == "binary_big_endian") std::reverse(ply.end() - sizeof(value), ply.end());
  };
  const double places[3][3] = {{0, 0, 0}, {1, 0, 0.25}, {0, 1, -0.5}};
  for (uint8_t i = 0; i < 3; ++i) {
    for (const double x : places[i]) {
      number == "float" ? append(static_cast<float>(x)) : append(x);
    }
    for (int c = 0; c < 3; ++c) append(static_cast<uint8_t>(c == i ? 255 : 0));
    append(i);
    for (uint32_t k = 0; k < i; ++k) append(k);
    append(i);
    for (uint32_t k = 0; k < i; ++k) append(0.5f);
    if (is_text) ply.back() = '\n';
  }
  append(uint8_t{3});
  for (const int32_t corner : {0, 1, 2}) append(corner);
  return ply;
}

// The triangle as an .om file of version 2.2, as OpenMesh 9 writes it, with a property for each
// vertex; the counts are the header's.
inline std::string SmallOmMesh(uint32_t vertices = 3, uint32_t faces = 1, uint32_t edges = 3) {
  std::string om = "OMT\x42";
  for (const uint32_t count : {vertices, faces, edges}) AppendBinary(count, &om);
  AppendBinary(uint16_t{0x5600}, &om);  // positions, three doubles each
  for (const double x : {0., 0., 0., 1., 0., 0., 0., 1., 0.}) AppendBinary(x, &om);
  AppendBinary(uint16_t{0x16f8}, &om);  // halfedges: the next one, the vertex it leads to, the face
  for (const int8_t number : {2, 1, 0, 5, 0, -1, 4, 2, 0, 1, 1, -1, 0, 0, 0, 3, 2, -1}) {
    AppendBinary(number, &om);
  }
  AppendBinary(uint16_t{0x06e0}, &om);  // a halfedge of each vertex
  for (const int8_t number : {5, 1, 3}) AppendBinary(number, &om);
  AppendBinary(uint16_t{0x06e8}, &om);  // and of each face
  AppendBinary(int8_t{4}, &om);
  AppendBinary(uint16_t{0x00c2}, &om);
  om += "\x05label\x07int32_t";
  for (const uint32_t number : {12, 7, 8, 9}) AppendBinary(number, &om);
  AppendBinary(uint16_t{0x001c}, &om);  // the end
  return om;
}

}  // namespace semfoam
