// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace semfoam {

// Finds the photos that masks of any origin belong to.

struct PhotoMatching {
  // [names] Index of the photo; -1 = none.
  std::vector<int> photos;
  // How they were found: "by name", "by frame number", "in their order".
  std::string how;
};

// Matches names of masks, with or without folders and extension, with the names of photos. A mask's
// photo is the one of its file name, with or without extension; of several, that with the most
// folders in common at the end. Names may have what programs add: mask_ before them, _mask, .mask
// or another extension behind, Roboflow's "_jpg.rf.<hash>", the eight digits of Label Studio. Where
// no name is that of a photo, names are taken for frame numbers of a video: those of photos, or,
// with as many masks as photos, in the same order.
//
// Throws UserError, one sentence: a mask that may belong to several photos, several of one photo,
// and names of which none belongs to a photo. `source` is the path that the sentence begins with.
PhotoMatching MatchPhotos(const std::string& source,
                          const std::vector<std::string>& names,
                          const std::vector<std::string>& photo_names);

// Whether at least one of the names is, with all its folders and but for the extension, that of a
// photo.
bool NamesPhotosWithFolders(const std::vector<std::string>& names,
                            const std::vector<std::string>& photo_names);

}  // namespace semfoam
