// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/image/metrics.h"

#include "foam/util/parallel.h"

#include <array>
#include <cmath>
#include <limits>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr int kRadius = 5;
constexpr int kWindow = 2 * kRadius + 1;
constexpr double kSigma = 1.5;

using Plane = std::vector<double>;  // [height][width]

std::array<double, kWindow> GaussianWindow() {
  std::array<double, kWindow> window;
  double sum = 0;
  for (int i = 0; i < kWindow; ++i) {
    const double x = (i - kRadius) / kSigma;
    sum += window[i] = std::exp(-0.5 * x * x);
  }
  for (double& w : window) w /= sum;
  return window;
}

// 0 1 2 | 2 1 0: the border pixel is repeated. Images narrower than the window are mirrored again
// and again.
int Mirror(int i, int size) {
  while (i < 0 || i >= size) i = i < 0 ? -1 - i : 2 * size - 1 - i;
  return i;
}

Plane Blur(const Plane& in, int width, int height) {
  static const std::array<double, kWindow> window = GaussianWindow();
  Plane rows(in.size()), out(in.size());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      for (int k = 0; k < kWindow; ++k) {
        sum += window[k] * in[size_t(y) * width + Mirror(x + k - kRadius, width)];
      }
      rows[size_t(y) * width + x] = sum;
    }
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      for (int k = 0; k < kWindow; ++k) {
        sum += window[k] * rows[size_t(Mirror(y + k - kRadius, height)) * width + x];
      }
      out[size_t(y) * width + x] = sum;
    }
  }
  return out;
}

Plane Product(const Plane& a, const Plane& b) {
  Plane out(a.size());
  for (size_t i = 0; i < a.size(); ++i) out[i] = a[i] * b[i];
  return out;
}

double ChannelSsim(const Image8& render, const Image8& photo, int channel) {
  const int width = render.width, height = render.height;
  Plane a(size_t(width) * height), b(a.size());
  for (size_t i = 0; i < a.size(); ++i) {
    a[i] = render.data[3 * i + channel] / 255.0;
    b[i] = photo.data[3 * i + channel] / 255.0;
  }
  const Plane mean_a = Blur(a, width, height), mean_b = Blur(b, width, height);
  const Plane square_a = Blur(Product(a, a), width, height);
  const Plane square_b = Blur(Product(b, b), width, height);
  const Plane product = Blur(Product(a, b), width, height);
  constexpr double kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03;
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    const double ma = mean_a[i], mb = mean_b[i];
    const double va = square_a[i] - ma * ma, vb = square_b[i] - mb * mb;
    const double cov = product[i] - ma * mb;
    sum += (2 * ma * mb + kC1) * (2 * cov + kC2) / ((ma * ma + mb * mb + kC1) * (va + vb + kC2));
  }
  return sum / a.size();
}

void CheckSameSize(const Image8& a, const Image8& b) {
  CHECK_EQ(a.width, b.width);
  CHECK_EQ(a.height, b.height);
  CHECK_EQ(a.data.size(), size_t(3) * a.width * a.height);
  CHECK_EQ(b.data.size(), a.data.size());
  CHECK(!a.data.empty());
}

}  // namespace

double Psnr(const Image8& render, const Image8& photo) {
  CheckSameSize(render, photo);
  double sum = 0;
  for (size_t i = 0; i < render.data.size(); ++i) {
    const double difference = double(render.data[i]) - photo.data[i];
    sum += difference * difference;
  }
  if (sum == 0) return std::numeric_limits<double>::infinity();
  return -10 * std::log10(sum / render.data.size() / (255.0 * 255.0));
}

double Ssim(const Image8& render, const Image8& photo) {
  CheckSameSize(render, photo);
  std::array<double, 3> channel{};
  ParallelForBlocks(3, 1, [&](int64_t c, int64_t) { channel[c] = ChannelSsim(render, photo, c); });
  return (channel[0] + channel[1] + channel[2]) / 3;
}

LabelAgreement::Pixels& LabelAgreement::Of(ClassIndex class_index) {
  const size_t c = Value(class_index);
  if (c >= of_class_.size()) of_class_.resize(c + 1);
  return of_class_[c];
}

void LabelAgreement::Add(ClassIndex truth, ClassIndex shown) {
  if (truth == kUnlabelled) return;
  ++Of(truth).truth;
  if (shown == kUnlabelled) return;
  ++Of(shown).shown;
  if (shown == truth) ++Of(truth).both;
}

double LabelAgreement::MeanIou() const {
  double sum = 0;
  int count = 0;
  for (const Pixels& pixels : of_class_) {
    if (pixels.truth == 0) continue;
    sum += static_cast<double>(pixels.both) /
           static_cast<double>(pixels.truth + pixels.shown - pixels.both);
    ++count;
  }
  return count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace semfoam
