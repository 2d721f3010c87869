// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"

#include <string>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

namespace semfoam::python {

// Returns a read-only numpy array that refers to `data`, which `owner` keeps.
template <typename T>
pybind11::array View(const T* data,
                     std::vector<pybind11::ssize_t> shape,
                     const pybind11::object& owner) {
  pybind11::array_t<T> array(std::move(shape), data, owner);
  array.attr("setflags")(pybind11::arg("write") = false);
  return array;
}

// Calls `work` without the GIL, which the caller must hold.
template <typename Work>
decltype(auto) WithoutGil(const Work& work) {
  const pybind11::gil_scoped_release released;
  return work();
}

// Returns a choice of labels as LabelChoice has it. `labels` is None (all), an id, a text of ids
// and names between commas, or a sequence of ids and names; the names of the sequence may hold
// commas.
std::string LabelText(const pybind11::object& labels, const Model& model);

}  // namespace semfoam::python
