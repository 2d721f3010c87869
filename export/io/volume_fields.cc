// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/volume_fields.h"

#include "export/io/label_sidecar.h"
#include "export/volume/vdb_grids.h"
#include "foam/util/error.h"

#include <map>

namespace semfoam {

std::vector<VolumeField> ReadVolumeFields(const std::filesystem::path& path,
                                          const std::string& source_checksum) {
  std::vector<VolumeField> fields;
  if (!std::filesystem::exists(path)) return fields;
  InitializeOpenVdb();
  std::map<std::string, std::string> name_of;
  try {
    openvdb::io::File file(path.string());
    file.open(/*delayLoad=*/false);
    const openvdb::GridPtrVecPtr grids = file.readAllGridMetadata();
    for (const openvdb::GridBase::Ptr& grid : *grids) {
      const auto source = grid->getMetadata<openvdb::StringMetadata>(kSourceModelKey);
      if (!source_checksum.empty() && source && source->value() != source_checksum) return {};
      const auto quantity = grid->getMetadata<openvdb::StringMetadata>(kQuantityKey);
      // Volumes written before the key existed have only their grids' names, which may be unknown.
      name_of[quantity ? quantity->value() : grid->getName()] = grid->getName();
    }
  } catch (const std::exception& error) {
    throw UserError(path.string(),
                    ": is no volume that can be read (",
                    error.what(),
                    "); run volume_exporter again, or remove it.");
  }
  for (const char* quantity : {"density", "color", "label", "confidence", "surface"}) {
    const auto found = name_of.find(quantity);
    if (found != name_of.end()) fields.push_back({quantity, found->second});
  }
  return fields;
}

}  // namespace semfoam
