// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/python/conversions.h"

#include "export/scene/names.h"

namespace semfoam::python {
namespace {

namespace py = pybind11;

void Append(const std::string& text, std::string* texts) {
  *texts += (texts->empty() ? "" : ",") + text;
}

bool IsInteger(const py::handle& object) { return PyIndex_Check(object.ptr()) != 0; }

std::string IdText(const py::handle& id) {
  return "id:" + std::string(py::str(py::module_::import("operator").attr("index")(id)));
}

}  // namespace

std::string LabelText(const py::object& labels, const Model& model) {
  if (labels.is_none()) return "";
  if (IsInteger(labels)) return IdText(labels);
  if (py::isinstance<py::str>(labels)) return py::str(labels);
  std::string texts;
  for (const py::handle label : labels) {
    if (IsInteger(label)) {
      Append(IdText(label), &texts);
      continue;
    }
    const std::string name = py::str(label);
    bool is_found = false;
    for (const Label& candidate : model.labels) {
      if (candidate.id == kNoObject || DisplayName(candidate.id, candidate.name) != name) continue;
      Append("id:" + std::to_string(Value(candidate.id)), &texts);
      is_found = true;
    }
    if (!is_found) Append(name, &texts);
  }
  return texts;
}

}  // namespace semfoam::python
