// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/label_cut.h"

#include "export/transfer/face_votes.h"
#include "foam/util/parallel.h"

#include <limits>
#include <random>

#include "tests/export/transfer/test_meshes.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr LabelId kMug{7}, kTable{5};

FaceVotes VotesOf(const std::vector<std::vector<FaceVote>>& faces) {
  FaceVotes votes;
  for (const std::vector<FaceVote>& face : faces) {
    votes.votes.insert(votes.votes.end(), face.begin(), face.end());
    votes.first.push_back(votes.votes.size());
  }
  return votes;
}

// Votes with confidence 0.9 for what `label_of` says of a face's first corner.
template <typename LabelOf>
FaceVotes VotesOf(const PolygonMesh& mesh, const LabelOf& label_of) {
  std::vector<std::vector<FaceVote>> faces;
  for (size_t f = 0; f < mesh.NumFaces(); ++f) {
    faces.push_back({{label_of(mesh.vertices[mesh.Face(f)[0]]), 0.9f}});
  }
  return VotesOf(faces);
}

int CountWrong(const PolygonMesh& mesh,
               const std::vector<SurfaceLabel>& labels,
               const std::function<LabelId(const Eigen::Vector3d&)>& truth) {
  int wrong = 0;
  for (size_t f = 0; f < mesh.NumFaces(); ++f) {
    wrong += labels[f].id != truth(mesh.vertices[mesh.Face(f)[0]]);
  }
  return wrong;
}

LabelId BySide(const Eigen::Vector3d& corner) { return corner.x() < -1e-9 ? kMug : kTable; }

TEST(LabelCut, SpotsAreNoiseAndLargeRegionsStay) {
  PolygonMesh mesh;
  AddFoldedGrid(24, 0, &mesh);
  std::mt19937 random(2);
  const FaceVotes noisy = VotesOf(mesh, [&](const Eigen::Vector3d& corner) {
    const bool is_wrong = random() % 10 == 0;
    return is_wrong ? (BySide(corner) == kMug ? kTable : kMug) : BySide(corner);
  });
  const std::vector<SurfaceLabel> raw = CutFaceLabels(mesh, noisy, 0);
  EXPECT_GT(CountWrong(mesh, raw, BySide), 30);
  const std::vector<SurfaceLabel> cut = CutFaceLabels(mesh, noisy, 1);
  EXPECT_LE(CountWrong(mesh, cut, BySide), 4);
  for (size_t f = 0; f < mesh.NumFaces(); ++f) {
    EXPECT_EQ(cut[f].confidence, cut[f].id == raw[f].id ? 0.9f : 0);
  }
}

// A border that the votes place two faces beside a crease goes to the crease, concave or convex,
// and stays where there is none.
TEST(LabelCut, BordersGoToCreases) {
  for (const double degrees : {80., -80., 0.}) {
    PolygonMesh mesh;
    AddFoldedGrid(24, degrees, &mesh);
    std::vector<std::vector<FaceVote>> faces;
    for (size_t f = 0; f < mesh.NumFaces(); ++f) {
      const int x = static_cast<int>(f % 24);  // the crease is between 11 and 12
      if (x == 12 || x == 13) {
        faces.push_back({{kTable, 0.45f}, {kMug, 0.55f}});
      } else {
        faces.push_back({{x < 12 ? kMug : kTable, 0.9f}});
      }
    }
    const std::vector<SurfaceLabel> cut = CutFaceLabels(mesh, VotesOf(faces), 1);
    int mug = 0;
    for (const SurfaceLabel& label : cut) mug += label.id == kMug;
    EXPECT_EQ(mug, 24 * (degrees == 0 ? 14 : 12)) << degrees;
  }
}

// Of two labels the cut is the least of all labellings, tried one by one.
TEST(LabelCut, OfTwoLabelsItIsTheLeast) {
  PolygonMesh mesh;
  AddFoldedGrid(4, 0, &mesh);
  mesh.first_corner.resize(3 * 4 + 1);
  mesh.corners.resize(mesh.first_corner.back());
  std::mt19937 random(7);
  for (int round = 0; round < 20; ++round) {
    std::vector<std::vector<FaceVote>> faces;
    for (int f = 0; f < 12; ++f) {
      const float share = static_cast<float>(random() % 1000) / 1000;
      faces.push_back({{kTable, share}, {kMug, 1 - share}});
    }
    const FaceVotes votes = VotesOf(faces);
    const double smoothness = 0.2;
    const auto cost = [&](uint32_t labelling) {
      double sum = 0;
      for (int f = 0; f < 12; ++f) {
        const int is_mug = static_cast<int>(labelling >> f & 1);
        sum += 1 - faces[f][is_mug].weight;
        if (f % 4 < 3) sum += smoothness * ((labelling >> f & 1) != (labelling >> (f + 1) & 1));
        if (f < 8) sum += smoothness * ((labelling >> f & 1) != (labelling >> (f + 4) & 1));
      }
      return sum;
    };
    double least = std::numeric_limits<double>::max();
    for (uint32_t labelling = 0; labelling < 1u << 12; ++labelling) {
      least = std::min(least, cost(labelling));
    }
    uint32_t found = 0;
    const std::vector<SurfaceLabel> cut = CutFaceLabels(mesh, votes, smoothness);
    for (int f = 0; f < 12; ++f) found |= uint32_t{cut[f].id == kMug} << f;
    EXPECT_NEAR(cost(found), least, 1e-6);
  }
}

// Faces that nothing is known of go with those around them, as far as the next crease.
TEST(LabelCut, FacesWithoutVotesGoWithThoseAround) {
  PolygonMesh mesh;
  AddFoldedGrid(24, 80, &mesh);
  std::vector<std::vector<FaceVote>> faces(mesh.NumFaces());
  for (size_t f = 0; f < mesh.NumFaces(); ++f) {
    if (f % 24 == 3) faces[f] = {{kMug, 0.9f}};
    if (f % 24 == 14) faces[f] = {{kTable, 0.9f}};
  }
  PolygonMesh apart = mesh;
  for (Eigen::Vector3d& x : apart.vertices) x.z() += 9;
  const auto first = static_cast<uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), apart.vertices.begin(), apart.vertices.end());
  AddFace({first, first + 1, first + 2}, &mesh);
  faces.emplace_back();
  for (const double smoothness : {0., 1.}) {
    const std::vector<SurfaceLabel> cut = CutFaceLabels(mesh, VotesOf(faces), smoothness);
    for (size_t f = 0; f + 1 < mesh.NumFaces(); ++f) {
      EXPECT_EQ(cut[f].id, f % 24 < 12 ? kMug : kTable) << f;
      EXPECT_EQ(cut[f].confidence, faces[f].empty() ? 0 : 0.9f);
    }
    EXPECT_EQ(cut.back(), SurfaceLabel());
  }
}

// Triangles that share no vertex, edges of three faces, faces without area, corners or votes,
// corners that are not finite.
TEST(LabelCut, TakesAnyMesh) {
  PolygonMesh whole;
  AddFoldedGrid(12, 0, &whole);
  PolygonMesh mesh;
  for (size_t f = 0; f < whole.NumFaces(); ++f) {
    const auto first = static_cast<uint32_t>(mesh.vertices.size());
    for (const uint32_t corner : whole.Face(f)) mesh.vertices.push_back(whole.vertices[corner]);
    AddFace({first, first + 1, first + 2, first + 3}, &mesh);
  }
  const auto spot = static_cast<size_t>(12 * 6 + 3);
  const uint32_t of_spot = mesh.Face(spot)[0];
  const auto more = static_cast<uint32_t>(mesh.vertices.size());
  mesh.vertices.emplace_back(-2.5, 6, 1);
  mesh.vertices.emplace_back(std::numeric_limits<double>::quiet_NaN(), 0, 0);
  AddFace({of_spot, of_spot + 1, more}, &mesh);      // a third face at an edge
  AddFace({of_spot, of_spot, of_spot}, &mesh);       // no area
  AddFace({}, &mesh);                                // no corners
  AddFace({of_spot, of_spot + 1, more + 1}, &mesh);  // not finite
  std::vector<std::vector<FaceVote>> faces(mesh.NumFaces(), {{kMug, 0.9f}});
  faces[spot] = {{kTable, 0.9f}};
  faces[spot + 1] = {};
  const std::vector<SurfaceLabel> cut = CutFaceLabels(mesh, VotesOf(faces), 1);
  ASSERT_EQ(cut.size(), mesh.NumFaces());
  for (size_t f = 0; f <= whole.NumFaces(); ++f) EXPECT_EQ(cut[f].id, kMug) << f;
  const std::vector<SurfaceLabel> vertices = VertexLabels(mesh, cut);
  EXPECT_EQ(vertices[of_spot].id, kMug);
  EXPECT_EQ(vertices[more].id, kMug);
}

TEST(LabelCut, TheSameOnAnyNumberOfThreads) {
  PolygonMesh mesh;
  AddFoldedGrid(40, 30, &mesh);
  std::mt19937 random(4);
  const FaceVotes votes = VotesOf(mesh, [&](const Eigen::Vector3d&) {
    return LabelId{1 + static_cast<int32_t>(random() % 4)};
  });
  std::vector<std::vector<SurfaceLabel>> labels;
  for (const int threads : {1, 3}) {
    const ThreadLimit limit(threads);
    labels.push_back(CutFaceLabels(mesh, votes, 1.5));
  }
  EXPECT_EQ(labels[0], labels[1]);
}

TEST(LabelCut, VerticesGoWithMostOfTheArea) {
  PolygonMesh mesh;
  mesh.vertices = {{0, 0, 0}, {3, 0, 0}, {0, 3, 0}, {-1, 0, 0}, {9, 9, 9}};
  AddFace({0, 1, 2}, &mesh);
  AddFace({0, 2, 3}, &mesh);
  const std::vector<SurfaceLabel> labels = VertexLabels(mesh, {{kMug, 0.5f}, {kTable, 1}});
  EXPECT_EQ(labels[0], (SurfaceLabel{kMug, 0.5f}));
  EXPECT_EQ(labels[2], (SurfaceLabel{kMug, 0.5f}));
  EXPECT_EQ(labels[3], (SurfaceLabel{kTable, 1}));
  EXPECT_EQ(labels[4], SurfaceLabel());
}

// Places are spread over the whole of a face, each with its share of the area.
TEST(FaceVotes, LargeFacesAreLookedAtEverywhere) {
  PolygonMesh mesh;
  mesh.vertices = {{0, 0, 0}, {10, 0, 0}, {10, 10, 0}, {0, 10, 0}, {0, 0, 1}};
  AddFace({0, 1, 2, 3}, &mesh);
  AddFace({0, 1, 4}, &mesh);
  const auto label = [](const Eigen::Vector3d& normal,
                        std::span<const Eigen::Vector3d> places,
                        std::span<SurfaceLabel> labels,
                        uint32_t*) {
    for (size_t k = 0; k < places.size(); ++k) {
      EXPECT_NEAR(places[k].dot(normal.normalized()), 0, 1e-12);
      const bool is_left = places[k].x() < 3;
      labels[k] = is_left ? SurfaceLabel{kMug, 0.5f} : SurfaceLabel{};
    }
  };
  const FaceVotes votes = CollectFaceVotes(mesh, 0.5, true, label);
  ASSERT_EQ(votes.Of(0).size(), 2u);
  EXPECT_EQ(votes.Of(0)[0].id, kNoObject);
  EXPECT_NEAR(votes.Of(0)[0].weight, 0.25 * 0.7, 0.01);
  EXPECT_EQ(votes.Of(0)[1].id, kMug);
  EXPECT_NEAR(votes.Of(0)[1].weight, 0.5 * 0.3, 0.015);
  // As a triangle's corner is at x = 0, 51 % of it is left of 3.
  EXPECT_NEAR(votes.Of(1)[1].weight, 0.5 * 0.51, 0.05);
  EXPECT_EQ(CollectFaceVotes(mesh, 100, true, label).Of(0).size(), 1u);
}

}  // namespace
}  // namespace semfoam
