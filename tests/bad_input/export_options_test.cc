// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bad options that every command has, and of the exports.
#include "tests/bad_input/bad_options.h"

namespace semfoam {
namespace {

TEST(ExportOptions, ExportOptions) {
  ExpectRefused({
      // What every command can get wrong
      {"volumes", "--nosuch|1", "Failed to parse options - unrecognised option '--nosuch'."},
      {"volumes", "--voxel|1", "Failed to parse options - unrecognised option '--voxel'."},
      {"volumes",
       "stray",
       "Failed to parse options - 'stray' stands where an option was expected; options are written "
       "'--name value'."},
      {"volumes",
       "--voxel_size",
       "Failed to parse options - the required argument for option '--voxel_size' is missing."},
      {"volumes",
       "--voxel_size|--half_float|1",
       "Failed to parse options - the required argument for option '--voxel_size' is missing."},
      {"volumes",
       "--voxel_size|",
       "Failed to parse options - the argument ('') for option '--VolumeExport.voxel_size' is "
       "invalid; it takes a number."},
      {"volumes",
       "--voxel_size|0.1|--voxel_size|0.1",
       "Failed to parse options - the option '--voxel_size' is given more than once; give it "
       "once."},
      {"volumes",
       "--voxel_size|0.1|--VolumeExport.voxel_size|0.1",
       "Failed to parse options - the option '--VolumeExport.voxel_size' is given more than once; "
       "give it once."},
      {"volumes",
       "--foam_path|IN/b.foam",
       "IN/b.foam: there is no such file, where a foam model such as foam_trainer's scene.foam "
       "should be."},
      {"volumes",
       "--num_threads|0",
       "Failed to parse options - the argument ('0') for option '--num_threads' is invalid; it "
       "takes -1 for all cores or a number of threads from 1 on."},
      {"volumes",
       "--num_threads|4294967297",
       "Failed to parse options - the argument ('4294967297') for option '--num_threads' is "
       "invalid; it takes an integer."},
      {"volumes",
       "--random_seed|-1",
       "Failed to parse options - the argument ('-1') for option '--random_seed' is invalid; it "
       "takes an integer that is not negative."},
      {"volumes",
       "--random_seed|18446744073709551616",
       "Failed to parse options - the argument ('18446744073709551616') for option '--random_seed' "
       "is invalid; it takes an integer that is not negative."},
      {"volumes",
       "--log_to_stderr|maybe",
       "Failed to parse options - the argument ('maybe') for option '--log_to_stderr' is invalid; "
       "it takes 0, 1, true or false."},
      {"volumes",
       "--project_path|IN/none.ini",
       "IN/none.ini: there is no such file, where an .ini file for --project_path should be."},
      {"volumes",
       "--project_path|IN",
       "IN: is a folder, where an .ini file for --project_path should be."},
      {"volumes",
       "--project_path|",
       "Failed to parse options - the argument ('') for option '--project_path' is invalid; it "
       "takes an .ini file."},
      // Volumes
      {"volumes",
       "--voxel_size|-1",
       "Failed to parse options - voxel_size must be a length in world units, or 0 to follow "
       "max_resolution."},
      {"volumes",
       "--voxel_size|nan",
       "Failed to parse options - the argument ('nan') for option '--VolumeExport.voxel_size' is "
       "invalid; it takes a number."},
      {"volumes",
       "--voxel_size|inf",
       "Failed to parse options - the argument ('inf') for option '--VolumeExport.voxel_size' is "
       "invalid; it takes a number."},
      {"volumes",
       "--voxel_size|1e400",
       "Failed to parse options - the argument ('1e400') for option '--VolumeExport.voxel_size' is "
       "invalid; it takes a number."},
      {"volumes",
       "--voxel_size|0,1",
       "Failed to parse options - the argument ('0,1') for option '--VolumeExport.voxel_size' is "
       "invalid; it takes a number."},
      {"volumes",
       "--voxel_size|small",
       "Failed to parse options - the argument ('small') for option '--VolumeExport.voxel_size' is "
       "invalid; it takes a number."},
      {"volumes",
       "--voxel_size|1e-9",
       "IN/out/scene.vdb: with voxels of 1e-09 it would hold about 1.57393e+26 of them, more than "
       "the 500000000 allowed; choose a voxel size of 0.000687058 or more."},
      {"volumes",
       "--max_resolution|0",
       "Failed to parse options - max_resolution must be 1..65536."},
      {"volumes",
       "--max_resolution|2147483648",
       "Failed to parse options - the argument ('2147483648') for option "
       "'--VolumeExport.max_resolution' is invalid; it takes an integer."},
      {"volumes",
       "--max_resolution|2.5",
       "Failed to parse options - the argument ('2.5') for option '--VolumeExport.max_resolution' "
       "is invalid; it takes an integer."},
      {"volumes", "--supersample|0", "Failed to parse options - supersample must be 1..8."},
      {"volumes", "--supersample|99", "Failed to parse options - supersample must be 1..8."},
      {"volumes",
       "--labels|nobody",
       "The labels name 'nobody', which is no object; the scene has 7 (mug), 8 "
       "(label_8)."},
      {"volumes",
       "--labels|77",
       "The labels name '77', which is no object; the scene has 7 (mug), 8 (label_8)."},
      {"volumes",
       "--crop|1,2,3",
       "Failed to parse options - crop must be six numbers x0,y0,z0,x1,y1,z1 with x0 < x1, y0 < y1 "
       "and z0 < z1; it is '1,2,3'."},
      {"volumes",
       "--crop|1,2,3,4,5,nan",
       "Failed to parse options - crop must be six numbers x0,y0,z0,x1,y1,z1 with x0 < x1, y0 < y1 "
       "and z0 < z1; it is '1,2,3,4,5,nan'."},
      {"volumes",
       "--crop|1,1,1,0,0,0",
       "Failed to parse options - crop must be six numbers x0,y0,z0,x1,y1,z1 with x0 < x1, y0 < y1 "
       "and z0 < z1; it is '1,1,1,0,0,0'."},
      {"volumes",
       "--VolumeExport.min_optical_depth|-1",
       "Failed to parse options - min_optical_depth must not be negative."},
      {"volumes",
       "--voxel_size|0.1|--max_resolution|64",
       "Failed to parse options - --VolumeExport.max_resolution has no effect with "
       "--VolumeExport.voxel_size; give one of the two."},
      {"volumes",
       "--labels|mug|--VolumeExport.min_optical_depth|0.1",
       "Failed to parse options - --VolumeExport.min_optical_depth has no effect with "
       "--labels, whose cells are all written; give one of the two."},
      {"volumes",
       "--VolumeExport.max_voxels|0",
       "Failed to parse options - max_voxels must be positive."},
      {"volumes",
       "--VolumeExport.label_grid_type|int8",
       "Failed to parse options - the argument ('int8') for option "
       "'--VolumeExport.label_grid_type' is invalid; it takes {float, int32, both}."},
      {"volumes",
       "--VolumeExport.density_grid_name|",
       "Failed to parse options - a grid's name must be letters, digits and '_'; '' is not."},
      {"volumes",
       "--VolumeExport.color_grid_name|density",
       "Failed to parse options - grids must have different names; two are called 'density'."},
      {"volumes",
       "--keep_largest|-1",
       "Failed to parse options - the argument ('-1') for option '--keep_largest' is invalid; it "
       "takes a number from 0 on."},
      {"volumes",
       "--min_cells|-1",
       "Failed to parse options - the argument ('-1') for option '--min_cells' is invalid; it "
       "takes a number from 0 on."},
      {"volumes",
       "--scale|0",
       "Failed to parse options - --scale is 0; it must be from 1e-9 to 1e9."},
      {"volumes",
       "--scale|nan",
       "Failed to parse options - the argument ('nan') for option '--scale' is invalid; it takes a "
       "number."},
      {"volumes",
       "--units|yard",
       "Failed to parse options - the argument ('yard') for option '--units' is invalid; it takes "
       "{unknown, mm, cm, m, km, inch, foot}."},
      {"volumes",
       "--up_axis|x",
       "Failed to parse options - the argument ('x') for option '--up_axis' is invalid; it takes "
       "{colmap, y, z}."},
      {"volumes",
       "--transform|1 0 0",
       "Failed to parse options - --transform is '1 0 0'; it must be the 12 or 16 numbers, row by "
       "row, of a similarity's matrix: a rotation times one scale, and a translation in the last "
       "column."},
      {"volumes",
       "--transform|1 0 0 0 0 2 0 0 0 0 1 0",
       "Failed to parse options - --transform is '1 0 0 0 0 2 0 0 0 0 1 0'; it must be the 12 or "
       "16 "
       "numbers, row by row, of a similarity's matrix: a rotation times one scale, and a "
       "translation in the last column."},
      {"volumes",
       "--transform|nan 0 0 0 0 1 0 0 0 0 1 0",
       "Failed to parse options - --transform is 'nan 0 0 0 0 1 0 0 0 0 1 0'; it must be the 12 or "
       "16 numbers, row by row, of a similarity's matrix: a rotation times one scale, and a "
       "translation in the last column."},
      {"volumes",
       "--output_path|IN/a file/out",
       "IN/a file/out: this folder cannot be made (Not a directory); choose an output path that "
       "you may write to."},
      {"volumes",
       "--output_path|/proc/semfoam",
       "/proc/semfoam: this folder cannot be made (No such file or directory); choose an output "
       "path that you may write to."},
      // Meshes
      {"meshes",
       "--formats|stl",
       "Failed to parse options - the argument ('stl') for option '--formats' is invalid; it takes "
       "any of om,ply,obj,glb,usda, apart by commas."},
      {"meshes",
       "--formats|ply,,om",
       "Failed to parse options - the argument ('ply,,om') for option '--formats' is invalid; it "
       "takes any of om,ply,obj,glb,usda, apart by commas."},
      {"meshes",
       "--formats|",
       "Failed to parse options - the argument ('') for option '--formats' is invalid; it takes "
       "any of om,ply,obj,glb,usda, apart by commas."},
      {"meshes",
       "--method|mc",
       "Failed to parse options - the argument ('mc') for option '--MeshExport.method' is invalid; "
       "it takes {cells, smooth}."},
      {"meshes",
       "--target_faces|500",
       "Failed to parse options - target_faces needs the method smooth; cells are exact and keep "
       "all their faces."},
      {"meshes",
       "--method|smooth|--target_faces|3",
       "Failed to parse options - target_faces must be at least 4, the faces of a tetrahedron, or "
       "0 for all there are."},
      {"meshes",
       "--method|smooth|--target_faces|-4",
       "Failed to parse options - target_faces must be at least 4, the faces of a tetrahedron, or "
       "0 for all there are."},
      {"meshes",
       "--foam_path|IN/a file",
       "IN/a file: this is not a foam model; foam_trainer writes one named scene.foam."},
  });
}

}  // namespace
}  // namespace semfoam
