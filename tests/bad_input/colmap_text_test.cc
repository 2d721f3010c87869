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
      {"no points",
       Remove("points3D.txt"),
       "IN/points3D.txt: is missing, while cameras.txt is there; is the copy of the COLMAP model "
       "complete?"},
      {"images are a folder",
       MakeFolder("images.txt"),
       "IN/images.txt: is a folder, where a COLMAP model's file should be."},
      {"cameras are a pipe",
       MakePipe("cameras.txt"),
       "IN/cameras.txt: is a pipe, where a COLMAP model's file should be."},
      {"rigs are a device",
       MakeDevice("rigs.txt"),
       "IN/rigs.txt: is a device, where a COLMAP model's file should be."},
      // Files without a record are valid by themselves; the images then lack their camera.
      {"empty cameras",
       cameras(""),
       "IN/images.txt: image 1 (a.jpg) uses camera 1, which cameras.txt does not have; are both "
       "files of one model?"},
      {"comments alone",
       cameras("# nothing\n#\n"),
       "IN/images.txt: image 1 (a.jpg) uses camera 1, which cameras.txt does not have; are both "
       "files of one model?"},
      {"points without images",
       images("# none\n"),
       "IN/points3D.txt: point 7 is seen by image 1, which images.txt does not have; are both "
       "files of one model?"},
      // Cameras
      {"camera id alone",
       cameras("1\n"),
       "IN/cameras.txt: line 1 ends before MODEL; is it complete?"},
      {"camera without size",
       cameras("1 PINHOLE\n"),
       "IN/cameras.txt: line 1 ends before WIDTH; is it complete?"},
      {"camera without height",
       cameras("1 PINHOLE 640\n"),
       "IN/cameras.txt: line 1 ends before HEIGHT; is it complete?"},
      {"no number for id",
       cameras("one PINHOLE 640 480 500 500 320 240\n"),
       "IN/cameras.txt: line 1 has CAMERA_ID \"one\", where a whole number in range would be "
       "right."},
      {"negative camera id",
       cameras("-1 PINHOLE 640 480 500 500 320 240\n"),
       "IN/cameras.txt: line 1 has CAMERA_ID \"-1\", where a whole number in range would be "
       "right."},
      {"camera id beyond 32 bits",
       cameras("4294967296 PINHOLE 640 480 500 500 320 240\n"),
       "IN/cameras.txt: line 1 has CAMERA_ID \"4294967296\", where a whole number in range would "
       "be right."},
      {"camera id with a fraction",
       cameras("1.5 PINHOLE 640 480 500 500 320 240\n"),
       "IN/cameras.txt: line 1 has CAMERA_ID \"1.5\", where a whole number in range would be "
       "right."},
      {"unknown model",
       cameras("1 PINHOLES 640 480 500 500 320 240\n"),
       "IN/cameras.txt: line 1 has the unknown camera model \"PINHOLES\", where one of COLMAP's "
       "would be right, such as SIMPLE_RADIAL."},
      {"very long model",
       cameras("1 " + std::string(5000, 'P') + " 640 480 500\n"),
       "IN/cameras.txt: line 1 has the unknown camera model "
       "\"PPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPPP...\", where one of COLMAP's "
       "would be right, such as SIMPLE_RADIAL."},
      {"control characters",
       cameras("1 \x1b[31mPINHOLE 640 480 500 500 320 240\n"),
       "IN/cameras.txt: line 1 has the unknown camera model \"\\x1b[31mPINHOLE\", where one of "
       "COLMAP's would be right, such as SIMPLE_RADIAL."},
      {"too few parameters",
       cameras("1 PINHOLE 640 480 500 500 320\n"),
       "IN/cameras.txt: line 1 gives 3 parameters for camera 1, where the model PINHOLE has 4."},
      {"too many parameters",
       cameras("1 PINHOLE 640 480 500 500 320 240 0\n"),
       "IN/cameras.txt: line 1 gives 5 parameters for camera 1, where the model PINHOLE has 4."},
      {"parameter is a word",
       cameras("1 PINHOLE 640 480 500 five 320 240\n"),
       "IN/cameras.txt: line 1 has a parameter \"five\", where a number would be right."},
      {"parameter beyond a double",
       cameras("1 PINHOLE 640 480 500 1e400 320 240\n"),
       "IN/cameras.txt: line 1 has a parameter \"1e400\", which exceeds a double; is it damaged?"},
      {"parameter nan",
       cameras("1 PINHOLE 640 480 500 500 nan 240\n"),
       "IN/cameras.txt: camera 1 has a parameter that is not finite; is it damaged?"},
      {"focal length 0",
       cameras("1 PINHOLE 640 480 0 500 320 240\n"),
       "IN/cameras.txt: camera 1 has the focal length 0, where a positive one would be right; did "
       "the calibration fail?"},
      {"negative width",
       cameras("1 PINHOLE -640 480 500 500 320 240\n"),
       "IN/cameras.txt: line 1 has WIDTH \"-640\", where a whole number in range would be right."},
      {"width 0",
       cameras("1 PINHOLE 0 480 500 500 320 240\n"),
       "IN/cameras.txt: camera 1 has 0 x 480 pixels, where 1 to 1000000 a side would be right; is "
       "it damaged?"},
      {"same camera twice, CRLF and a byte order mark",
       cameras("\xEF\xBB\xBF# cameras\r\n1 PINHOLE 640 480 500 500 320 240\r\n1 PINHOLE 640 480 "
               "500 500 320 240\r\n"),
       "IN/cameras.txt: camera 1 occurs twice; it should occur once; is it damaged?"},
      {"a NUL",
       cameras(std::string("1 PINHOLE 640 480 500 500 320 240\0\n", 35)),
       "IN/cameras.txt: line 1 has a parameter \"240\\x00\", where a number would be right."},
      {"UTF-16",
       cameras(std::string("\xff\xfe"
                           "1\0 \0P\0\n\0",
                           10)),
       "IN/cameras.txt: line 1 has CAMERA_ID \"\xFF\xFE"
       "1\\x00\", where a whole number in range would be right."},
      // Images
      {"image without pose",
       images("1\n\n"),
       "IN/images.txt: line 1 ends before QW; is it complete?"},
      {"image without name",
       images("1 1 0 0 0 0 0 0 1\n\n"),
       "IN/images.txt: line 1 ends before NAME; is it complete?"},
      {"image without camera id",
       images("1 1 0 0 0 0 0 0\n\n"),
       "IN/images.txt: line 1 ends before CAMERA_ID; is it complete?"},
      {"pose is a word",
       images("1 1 0 0 zero 0 0 0 1 a.jpg\n\n"),
       "IN/images.txt: line 1 has QZ \"zero\", where a number would be right."},
      {"pose nan",
       images("1 1 0 0 nan 0 0 0 1 a.jpg\n\n"),
       "IN/images.txt: image 1 has a pose that is not finite; is it damaged?"},
      {"pose inf",
       images("1 1 0 0 0 0 inf 0 1 a.jpg\n\n"),
       "IN/images.txt: image 1 has a pose that is not finite; is it damaged?"},
      {"pose beyond a double",
       images("1 1 0 0 0 0 1e999 0 1 a.jpg\n\n"),
       "IN/images.txt: line 1 has TY \"1e999\", which exceeds a double; is it damaged?"},
      {"zero quaternion",
       images("1 0 0 0 0 0 0 0 1 a.jpg\n\n"),
       "IN/images.txt: image 1 has a rotation quaternion of length 0 where 1 would be right; is "
       "the order QW QX QY QZ?"},
      {"x first",
       images("1 0.5 0.5 0.5 0.6 0 0 0 1 a.jpg\n\n"),
       "IN/images.txt: image 1 has a rotation quaternion of length 1.05357 where 1 would be right; "
       "is the order QW QX QY QZ?"},
      {"image of no camera",
       images("1 1 0 0 0 0 0 0 2 a.jpg\n\n"),
       "IN/images.txt: image 1 (a.jpg) uses camera 2, which cameras.txt does not have; are both "
       "files of one model?"},
      {"same image twice",
       images("1 1 0 0 0 0 0 0 1 a.jpg\n\n1 1 0 0 0 0 0 0 1 b.jpg\n\n"),
       "IN/images.txt: image 1 occurs twice; it should occur once; is it damaged?"},
      {"same name twice",
       images("1 1 0 0 0 0 0 0 1 a.jpg\n\n2 1 0 0 0 0 0 0 1 a.jpg\n\n"),
       "IN/images.txt: the image name a.jpg occurs twice; it should occur once; is it damaged?"},
      {"name that leaves",
       images("1 1 0 0 0 0 0 0 1 ../a.jpg\n\n"),
       "IN/images.txt: image 1 has the name \"../a.jpg\", where a file's path within the image "
       "folder would be right."},
      {"a NUL in a name",
       images(std::string("1 1 0 0 0 0 0 0 1 a\0.jpg\n\n", 26)),
       "IN/images.txt: image 1 has the name \"a\\x00.jpg\", where a file's path within the image "
       "folder would be right."},
      {"the line of features is missing",
       images("1 1 0 0 0 0 0 0 1 a.jpg\n2 1 0 0 0 1 0 0 1 b.jpg\n"),
       "IN/images.txt: line 2 has X \"b.jpg\", where a number would be right."},
      {"feature without point",
       images("1 1 0 0 0 0 0 0 1 a.jpg\n1 2\n"),
       "IN/images.txt: line 2 ends before POINT3D_ID; is it complete?"},
      {"feature's point is -2",
       images("1 1 0 0 0 0 0 0 1 a.jpg\n1 2 -2\n"),
       "IN/images.txt: line 2 has POINT3D_ID -2, where -1 or more would be right."},
      {"feature's point is a word",
       images("1 1 0 0 0 0 0 0 1 a.jpg\n1 2 x\n"),
       "IN/images.txt: line 2 has POINT3D_ID \"x\", where a whole number in range would be right."},
      {"feature's point beyond 64 bits",
       images("1 1 0 0 0 0 0 0 1 a.jpg\n1 2 9223372036854775808\n"),
       "IN/images.txt: line 2 has POINT3D_ID \"9223372036854775808\", where a whole number in "
       "range would be right."},
      // Points
      {"point id alone", points("7\n"), "IN/points3D.txt: line 1 ends before XYZ; is it complete?"},
      {"point without colour",
       points("7 1 2 3\n"),
       "IN/points3D.txt: line 1 ends before RGB; is it complete?"},
      {"colour beyond 255",
       points("7 1 2 3 256 0 0 1\n"),
       "IN/points3D.txt: line 1 has RGB \"256\", where a whole number in range would be right."},
      {"negative colour",
       points("7 1 2 3 -1 0 0 1\n"),
       "IN/points3D.txt: line 1 has RGB \"-1\", where a whole number in range would be right."},
      {"negative point id",
       points("-7 1 2 3 0 0 0 1\n"),
       "IN/points3D.txt: line 1 has POINT3D_ID \"-7\", where a whole number in range would be "
       "right."},
      {"position is a word",
       points("7 1 2 three 0 0 0 1\n"),
       "IN/points3D.txt: line 1 has XYZ \"three\", where a number would be right."},
      {"position beyond a double",
       points("7 1 2 -1e400 0 0 0 1\n"),
       "IN/points3D.txt: line 1 has XYZ \"-1e400\", which exceeds a double; is it damaged?"},
      {"half an observation",
       points("7 1 2 3 0 0 0 1 1\n"),
       "IN/points3D.txt: line 1 ends before POINT2D_IDX; is it complete?"},
      {"negative feature index",
       points("7 1 2 3 0 0 0 1 1 -1\n"),
       "IN/points3D.txt: line 1 has POINT2D_IDX \"-1\", where a whole number in range would be "
       "right."},
      {"observation in no image",
       points("7 1 2 3 0 0 0 1 9 0\n"),
       "IN/points3D.txt: point 7 is seen by image 9, which images.txt does not have; are both "
       "files of one model?"},
      {"same point twice",
       points("7 1 2 3 0 0 0 1\n7 1 2 3 0 0 0 1\n"),
       "IN/points3D.txt: point 7 occurs twice; it should occur once; is it damaged?"},
      // Rigs and frames
      {"rig without sensors' number",
       rigs("3\n"),
       "IN/rigs.txt: line 1 ends before NUM_SENSORS; is it complete?"},
      {"rig that ends early",
       rigs("3 4000000000 CAMERA 1\n"),
       "IN/rigs.txt: line 1 ends before SENSOR_TYPE; is it complete?"},
      {"unknown sensor type",
       rigs("3 1 LIDAR 1\n"),
       "IN/rigs.txt: line 1 has the sensor type \"LIDAR\", where CAMERA or IMU would be right."},
      {"flag of a pose",
       rigs("3 2 CAMERA 1 CAMERA 2 7\n"),
       "IN/rigs.txt: line 1 has HAS_POSE 7, where 0 or 1 would be right."},
      {"rig that goes on",
       rigs("3 1 CAMERA 1 CAMERA 2 0\n"),
       "IN/rigs.txt: line 1 goes on with \"CAMERA 2 0\", where it should end."},
      {"frame without rig",
       frames("5 4 1 0 0 0 0 0 0 1 CAMERA 1 1\n"),
       "IN/frames.txt: frame 5 uses rig 4, which rigs.txt does not have; are both files of one "
       "model?"},
      {"frame that ends early",
       frames("5 3 1 0 0 0 0 0 0 4294967295 CAMERA 1 1\n"),
       "IN/frames.txt: line 1 ends before SENSOR_TYPE; is it complete?"},
      {"frame that goes on",
       frames("5 3 1 0 0 0 0 0 0 0 CAMERA 1 1\n"),
       "IN/frames.txt: line 1 goes on with \"CAMERA 1 1\", where it should end."},
      {"frame with half a pose",
       frames("5 3 1 0 0 0 0\n"),
       "IN/frames.txt: line 1 ends before TY; is it complete?"},
  };
  ExpectSentences(cases, WriteTextModel, ReadReconstruction);
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
