// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bad COLMAP models as text.
#include "plugin/colmap/colmap_model.h"

#include "tests/bad_input/bad_input.h"

namespace semfoam {
namespace {

namespace fs = std::filesystem;

void WriteTextModel(const fs::path& folder) {
  WriteFile(folder / "cameras.txt", "# cameras\n1 PINHOLE 640 480 500 500 320 240\n");
  WriteFile(folder / "images.txt",
            "1 1 0 0 0 0 0 0 1 a.jpg\n10.5 20.5 7 30 40 -1\n2 1 0 0 0 1 0 0 1 b.jpg\n11 21 7\n");
  WriteFile(folder / "points3D.txt", "7 0.5 0.5 4 255 128 0 0.8 1 0 2 0\n");
  WriteFile(folder / "rigs.txt", "3 2 CAMERA 1 CAMERA 2 1 1 0 0 0 0.5 0 0\n");
  WriteFile(folder / "frames.txt",
            "5 3 1 0 0 0 0 0 0 1 CAMERA 1 1\n6 3 1 0 0 0 1 0 0 1 CAMERA 1 2\n");
}

TEST(ColmapText, ColmapText) {
  const auto cameras = [](const std::string& text) { return Put("cameras.txt", text); };
  const auto images = [](const std::string& text) { return Put("images.txt", text); };
  const auto points = [](const std::string& text) { return Put("points3D.txt", text); };
  const auto rigs = [](const std::string& text) { return Put("rigs.txt", text); };
  const auto frames = [](const std::string& text) { return Put("frames.txt", text); };
  const std::vector<BadInput> cases = {
      {"no points", Remove("points3D.txt"), {"IN/points3D.txt", {}, "is missing"}},
      {"images are a folder", MakeFolder("images.txt"), {"IN/images.txt", {}, "is a folder"}},
      {"cameras are a pipe", MakePipe("cameras.txt"), {"IN/cameras.txt", {}, "is a pipe"}},
      {"rigs are a device", MakeDevice("rigs.txt"), {"IN/rigs.txt", {}, "is a device"}},
      // Files without a record are valid by themselves; the images then lack their camera.
      {"empty cameras",
       cameras(""),
       {"IN/images.txt", {"image 1", "a.jpg", "camera 1", "cameras.txt"}, "does not have"}},
      {"comments alone",
       cameras("# nothing\n#\n"),
       {"IN/images.txt", {"image 1", "a.jpg", "camera 1", "cameras.txt"}, "does not have"}},
      {"points without images",
       images("# none\n"),
       {"IN/points3D.txt", {"point 7", "image 1", "images.txt"}, "does not have"}},
      // Cameras
      {"camera id alone", cameras("1\n"), {"IN/cameras.txt", {"line 1", "MODEL"}, "ends before"}},
      {"camera without size",
       cameras("1 PINHOLE\n"),
       {"IN/cameras.txt", {"line 1", "WIDTH"}, "ends before"}},
      {"camera without height",
       cameras("1 PINHOLE 640\n"),
       {"IN/cameras.txt", {"line 1", "HEIGHT"}, "ends before"}},
      {"no number for id",
       cameras("one PINHOLE 640 480 500 500 320 240\n"),
       {"IN/cameras.txt", {"line 1", "CAMERA_ID", "\"one\""}, "whole number"}},
      {"negative camera id",
       cameras("-1 PINHOLE 640 480 500 500 320 240\n"),
       {"IN/cameras.txt", {"line 1", "CAMERA_ID", "\"-1\""}, "whole number"}},
      {"camera id beyond 32 bits",
       cameras("4294967296 PINHOLE 640 480 500 500 320 240\n"),
       {"IN/cameras.txt", {"line 1", "CAMERA_ID", "\"4294967296\""}, "whole number"}},
      {"camera id with a fraction",
       cameras("1.5 PINHOLE 640 480 500 500 320 240\n"),
       {"IN/cameras.txt", {"line 1", "CAMERA_ID", "\"1.5\""}, "whole number"}},
      {"unknown model",
       cameras("1 PINHOLES 640 480 500 500 320 240\n"),
       {"IN/cameras.txt", {"line 1", "\"PINHOLES\""}, "unknown camera model"}},
      {"very long model",
       cameras("1 " + std::string(5000, 'P') + " 640 480 500\n"),
       {"IN/cameras.txt",
        {"line 1", "\"PPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPP...\""},
        "unknown camera model"}},
      {"control characters",
       cameras("1 \x1b[31mPINHOLE 640 480 500 500 320 240\n"),
       {"IN/cameras.txt", {"line 1", "\"\\x1b[31mPINHOLE\""}, "unknown camera model"}},
      {"too few parameters",
       cameras("1 PINHOLE 640 480 500 500 320\n"),
       {"IN/cameras.txt", {"line 1", "camera 1", "PINHOLE"}, "3 parameters"}},
      {"too many parameters",
       cameras("1 PINHOLE 640 480 500 500 320 240 0\n"),
       {"IN/cameras.txt", {"line 1", "camera 1", "PINHOLE"}, "5 parameters"}},
      {"parameter is a word",
       cameras("1 PINHOLE 640 480 500 five 320 240\n"),
       {"IN/cameras.txt", {"line 1", "parameter", "\"five\""}, "where a number"}},
      {"parameter beyond a double",
       cameras("1 PINHOLE 640 480 500 1e400 320 240\n"),
       {"IN/cameras.txt", {"line 1", "parameter", "\"1e400\""}, "exceeds a double"}},
      {"parameter nan",
       cameras("1 PINHOLE 640 480 500 500 nan 240\n"),
       {"IN/cameras.txt", {"camera 1", "parameter"}, "not finite"}},
      {"focal length 0",
       cameras("1 PINHOLE 640 480 0 500 320 240\n"),
       {"IN/cameras.txt", {"camera 1", "0"}, "focal length"}},
      {"negative width",
       cameras("1 PINHOLE -640 480 500 500 320 240\n"),
       {"IN/cameras.txt", {"line 1", "WIDTH", "\"-640\""}, "whole number"}},
      {"width 0",
       cameras("1 PINHOLE 0 480 500 500 320 240\n"),
       {"IN/cameras.txt", {"camera 1", "0 x 480 pixels"}, "1 to 1000000"}},
      {"width beyond 32 bits",
       cameras("1 PINHOLE 99999999999 480 500 500 320 240\n"),
       {"IN/cameras.txt", {"camera 1", "99999999999 x 480 pixels"}, "1 to 1000000"}},
      {"negative focal length",
       cameras("1 PINHOLE 640 480 500 -500 320 240\n"),
       {"IN/cameras.txt", {"camera 1", "-500"}, "focal length"}},
      {"no size of a panorama",
       cameras("1 EQUIRECTANGULAR 640 480 640 0\n"),
       {"IN/cameras.txt", {"camera 1", "0"}, "has the size"}},
      {"same camera twice, CRLF and a byte order mark",
       cameras("\xEF\xBB\xBF# cameras\r\n1 PINHOLE 640 480 500 500 320 240\r\n1 PINHOLE 640 480 "
               "500 500 320 240\r\n"),
       {"IN/cameras.txt", {"camera 1"}, "occurs twice"}},
      {"a NUL",
       cameras(std::string("1 PINHOLE 640 480 500 500 320 240\0\n", 35)),
       {"IN/cameras.txt", {"line 1", "parameter", "\"240\\x00\""}, "where a number"}},
      {"UTF-16",
       cameras(std::string("\xff\xfe"
                           "1\0 \0P\0\n\0",
                           10)),
       {"IN/cameras.txt",
        {"line 1",
         "CAMERA_ID",
         "\"\xFF\xFE"
         "1\\x00\""},
        "whole number"}},
      // Images
      {"no number for an image's id",
       images("x 1 0 0 0 0 0 0 1 a.jpg\n\n"),
       {"IN/images.txt", {"line 1", "IMAGE_ID", "\"x\""}, "whole number"}},
      {"image without pose", images("1\n\n"), {"IN/images.txt", {"line 1", "QW"}, "ends before"}},
      {"image without name",
       images("1 1 0 0 0 0 0 0 1\n\n"),
       {"IN/images.txt", {"line 1", "NAME"}, "ends before"}},
      {"image without camera id",
       images("1 1 0 0 0 0 0 0\n\n"),
       {"IN/images.txt", {"line 1", "CAMERA_ID"}, "ends before"}},
      {"pose is a word",
       images("1 1 0 0 zero 0 0 0 1 a.jpg\n\n"),
       {"IN/images.txt", {"line 1", "QZ", "\"zero\""}, "where a number"}},
      {"pose nan",
       images("1 1 0 0 nan 0 0 0 1 a.jpg\n\n"),
       {"IN/images.txt", {"image 1", "pose"}, "not finite"}},
      {"pose inf",
       images("1 1 0 0 0 0 inf 0 1 a.jpg\n\n"),
       {"IN/images.txt", {"image 1", "pose"}, "not finite"}},
      {"pose beyond a double",
       images("1 1 0 0 0 0 1e999 0 1 a.jpg\n\n"),
       {"IN/images.txt", {"line 1", "TY", "\"1e999\""}, "exceeds a double"}},
      {"zero quaternion",
       images("1 0 0 0 0 0 0 0 1 a.jpg\n\n"),
       {"IN/images.txt", {"image 1", "length 0"}, "rotation quaternion"}},
      {"x first",
       images("1 0.5 0.5 0.5 0.6 0 0 0 1 a.jpg\n\n"),
       {"IN/images.txt", {"image 1", "length 1.05357"}, "rotation quaternion"}},
      {"image of no camera",
       images("1 1 0 0 0 0 0 0 2 a.jpg\n\n"),
       {"IN/images.txt", {"image 1", "a.jpg", "camera 2", "cameras.txt"}, "does not have"}},
      {"same image twice",
       images("1 1 0 0 0 0 0 0 1 a.jpg\n\n1 1 0 0 0 0 0 0 1 b.jpg\n\n"),
       {"IN/images.txt", {"image 1"}, "occurs twice"}},
      {"same name twice",
       images("1 1 0 0 0 0 0 0 1 a.jpg\n\n2 1 0 0 0 0 0 0 1 a.jpg\n\n"),
       {"IN/images.txt", {"a.jpg"}, "occurs twice"}},
      {"name that leaves",
       images("1 1 0 0 0 0 0 0 1 ../a.jpg\n\n"),
       {"IN/images.txt", {"image 1", "\"../a.jpg\""}, "within the image folder"}},
      {"absolute name",
       images("1 1 0 0 0 0 0 0 1 /etc/a.jpg\n\n"),
       {"IN/images.txt", {"image 1", "\"/etc/a.jpg\""}, "within the image folder"}},
      {"a NUL in a name",
       images(std::string("1 1 0 0 0 0 0 0 1 a\0.jpg\n\n", 26)),
       {"IN/images.txt", {"image 1", "\"a\\x00.jpg\""}, "within the image folder"}},
      {"the line of features is missing",
       images("1 1 0 0 0 0 0 0 1 a.jpg\n2 1 0 0 0 1 0 0 1 b.jpg\n"),
       {"IN/images.txt", {"line 2", "X", "\"b.jpg\""}, "where a number"}},
      {"feature without point",
       images("1 1 0 0 0 0 0 0 1 a.jpg\n1 2\n"),
       {"IN/images.txt", {"line 2", "POINT3D_ID"}, "ends before"}},
      {"feature's point is -2",
       images("1 1 0 0 0 0 0 0 1 a.jpg\n1 2 -2\n"),
       {"IN/images.txt", {"line 2", "POINT3D_ID", "-2"}, "-1 or more"}},
      {"feature's point is a word",
       images("1 1 0 0 0 0 0 0 1 a.jpg\n1 2 x\n"),
       {"IN/images.txt", {"line 2", "POINT3D_ID", "\"x\""}, "whole number"}},
      {"feature's point beyond 64 bits",
       images("1 1 0 0 0 0 0 0 1 a.jpg\n1 2 9223372036854775808\n"),
       {"IN/images.txt", {"line 2", "POINT3D_ID", "\"9223372036854775808\""}, "whole number"}},
      // Points
      {"point id alone", points("7\n"), {"IN/points3D.txt", {"line 1", "XYZ"}, "ends before"}},
      {"point without colour",
       points("7 1 2 3\n"),
       {"IN/points3D.txt", {"line 1", "RGB"}, "ends before"}},
      {"colour beyond 255",
       points("7 1 2 3 256 0 0 1\n"),
       {"IN/points3D.txt", {"line 1", "RGB", "\"256\""}, "whole number"}},
      {"negative colour",
       points("7 1 2 3 -1 0 0 1\n"),
       {"IN/points3D.txt", {"line 1", "RGB", "\"-1\""}, "whole number"}},
      {"negative point id",
       points("-7 1 2 3 0 0 0 1\n"),
       {"IN/points3D.txt", {"line 1", "POINT3D_ID", "\"-7\""}, "whole number"}},
      {"position is a word",
       points("7 1 2 three 0 0 0 1\n"),
       {"IN/points3D.txt", {"line 1", "XYZ", "\"three\""}, "where a number"}},
      {"position beyond a double",
       points("7 1 2 -1e400 0 0 0 1\n"),
       {"IN/points3D.txt", {"line 1", "XYZ", "\"-1e400\""}, "exceeds a double"}},
      {"half an observation",
       points("7 1 2 3 0 0 0 1 1\n"),
       {"IN/points3D.txt", {"line 1", "POINT2D_IDX"}, "ends before"}},
      {"negative feature index",
       points("7 1 2 3 0 0 0 1 1 -1\n"),
       {"IN/points3D.txt", {"line 1", "POINT2D_IDX", "\"-1\""}, "whole number"}},
      {"observation in no image",
       points("7 1 2 3 0 0 0 1 9 0\n"),
       {"IN/points3D.txt", {"point 7", "image 9", "images.txt"}, "does not have"}},
      {"same point twice",
       points("7 1 2 3 0 0 0 1\n7 1 2 3 0 0 0 1\n"),
       {"IN/points3D.txt", {"point 7"}, "occurs twice"}},
      // Rigs and frames
      {"rig without sensors' number",
       rigs("3\n"),
       {"IN/rigs.txt", {"line 1", "NUM_SENSORS"}, "ends before"}},
      {"rig that ends early",
       rigs("3 4000000000 CAMERA 1\n"),
       {"IN/rigs.txt", {"line 1", "SENSOR_TYPE"}, "ends before"}},
      {"unknown sensor type",
       rigs("3 1 LIDAR 1\n"),
       {"IN/rigs.txt", {"line 1", "\"LIDAR\""}, "sensor type"}},
      {"flag of a pose",
       rigs("3 2 CAMERA 1 CAMERA 2 7\n"),
       {"IN/rigs.txt", {"line 1", "HAS_POSE", "7"}, "0 or 1"}},
      {"rig that goes on",
       rigs("3 1 CAMERA 1 CAMERA 2 0\n"),
       {"IN/rigs.txt", {"line 1", "\"CAMERA 2 0\""}, "goes on"}},
      {"frame without rig",
       frames("5 4 1 0 0 0 0 0 0 1 CAMERA 1 1\n"),
       {"IN/frames.txt", {"frame 5", "rig 4", "rigs.txt"}, "does not have"}},
      {"frame's long quaternion",
       frames("5 3 2 0 0 0 0 0 0 1 CAMERA 1 1\n"),
       {"IN/frames.txt", {"frame 5", "length 2"}, "rotation quaternion"}},
      {"frame that ends early",
       frames("5 3 1 0 0 0 0 0 0 4294967295 CAMERA 1 1\n"),
       {"IN/frames.txt", {"line 1", "SENSOR_TYPE"}, "ends before"}},
      {"frame that goes on",
       frames("5 3 1 0 0 0 0 0 0 0 CAMERA 1 1\n"),
       {"IN/frames.txt", {"line 1", "\"CAMERA 1 1\""}, "goes on"}},
      {"frame with half a pose",
       frames("5 3 1 0 0 0 0\n"),
       {"IN/frames.txt", {"line 1", "TY"}, "ends before"}},
  };
  ExpectMistakes(cases, WriteTextModel, ReadReconstruction);
}

// What is odd and yet a model.
TEST(ColmapTextGood, ColmapText) {
  const TempFolder temp;
  WriteTextModel(temp.path());
  WriteFile(temp / "cameras.txt",
            "\xEF\xBB\xBF# Windows\r\n\r\n1\tPINHOLE 640 480 +500 5e2 320 240  \r\n");
  WriteFile(temp / "points3D.txt", "7 nan 0.5 4 255 128 0 0.8 1 99 2 0");
  const Reconstruction model = ReadReconstruction(temp.path());
  ASSERT_EQ(model.cameras.size(), 1);
  EXPECT_EQ(model.cameras[0].params, (std::vector<double>{500, 500, 320, 240}));
  EXPECT_EQ(model.images.size(), 2);
  EXPECT_EQ(model.points.size(), 1);
}

}  // namespace
}  // namespace semfoam
