// SPDX-License-Identifier: GPL-3.0-or-later
//
// The extension module semfoam._semfoam. Names and docstrings are the interface of the package
// semfoam; its types stand in semfoam/__init__.pyi.
#include "foam/util/error.h"
#include "foam/util/interruption.h"
#include "foam/util/parallel.h"
#include "tools/cli/logging.h"
#include "tools/python/foam_methods.h"
#include "tools/python/mask_functions.h"
#include "tools/python/training.h"
#include "tools/python/values.h"
#include "tools/support/memory_task.h"
#include "tools/support/progress.h"

#include <exception>
#include <memory>
#include <new>

#include <pybind11/pybind11.h>

namespace py = pybind11;

namespace semfoam::python {
namespace {

std::unique_ptr<const ThreadLimit> thread_limit;

void SetNumThreads(int num_threads) {
  if (num_threads != -1 && num_threads < 1) {
    throw FieldError("num_threads", " is ", num_threads, "; it must be -1 or from 1 on.");
  }
  thread_limit.reset();
  thread_limit = std::make_unique<const ThreadLimit>(num_threads);
}

void AddExceptions(py::module_* module) {
  // Never destroyed: Python is gone when static objects are.
  static auto& error = *new py::exception<UserError>(*module, "Error", PyExc_ValueError);
  error.attr("__doc__") =
      "An error of the input that can be corrected: one sentence that names the file or the "
      "argument, what is wrong and what would be right.";
  static auto& stopped = *new py::exception<Interruption>(*module, "Stopped", PyExc_RuntimeError);
  stopped.attr("__doc__") =
      "A training was stopped by its progress function, after writing a checkpoint; resume=True "
      "goes on from there with the same result.";
  py::register_exception_translator([](std::exception_ptr exception) {
    try {
      if (exception) std::rethrow_exception(exception);
    } catch (const UserError& caught) {
      PyErr_SetString(error.ptr(), caught.what());
    } catch (const Interruption&) {
      PyErr_SetString(stopped.ptr(), "the progress function has stopped the training");
    } catch (const std::bad_alloc&) {
      PyErr_SetString(PyExc_MemoryError, MemoryUsedUp().c_str());
    }
  });
}

}  // namespace

PYBIND11_MODULE(_semfoam, module) {
  module.doc() = "Semantic Foam for COLMAP";
  module.attr("__version__") = SEMFOAM_VERSION;
  InitLogging("semfoam");
  SetLogVerbosity(/*info=*/false, 0);
  SetProgressStyle(ProgressStyle::kNone);
  AddExceptions(&module);
  module.def(
      "set_verbose",
      [](bool verbose) { SetLogVerbosity(verbose, 0); },
      py::arg("verbose"),
      "Sets whether what runs do is told on stderr; warnings always are.");
  module.def("set_num_threads",
             &SetNumThreads,
             py::arg("num_threads"),
             "Sets the number of threads of this process; -1 = all cores. Changes no result.");
  AddValues(&module);
  AddFoam(&module);
  AddTraining(&module);
  AddMaskFunctions(&module);
}

}  // namespace semfoam::python
