// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/checkpoint.h"
#include "foam/util/number_text.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <type_traits>

#include <Eigen/Core>
#include <glog/logging.h>

// Objects whose state is stored in a checkpoint describe it once, for writing and reading:
//
//   template <typename Archive>
//   void Serialize(Archive* archive) {
//     archive->Number("steps", &steps_);
//     archive->Array("moments", &moments_, num_sites * stride);
//   }
//
// Both archives take pointers, and the number of elements that an array must have.

namespace semfoam {

// Adds a state to the contents of a checkpoint. The arrays must outlive the contents.
class StateWriter {
 public:
  static constexpr bool kIsReader = false;

  StateWriter(const std::string& group, CheckpointContents* contents)
      : texts_(&contents->texts[group]), contents_(contents) {}

  template <typename T>
  void Number(const std::string& name, const T* value) {
    if constexpr (std::is_same_v<T, bool>) {
      (*texts_)[name] = *value ? "1" : "0";
    } else {
      (*texts_)[name] = FormatNumber(*value);
    }
  }

  template <typename Vector>
  void Array(const std::string& name, const Vector* values, size_t count) {
    using T = typename Vector::value_type;
    static_assert(std::is_trivially_destructible_v<T>);
    CHECK_EQ(values->size(), count) << name;
    contents_->arrays.push_back({name, std::as_bytes(std::span(values->data(), values->size()))});
  }

 private:
  std::map<std::string, std::string>* texts_;
  CheckpointContents* contents_;
};

// Restores a state from a checkpoint. Throws UserError, naming the file, where a value is missing,
// has another length, is not a number of the right kind, or is a float that is not finite.
class StateReader {
 public:
  static constexpr bool kIsReader = true;

  StateReader(const std::string& group, const Checkpoint& checkpoint)
      : texts_(checkpoint.Texts(group)), checkpoint_(checkpoint) {}

  template <typename T>
  void Number(const std::string& name, T* value) {
    const auto found = texts_.find(name);
    bool ok = found != texts_.end();
    if constexpr (std::is_same_v<T, bool>) {
      ok = ok && (found->second == "0" || found->second == "1");
      if (ok) *value = found->second == "1";
    } else {
      ok = ok && ParseNumber(found->second, value);
    }
    if (!ok) checkpoint_.ThrowDamaged("its '" + name + "' is no number of that kind");
  }

  template <typename Vector>
  void Array(const std::string& name, Vector* values, size_t count) {
    using T = typename Vector::value_type;
    const auto bytes = checkpoint_.Array(name);
    if (bytes.size() % sizeof(T) != 0 || bytes.size() / sizeof(T) != count) {
      checkpoint_.ThrowDamaged("its array '" + name + "' has another length");
    }
    values->resize(count);
    if (count > 0) std::memcpy(static_cast<void*>(values->data()), bytes.data(), bytes.size());
    if constexpr (std::is_same_v<T, float>) {
      RequireFinite(name, values->data(), count);
    } else if constexpr (std::is_same_v<T, Eigen::Vector3f>) {
      RequireFinite(name, reinterpret_cast<const float*>(values->data()), 3 * count);
    }
  }

 private:
  void RequireFinite(const std::string& name, const float* values, size_t count) const {
    if (!std::all_of(values, values + count, [](float x) { return std::isfinite(x); })) {
      checkpoint_.ThrowDamaged("its array '" + name + "' holds a number that is not finite");
    }
  }

  const std::map<std::string, std::string>& texts_;
  const Checkpoint& checkpoint_;
};

}  // namespace semfoam
