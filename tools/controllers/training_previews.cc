// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/training_previews.h"

#include "foam/util/elapsed_time.h"
#include "foam/util/error.h"
#include "foam/util/output_file.h"
#include "foam/view/view_renderer.h"
#include "tools/images/image_files.h"
#include "tools/images/view_images.h"
#include "tools/support/progress.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <system_error>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr char kPage[] = "index.html";
// How a page of ours begins.
constexpr char kPageMark[] = "<!DOCTYPE html>\n<!-- Previews of a training by semfoam -->\n";

std::string PictureName(int64_t iteration) {
  char name[32];
  std::snprintf(name, sizeof(name), "%06lld.png", static_cast<long long>(iteration));
  return name;
}

// Returns the iterations of the pictures in the folder that previews have written.
std::set<int64_t> Pictures(const fs::path& folder) {
  std::set<int64_t> pictures;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    const std::string stem = entry.path().stem().string();
    int64_t iteration = 0;
    const auto [end, problem] = std::from_chars(stem.data(), stem.data() + stem.size(), iteration);
    if (problem != std::errc() || PictureName(iteration) != entry.path().filename()) continue;
    if (IsOwnImage(entry.path())) pictures.insert(iteration);
  }
  return pictures;
}

int FirstHeldOut(const TrainingScene& scene) {
  for (int view = 0; view < scene.NumViews(); ++view) {
    if (scene.IsHeldOut(view)) return view;
  }
  return 0;
}

// Returns the colours of these pixels of one view.
Image8 PhotoAt(const TrainingScene& scene, const std::vector<ViewPixel>& pixels, int width) {
  Image8 image{width, static_cast<int>(pixels.size()) / width, {}};
  image.data.reserve(3 * pixels.size());
  const int view = pixels.front().view;
  if (scene.HoldsPhoto(view)) {
    const Image8& photo = scene.Photo(view);
    for (const ViewPixel& pixel : pixels) {
      const uint8_t* color = &photo.data[3 * (size_t{1} * pixel.y * photo.width + pixel.x)];
      image.data.insert(image.data.end(), color, color + 3);
    }
  } else {
    const std::unique_ptr<ViewPixels> photo = scene.OpenView(view);
    for (const ViewPixel& pixel : pixels) {
      const PixelValue value = photo->At(pixel.x, pixel.y);
      image.data.insert(image.data.end(), std::begin(value.color), std::end(value.color));
    }
  }
  return image;
}

// Returns the page, with `text` above the newest picture. `reload_after`: seconds; 0: never.
std::string Page(const std::string& text,
                 double reload_after,
                 bool has_labels,
                 const std::set<int64_t>& pictures) {
  std::string page = kPageMark;
  page += "<html lang=\"en\">\n<meta charset=\"utf-8\">\n";
  if (reload_after > 0) {
    // Browsers take whole seconds.
    page += "<meta http-equiv=\"refresh\" content=\"" +
            std::to_string(std::max(1L, std::lround(reload_after))) + "\">\n";
  }
  page +=
      "<title>Training</title>\n"
      "<style>body { font: 16px sans-serif; margin: 1em; }\n"
      "img { width: 100%; max-width: 1440px; image-rendering: pixelated; }</style>\n<p>" +
      text + "</p>\n";
  const int64_t newest = *pictures.rbegin();
  page += "<img src=\"" + PictureName(newest) + "\" alt=\"iteration " + std::to_string(newest) +
          "\">\n<p>The photo, the foam" + (has_labels ? ", its labels" : "") + ". Iterations:\n";
  for (const int64_t iteration : pictures) {
    page += "<a href=\"" + PictureName(iteration) + "\">" + std::to_string(iteration) + "</a>\n";
  }
  return page + "</p>\n</html>\n";
}

// A training goes on without previews.
template <typename Work>
void TryTo(const Work& write) {
  try {
    write();
  } catch (const UserError& error) {
    LOG(WARNING) << "No preview: " << error.what();
  }
}

}  // namespace

void RequireReplaceablePreviews(const fs::path& folder) {
  const fs::path page = folder / kPage;
  std::ifstream file(page, std::ios::binary);
  if (!file) return;
  std::string begin(std::size(kPageMark) - 1, '\0');
  file.read(begin.data(), std::ssize(begin));
  if (file && begin == kPageMark) return;
  throw UserError(page.string(),
                  ": was not written by a training and would be lost; give another ",
                  Field{"output_path"},
                  ".");
}

TrainingPreviews::TrainingPreviews(const TrainingScene& scene,
                                   const fs::path& folder,
                                   double every,
                                   bool resumes)
    : scene_(scene),
      folder_(folder),
      every_(every),
      view_(FirstHeldOut(scene)),
      last_(std::chrono::steady_clock::now()) {
  RequireWritableFolder(folder);
  pictures_ = Pictures(folder);
  if (!resumes) RemovePictures(0);
  const int full_width = scene.Width(view_), full_height = scene.Height(view_);
  const double share = std::min(1.0, double{kPreviewSize} / std::max(full_width, full_height));
  width_ = std::max(1, static_cast<int>(share * full_width));
  height_ = std::max(1, static_cast<int>(share * full_height));
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      pixels_.push_back({view_,
                         static_cast<int>(int64_t{x} * full_width / width_),
                         static_cast<int>(int64_t{y} * full_height / height_)});
    }
  }
  photo_ = PhotoAt(scene, pixels_, width_);
  LOG(INFO) << "Previews of " << scene.Photos()[view_].name << ": " << (folder / kPage).string();
}

void TrainingPreviews::Report(const TrainingProgress& progress) {
  progress_ = progress;
  // The last report comes after the last picture.
  if (is_done_ && !pictures_.empty()) TryTo([this] { WritePage(); });
}

void TrainingPreviews::Update(int64_t iteration,
                              bool is_last,
                              const TrainingHooks::RenderPixels& render) {
  if (is_first_) RemovePictures(iteration);
  is_first_ = false;
  if (!is_last && SecondsSince(last_) < every_) return;
  is_done_ = is_last;
  TryTo([&] {
    WriteRgbPng(folder_ / PictureName(iteration), Draw(render));
    pictures_.insert(iteration);
    WritePage();
  });
  // The time to draw it is none between previews.
  last_ = std::chrono::steady_clock::now();
}

Image8 TrainingPreviews::Draw(const TrainingHooks::RenderPixels& render) const {
  const std::vector<RenderedRay> rays = render(pixels_);
  RenderedView view{width_, height_, {}, {}, {}, {}, {}};
  for (const RenderedRay& ray : rays) {
    // Nothing: the white background, also where the camera has no ray.
    view.color.push_back(ray.opacity > 0 ? ray.color : Eigen::Vector3f::Ones().eval());
    view.class_index.push_back(ray.class_index < 0 ? kUnlabelled : ClassIndex{ray.class_index});
  }
  std::vector<Image8> images = {photo_, ColorImage(view)};
  if (scene_.NumClasses() > 0) images.push_back(PaletteImage(LabelIdImage(view, scene_.Labels())));
  return SideBySide(images);
}

void TrainingPreviews::WritePage() const {
  TrainingProgress progress = progress_;
  progress.iteration = *pictures_.rbegin();
  const std::string text = progress.num_iterations == 0
                               ? "iteration " + std::to_string(progress.iteration)
                               : FormatProgress(progress, /*rays_per_second=*/NAN);
  WriteTextFile(folder_ / kPage,
                Page(is_done_ ? "Trained: " + text : text,
                     is_done_ ? 0 : every_,
                     scene_.NumClasses() > 0,
                     pictures_));
}

void TrainingPreviews::RemovePictures(int64_t first_iteration) {
  std::error_code ignored;
  const auto first = pictures_.lower_bound(first_iteration);
  for (auto it = first; it != pictures_.end(); ++it)
    fs::remove(folder_ / PictureName(*it), ignored);
  pictures_.erase(first, pictures_.end());
}

}  // namespace semfoam
