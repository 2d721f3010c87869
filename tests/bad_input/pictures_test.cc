// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bad photos and masks.
#include "plugin/mask/mask_png.h"
#include "plugin/mask/masked_photos.h"
#include "plugin/photo/photo.h"
#include "tools/images/image_files.h"

#include <memory>

#include "tests/bad_input/bad_input.h"
#include <OpenImageIO/imageio.h>
#include <unistd.h>
#include <zlib.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// Photos of 8 x 6 pixels, and masks of them.
constexpr PhotoSize kSize = {8, 6};

void WritePictures(const fs::path& folder) {
  std::vector<uint8_t> rgb(3 * 48), grey(48);
  for (size_t i = 0; i < rgb.size(); ++i) rgb[i] = static_cast<uint8_t>(7 * i);
  for (size_t i = 0; i < grey.size(); ++i) grey[i] = i % 3;
  WritePng(folder / "photo.png", 8, 6, 8, PNG_COLOR_TYPE_RGB, rgb);
  WritePng(folder / "mask.png", 8, 6, 8, PNG_COLOR_TYPE_GRAY, grey);
  fs::copy_file(SEMFOAM_TEST_DATA "/tabletop/images/0000.jpg", folder / "photo.jpg");
}

std::string BigEndian(uint32_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 0xff);
  return bytes;
}

std::string Chunk(const std::string& name_and_data) {
  const auto* data = reinterpret_cast<const Bytef*>(name_and_data.data());
  const auto checksum =
      static_cast<uint32_t>(crc32(0, data, static_cast<uInt>(name_and_data.size())));
  return BigEndian(static_cast<uint32_t>(name_and_data.size() - 4)) + name_and_data +
         BigEndian(checksum);
}

// A spoiler: the PNG's header says another size, kind of colour or number of bits, with a right
// checksum.
auto Header(const std::string& file, uint32_t width, uint32_t height, int bits, int color_type) {
  return [=](const fs::path& folder) {
    const std::string header = "IHDR" + BigEndian(width) + BigEndian(height) +
                               static_cast<char>(bits) + static_cast<char>(color_type) +
                               std::string(3, '\0');
    WriteFile(folder / file, ReadFile(folder / file).replace(8, 25, Chunk(header)));
  };
}

// A spoiler: one more chunk after the header.
auto Insert(const std::string& file, const std::string& chunk) {
  return [=](const fs::path& folder) {
    WriteFile(folder / file, ReadFile(folder / file).insert(33, Chunk(chunk)));
  };
}

// A spoiler: a byte, counted from the end where negative, has its bits turned.
auto Flip(const std::string& file, int64_t at) {
  return [=](const fs::path& folder) {
    std::string bytes = ReadFile(folder / file);
    char& byte = bytes[at < 0 ? bytes.size() - static_cast<size_t>(-at) : static_cast<size_t>(at)];
    byte = static_cast<char>(~byte);
    WriteFile(folder / file, bytes);
  };
}

auto WriteOther(const std::string& file,
                const std::string& format,
                OIIO::TypeDesc type,
                int subimages) {
  return [=](const fs::path& folder) {
    const std::string path = (folder / file).string();
    fs::remove(path);
    OIIO::ImageSpec spec(8, 6, 3, type);
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(format);
    ASSERT_NE(output, nullptr) << format;
    const std::vector<float> pixels(3 * 48, 0.5f);
    for (int i = 0; i < subimages; ++i) {
      const auto mode = i == 0 ? OIIO::ImageOutput::Create : OIIO::ImageOutput::AppendSubimage;
      ASSERT_TRUE(output->open(path, spec, mode)) << output->geterror();
      ASSERT_TRUE(output->write_image(OIIO::TypeDesc::FLOAT, pixels.data())) << output->geterror();
    }
    ASSERT_TRUE(output->close());
  };
}

TEST(Pictures, Photos) {
  const std::vector<BadInput> pngs = {
      {"missing",
       Remove("photo.png"),
       "IN/photo.png: there is no such file, where a photo should be."},
      {"a folder", MakeFolder("photo.png"), "IN/photo.png: is a folder, where a photo should be."},
      {"a pipe", MakePipe("photo.png"), "IN/photo.png: is a pipe, where a photo should be."},
      {"a device", MakeDevice("photo.png"), "IN/photo.png: is a device, where a photo should be."},
      {"empty",
       CutTo("photo.png", 0),
       "IN/photo.png: is no readable image (Not a PNG file); a photo, such as a JPEG or PNG, would "
       "be right."},
      {"text",
       Put("photo.png", "no picture at all\n"),
       "IN/photo.png: is no readable image (Not a PNG file); a photo, such as a JPEG or PNG, would "
       "be right."},
      {"signature alone",
       CutTo("photo.png", 8),
       "IN/photo.png: cannot be decoded completely (the PNG has no end); is the copy complete?"},
      {"cut header",
       CutTo("photo.png", 20),
       "IN/photo.png: cannot be decoded completely (the PNG ends within a chunk); is the copy "
       "complete?"},
      {"header alone",
       CutTo("photo.png", 33),
       "IN/photo.png: cannot be decoded completely (the PNG has no end); is the copy complete?"},
      {"cut pixels",
       CutTo("photo.png", 60),
       "IN/photo.png: cannot be decoded completely (the PNG ends within a chunk); is the copy "
       "complete?"},
      {"a checksum",
       Flip("photo.png", -13),
       "IN/photo.png: cannot be decoded completely (a checksum in the PNG is wrong); is the copy "
       "complete?"},
      {"no end",
       [](auto& f) { CutTo("photo.png", fs::file_size(f / "photo.png") - 12)(f); },
       "IN/photo.png: cannot be decoded completely (the PNG has no end); is the copy complete?"},
      {"no width",
       Header("photo.png", 0, 6, 8, 2),
       "IN/photo.png: is no readable image (PNG read error: Invalid IHDR data); a photo, such as a "
       "JPEG or PNG, would be right."},
      {"2^31 - 1 pixels wide",
       Header("photo.png", 0x7fffffff, 0x7fffffff, 8, 2),
       "IN/photo.png: is no readable image (PNG read error: Invalid IHDR data); a photo, such as a "
       "JPEG or PNG, would be right."},
      {"100000 pixels wide",
       Header("photo.png", 100'000, 100'000, 8, 2),
       "IN/photo.png: claims 100000 x 100000 pixels in 101 bytes; is it damaged?"},
      {"16 bits a channel, more than deflate can pack",
       Header("photo.png", 300, 200, 16, 6),
       "IN/photo.png: claims 300 x 200 pixels in 101 bytes; is it damaged?"},
      {"thousands of channels",
       [](const fs::path& folder) {
         fs::remove(folder / "photo.png");
         const OIIO::ImageSpec spec(8, 6, 1000, OIIO::TypeDesc::UINT16);
         const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create("tiff");
         const std::vector<uint16_t> pixels(48 * 1000);
         ASSERT_TRUE(output->open((folder / "photo.png").string(), spec) &&
                     output->write_image(OIIO::TypeDesc::UINT16, pixels.data()) && output->close());
       },
       "IN/photo.png: has 1000 channels, where grey or colours, with or without alpha, would be "
       "right."},
      {"twice as high",
       Header("photo.png", 8, 12, 8, 2),
       "IN/photo.png: cannot be decoded completely (PNG read error: Not enough image data PNG "
       "library error); is the copy complete?"},
      {"animated",
       Insert("photo.png", "acTL" + BigEndian(2) + BigEndian(0)),
       "IN/photo.png: is an animated PNG, where one still picture would be right."},
      {"floating point",
       WriteOther("photo.png", "exr", OIIO::TypeDesc::FLOAT, 1),
       "IN/photo.png: holds floating-point values, where the display values of a photo (8 or 16 "
       "bits, such as a JPEG or PNG) would be right."},
      {"animated GIF",
       WriteOther("photo.png", "gif", OIIO::TypeDesc::UINT8, 2),
       "IN/photo.png: is an animation, where one still picture would be right."},
  };
  ExpectSentences(pngs, WritePictures, [](const fs::path& f) { ReadPhoto(f / "photo.png"); });
  const std::vector<BadInput> jpegs = {
      {"empty",
       CutTo("photo.jpg", 0),
       "IN/photo.jpg: is no readable image (Empty file \"IN/photo.jpg\"); a photo, such as a JPEG "
       "or PNG, would be right."},
      {"two bytes",
       CutTo("photo.jpg", 2),
       "IN/photo.jpg: is no readable image (JPEG error: Premature end of JPEG file "
       "(\"IN/photo.jpg\") Bad JPEG header for \"IN/photo.jpg\"); a photo, such as a JPEG or PNG, "
       "would be right."},
      {"a half",
       CutTo("photo.jpg", 5000),
       "IN/photo.jpg: cannot be decoded completely (JPEG error: Premature end of JPEG file "
       "(\"IN/photo.jpg\")); is the copy complete?"},
      {"a hole",
       [](auto& f) {
         std::string bytes = ReadFile(f / "photo.jpg");
         bytes.replace(bytes.size() / 2, 64, std::string(64, '\xff'));
         WriteFile(f / "photo.jpg", bytes);
       },
       "IN/photo.jpg: cannot be decoded completely (JPEG error: Corrupt JPEG data: premature end "
       "of data segment (\"IN/photo.jpg\")); is the copy complete?"},
      {"no end",
       [](auto& f) { CutTo("photo.jpg", fs::file_size(f / "photo.jpg") - 2)(f); },
       "IN/photo.jpg: cannot be decoded completely (JPEG error: Premature end of JPEG file "
       "(\"IN/photo.jpg\")); is the copy complete?"},
  };
  ExpectSentences(jpegs, WritePictures, [](const fs::path& f) { ReadPhoto(f / "photo.jpg"); });
}

TEST(Pictures, Masks) {
  const std::vector<BadInput> cases = {
      {"missing",
       Remove("mask.png"),
       "IN/mask.png: there is no such file, where a mask should be."},
      {"a folder", MakeFolder("mask.png"), "IN/mask.png: is a folder, where a mask should be."},
      {"a pipe", MakePipe("mask.png"), "IN/mask.png: is a pipe, where a mask should be."},
      {"a device", MakeDevice("mask.png"), "IN/mask.png: is a device, where a mask should be."},
      {"empty",
       CutTo("mask.png", 0),
       "IN/mask.png: is no PNG file, where a mask of object ids should be."},
      {"a JPEG",
       [](auto& f) { fs::rename(f / "photo.jpg", f / "mask.png"); },
       "IN/mask.png: is no PNG file, where a mask of object ids should be."},
      {"signature alone",
       CutTo("mask.png", 8),
       "IN/mask.png: the mask cannot be decoded completely (Read Error); is the copy complete?"},
      {"cut pixels",
       CutTo("mask.png", 50),
       "IN/mask.png: cannot be decoded completely (the PNG ends within a chunk); is the copy "
       "complete?"},
      {"a checksum",
       Flip("mask.png", -13),
       "IN/mask.png: cannot be decoded completely (a checksum in the PNG is wrong); is the copy "
       "complete?"},
      {"two headers",
       Insert("mask.png", "IHDR" + std::string(13, '\1')),
       "IN/mask.png: the mask cannot be decoded completely (IHDR: out of place); is the copy "
       "complete?"},
      {"an unknown chunk that is needed",
       Insert("mask.png", "NEED"),
       "IN/mask.png: the mask cannot be decoded completely (NEED: unhandled critical chunk); is "
       "the copy complete?"},
      {"no height",
       Header("mask.png", 8, 0, 8, 0),
       "IN/mask.png: the mask cannot be decoded completely (Image height is zero in IHDR); is the "
       "copy complete?"},
      {"3 bits",
       Header("mask.png", 8, 6, 3, 0),
       "IN/mask.png: the mask cannot be decoded completely (Invalid bit depth in IHDR); is the "
       "copy complete?"},
      {"unknown kind of colour",
       Header("mask.png", 8, 6, 8, 5),
       "IN/mask.png: the mask cannot be decoded completely (Invalid color type in IHDR); is the "
       "copy complete?"},
      {"a palette that is missing",
       Header("mask.png", 8, 6, 8, 3),
       "IN/mask.png: the mask cannot be decoded completely (IDAT: Missing PLTE before IDAT); is "
       "the copy complete?"},
      {"16-bit colours",
       Header("mask.png", 8, 6, 16, 2),
       "IN/mask.png: holds 16-bit colours, where grey values, palette indices or DEVA's 8-bit RGB "
       "ids would be right."},
      {"16-bit colours and alpha",
       Header("mask.png", 8, 6, 16, 6),
       "IN/mask.png: holds 16-bit colours, where grey values, palette indices or DEVA's 8-bit RGB "
       "ids would be right."},
      {"a million pixels wide",
       Header("mask.png", 1'000'000, 1'000'000, 1, 0),
       "IN/mask.png: claims 1000000 x 1000000 pixels in 86 bytes; is it damaged?"},
      {"more pixels than there are",
       Header("mask.png", 8, 9, 8, 0),
       "IN/mask.png: the mask cannot be decoded completely (Not enough image data); is the copy "
       "complete?"},
      {"fewer pixels than there are",
       Header("mask.png", 8, 3, 8, 0),
       "IN/mask.png: the mask cannot be decoded completely (IDAT: Too much image data); is the "
       "copy complete?"},
      {"animated",
       Insert("mask.png", "acTL" + BigEndian(2) + BigEndian(0)),
       "IN/mask.png: is an animated PNG, where one still picture would be right."},
      {"of another aspect",
       [](auto& f) {
         WritePng(f / "mask.png", 6, 8, 8, PNG_COLOR_TYPE_GRAY, std::vector<uint8_t>(48, 1));
       },
       "IN/mask.png: is 6 x 8 pixels and its photo 8 x 6; a mask of the photo's aspect would be "
       "right, made of the undistorted photo if COLMAP undistorted it."},
      {"colours that are no ids",
       [](auto& f) {
         std::vector<uint8_t> rgb(3 * 48, 9);
         rgb[0] = 5;
         WritePng(f / "mask.png", 8, 6, 8, PNG_COLOR_TYPE_RGB, rgb);
         WriteFile(f / "pred.json", R"({"annotations": [{"segments_info": [{"id": 592137}]}]})");
       },
       "IN/mask.png: has 1 colour that is no id in pred.json; a mask as DEVA wrote it, not "
       "resampled or recompressed, would be right."},
  };
  ExpectSentences(cases, WritePictures, [](const fs::path& f) {
    PhotoRecord photo;
    photo.width = kSize.width;
    photo.height = kSize.height;
    LoadMaskedPhotos(
        nullptr, {photo}, {{f / "mask.png"}, {}}, f, LabelZero::kIgnore, MaskConsistency::kAuto);
  });
  const std::vector<BadInput> folders = {
      {"no folder",
       [](auto&) {},
       "IN/masks: there is no such folder; it should hold a PNG mask for each photo."},
      {"a file",
       Put("masks", "no folder"),
       "IN/masks: there is no such folder; it should hold a PNG mask for each photo."},
      {"none of a photo",
       [](auto& f) {
         fs::create_directory(f / "masks");
         fs::rename(f / "mask.png", f / "masks/other.png");
       },
       "IN/masks: none of the 1 masks has the name of a photo; a.png would be right for a.jpg."},
      {"one of two photos",
       [](auto& f) {
         fs::create_directory(f / "masks");
         fs::rename(f / "mask.png", f / "masks/a.png");
       },
       "IN/masks/a.png: is by its name the mask of both a.jpg and a.png; masks named like "
       "a.png.png would be right."},
  };
  ExpectSentences(folders, WritePictures, [](const fs::path& f) {
    PairMasks(f / "masks", {"a.jpg", "a.png"});
  });
}

// A mask for scoring (foam_evaluator --truth_path).
TEST(Pictures, ForegroundMasks) {
  const std::vector<BadInput> cases = {
      {"100000 pixels wide",
       Header("mask.png", 100'000, 100'000, 8, 0),
       "IN/mask.png: claims 100000 x 100000 pixels in 86 bytes; is it damaged?"},
  };
  ExpectSentences(cases, WritePictures, [](const fs::path& f) { ReadForeground(f / "mask.png"); });
}

TEST(Pictures, PicturesThatTheMemoryCannotHold) {
  const fs::path file = "a/b.png";
  const PhotoSize size = {100'000, 75'000};
  EXPECT_EQ(UserErrorOf([&] { RequireDecodingMemory(file, size, 30'000'000'000, 30'000'000'000); }),
            "");
  EXPECT_EQ(UserErrorOf([&] { RequireDecodingMemory(file, size, 30'000'000'000, 29'999'999'999); }),
            "a/b.png: is 100000 x 75000 pixels, which take 30.00 GB of memory to decode, and 30.00 "
            "GB are available; a smaller picture would be right.");
}

TEST(Pictures, NoPermission) {
  const TempFolder temp;
  WritePictures(temp.path());
  for (const char* file : {"mask.png", "photo.jpg"}) {
    fs::permissions(temp / file, fs::perms::none);
  }
  fs::permissions(temp.path(), fs::perms::all);
  // Root may read everything.
  const bool was_root = ::geteuid() == 0;
  if (was_root) {
    ASSERT_EQ(::seteuid(65534), 0);
  }
  const std::string photo = UserErrorOf([&] { ReadPhoto(temp / "photo.jpg"); });
  const std::string mask = UserErrorOf([&] { ReadMaskPng(temp / "mask.png"); });
  if (was_root) {
    ASSERT_EQ(::seteuid(0), 0);
  }
  const std::string folder = temp.path().string();
  const std::string denied = "cannot be read (Permission denied), where a ";
  EXPECT_EQ(photo, folder + "/photo.jpg: " + denied + "photo should be; may you read it?");
  EXPECT_EQ(mask, folder + "/mask.png: " + denied + "mask should be; may you read it?");
}

}  // namespace
}  // namespace semfoam
