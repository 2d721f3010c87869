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
      {"missing", Remove("photo.png"), {"IN/photo.png", {}, "no such file"}},
      {"a folder", MakeFolder("photo.png"), {"IN/photo.png", {}, "is a folder"}},
      {"a pipe", MakePipe("photo.png"), {"IN/photo.png", {}, "is a pipe"}},
      {"a device", MakeDevice("photo.png"), {"IN/photo.png", {}, "is a device"}},
      {"empty", CutTo("photo.png", 0), {"IN/photo.png", {"Not a PNG file"}, "no readable image"}},
      {"text",
       Put("photo.png", "no picture at all\n"),
       {"IN/photo.png", {"Not a PNG file"}, "no readable image"}},
      {"signature alone", CutTo("photo.png", 8), {"IN/photo.png", {}, "PNG has no end"}},
      {"cut header", CutTo("photo.png", 20), {"IN/photo.png", {}, "PNG ends within a chunk"}},
      {"header alone", CutTo("photo.png", 33), {"IN/photo.png", {}, "PNG has no end"}},
      {"cut pixels", CutTo("photo.png", 60), {"IN/photo.png", {}, "PNG ends within a chunk"}},
      {"a checksum", Flip("photo.png", -13), {"IN/photo.png", {"PNG"}, "checksum"}},
      {"no end",
       [](auto& f) { CutTo("photo.png", fs::file_size(f / "photo.png") - 12)(f); },
       {"IN/photo.png", {}, "PNG has no end"}},
      {"no width",
       Header("photo.png", 0, 6, 8, 2),
       {"IN/photo.png", {"PNG read error: Invalid IHDR data"}, "no readable image"}},
      {"2^31 - 1 pixels wide",
       Header("photo.png", 0x7fffffff, 0x7fffffff, 8, 2),
       {"IN/photo.png", {"PNG read error: Invalid IHDR data"}, "no readable image"}},
      {"100000 pixels wide",
       Header("photo.png", 100'000, 100'000, 8, 2),
       {"IN/photo.png", {"100000 x 100000 pixels", "101 bytes"}, "claims"}},
      {"16 bits a channel, more than deflate can pack",
       Header("photo.png", 300, 200, 16, 6),
       {"IN/photo.png", {"300 x 200 pixels", "101 bytes"}, "claims"}},
      {"thousands of channels",
       [](const fs::path& folder) {
         fs::remove(folder / "photo.png");
         const OIIO::ImageSpec spec(8, 6, 1000, OIIO::TypeDesc::UINT16);
         const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create("tiff");
         const std::vector<uint16_t> pixels(48 * 1000);
         ASSERT_TRUE(output->open((folder / "photo.png").string(), spec) &&
                     output->write_image(OIIO::TypeDesc::UINT16, pixels.data()) && output->close());
       },
       {"IN/photo.png", {}, "1000 channels"}},
      {"twice as high",
       Header("photo.png", 8, 12, 8, 2),
       {"IN/photo.png", {"Not enough image data"}, "cannot be decoded"}},
      {"animated",
       Insert("photo.png", "acTL" + BigEndian(2) + BigEndian(0)),
       {"IN/photo.png", {}, "animated PNG"}},
      {"floating point",
       WriteOther("photo.png", "exr", OIIO::TypeDesc::FLOAT, 1),
       {"IN/photo.png", {}, "floating-point values"}},
      {"animated GIF",
       WriteOther("photo.png", "gif", OIIO::TypeDesc::UINT8, 2),
       {"IN/photo.png", {}, "is an animation"}},
  };
  ExpectMistakes(pngs, WritePictures, [](const fs::path& f) { ReadPhoto(f / "photo.png"); });
  const std::vector<BadInput> jpegs = {
      {"empty", CutTo("photo.jpg", 0), {"IN/photo.jpg", {"Empty file"}, "no readable image"}},
      {"two bytes",
       CutTo("photo.jpg", 2),
       {"IN/photo.jpg", {"Premature end"}, "no readable image"}},
      {"a half",
       CutTo("photo.jpg", 5000),
       {"IN/photo.jpg", {"Premature end of JPEG file"}, "cannot be decoded"}},
      {"a hole",
       [](auto& f) {
         std::string bytes = ReadFile(f / "photo.jpg");
         bytes.replace(bytes.size() / 2, 64, std::string(64, '\xff'));
         WriteFile(f / "photo.jpg", bytes);
       },
       {"IN/photo.jpg", {"Corrupt JPEG data"}, "cannot be decoded"}},
      {"no end",
       [](auto& f) { CutTo("photo.jpg", fs::file_size(f / "photo.jpg") - 2)(f); },
       {"IN/photo.jpg", {"Premature end of JPEG file"}, "cannot be decoded"}},
  };
  ExpectMistakes(jpegs, WritePictures, [](const fs::path& f) { ReadPhoto(f / "photo.jpg"); });
}

TEST(Pictures, Masks) {
  const std::vector<BadInput> cases = {
      {"missing", Remove("mask.png"), {"IN/mask.png", {}, "no such file"}},
      {"a folder", MakeFolder("mask.png"), {"IN/mask.png", {}, "is a folder"}},
      {"a pipe", MakePipe("mask.png"), {"IN/mask.png", {}, "is a pipe"}},
      {"a device", MakeDevice("mask.png"), {"IN/mask.png", {}, "is a device"}},
      {"empty", CutTo("mask.png", 0), {"IN/mask.png", {}, "is no PNG"}},
      {"a JPEG",
       [](auto& f) { fs::rename(f / "photo.jpg", f / "mask.png"); },
       {"IN/mask.png", {}, "is no PNG"}},
      {"signature alone",
       CutTo("mask.png", 8),
       {"IN/mask.png", {"Read Error"}, "cannot be decoded"}},
      {"cut pixels", CutTo("mask.png", 50), {"IN/mask.png", {}, "PNG ends within a chunk"}},
      {"a checksum", Flip("mask.png", -13), {"IN/mask.png", {"PNG"}, "checksum"}},
      {"two headers",
       Insert("mask.png", "IHDR" + std::string(13, '\1')),
       {"IN/mask.png", {"IHDR: out of place"}, "cannot be decoded"}},
      {"an unknown chunk that is needed",
       Insert("mask.png", "NEED"),
       {"IN/mask.png", {"NEED: unhandled critical chunk"}, "cannot be decoded"}},
      {"no height",
       Header("mask.png", 8, 0, 8, 0),
       {"IN/mask.png", {"Image height is zero in IHDR"}, "cannot be decoded"}},
      {"3 bits",
       Header("mask.png", 8, 6, 3, 0),
       {"IN/mask.png", {"Invalid bit depth in IHDR"}, "cannot be decoded"}},
      {"unknown kind of colour",
       Header("mask.png", 8, 6, 8, 5),
       {"IN/mask.png", {"Invalid color type in IHDR"}, "cannot be decoded"}},
      {"a palette that is missing",
       Header("mask.png", 8, 6, 8, 3),
       {"IN/mask.png", {"IDAT: Missing PLTE before IDAT"}, "cannot be decoded"}},
      {"16-bit colours", Header("mask.png", 8, 6, 16, 2), {"IN/mask.png", {}, "16-bit colours"}},
      {"16-bit colours and alpha",
       Header("mask.png", 8, 6, 16, 6),
       {"IN/mask.png", {}, "16-bit colours"}},
      {"a million pixels wide",
       Header("mask.png", 1'000'000, 1'000'000, 1, 0),
       {"IN/mask.png", {"1000000 x 1000000 pixels", "86 bytes"}, "claims"}},
      {"more pixels than there are",
       Header("mask.png", 8, 9, 8, 0),
       {"IN/mask.png", {"Not enough image data"}, "cannot be decoded"}},
      {"fewer pixels than there are",
       Header("mask.png", 8, 3, 8, 0),
       {"IN/mask.png", {"IDAT: Too much image data"}, "cannot be decoded"}},
      {"animated",
       Insert("mask.png", "acTL" + BigEndian(2) + BigEndian(0)),
       {"IN/mask.png", {}, "animated PNG"}},
      {"of another aspect",
       [](auto& f) {
         WritePng(f / "mask.png", 6, 8, 8, PNG_COLOR_TYPE_GRAY, std::vector<uint8_t>(48, 1));
       },
       {"IN/mask.png", {"6 x 8", "8 x 6"}, "aspect"}},
      {"colours that are no ids",
       [](auto& f) {
         std::vector<uint8_t> rgb(3 * 48, 9);
         rgb[0] = 5;
         WritePng(f / "mask.png", 8, 6, 8, PNG_COLOR_TYPE_RGB, rgb);
         WriteFile(f / "pred.json", R"({"annotations": [{"segments_info": [{"id": 592137}]}]})");
       },
       {"IN/mask.png", {"1 colour", "pred.json"}, "is no id"}},
  };
  ExpectMistakes(cases, WritePictures, [](const fs::path& f) {
    PhotoRecord photo;
    photo.width = kSize.width;
    photo.height = kSize.height;
    LoadMaskedPhotos(
        nullptr, {photo}, {{f / "mask.png"}, {}}, f, LabelZero::kIgnore, MaskConsistency::kAuto);
  });
  const std::vector<BadInput> folders = {
      {"no folder", [](auto&) {}, {"IN/masks", {}, "no such folder"}},
      {"a file", Put("masks", "no folder"), {"IN/masks", {}, "no such folder"}},
      {"none of a photo",
       [](auto& f) {
         fs::create_directory(f / "masks");
         fs::rename(f / "mask.png", f / "masks/other.png");
       },
       {"IN/masks", {"a.png", "a.jpg"}, "none of the 1 masks"}},
      {"one of two photos",
       [](auto& f) {
         fs::create_directory(f / "masks");
         fs::rename(f / "mask.png", f / "masks/a.png");
       },
       {"IN/masks/a.png", {"a.jpg", "a.png"}, "the mask of both"}},
  };
  ExpectMistakes(folders, WritePictures, [](const fs::path& f) {
    PairMasks(f / "masks", {"a.jpg", "a.png"});
  });
}

// A mask for scoring (foam_evaluator --truth_path).
TEST(Pictures, ForegroundMasks) {
  const std::vector<BadInput> cases = {
      {"100000 pixels wide",
       Header("mask.png", 100'000, 100'000, 8, 0),
       {"IN/mask.png", {"100000 x 100000 pixels", "86 bytes"}, "claims"}},
  };
  ExpectMistakes(cases, WritePictures, [](const fs::path& f) { ReadForeground(f / "mask.png"); });
}

TEST(Pictures, PicturesThatTheMemoryCannotHold) {
  const fs::path file = "a/b.png";
  const PhotoSize size = {100'000, 75'000};
  EXPECT_EQ(UserErrorOf([&] { RequireDecodingMemory(file, size, 30'000'000'000, 30'000'000'000); }),
            "");
  EXPECT_THAT(
      UserErrorOf([&] { RequireDecodingMemory(file, size, 30'000'000'000, 29'999'999'999); }),
      NamesMistake("a/b.png", {"100000 x 75000 pixels", "30.00 GB"}, "of memory to decode"));
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
  const std::vector<std::string> reason = {"Permission denied"};
  EXPECT_THAT(photo, NamesMistake(folder + "/photo.jpg", reason, "cannot be read"));
  EXPECT_THAT(mask, NamesMistake(folder + "/mask.png", reason, "cannot be read"));
}

}  // namespace
}  // namespace semfoam
