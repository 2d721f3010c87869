// SPDX-License-Identifier: GPL-3.0-or-later
//
// Stands in for libcuda.so.1 on a machine whose GPU cannot be used: it is found, and
// every call fails. Leaves the file that SEMFOAM_DRIVER_NOTE names when it is loaded.
#include <cstdio>
#include <cstdlib>

namespace {

constexpr int kNoDevice = 100;  // CUDA_ERROR_NO_DEVICE

struct Note {
  Note() {
    const char* path = std::getenv("SEMFOAM_DRIVER_NOTE");
    std::FILE* file = path == nullptr ? nullptr : std::fopen(path, "w");
    if (file != nullptr) std::fclose(file);
  }
} note;

}  // namespace

extern "C" {
int cuInit(unsigned) { return kNoDevice; }
int cuDriverGetVersion(int* version) {
  *version = 13000;
  return 0;
}
int cuGetProcAddress_v2(const char*, void** function, int, unsigned long long, int* status) {
  *function = nullptr;
  if (status != nullptr) *status = 1;  // no such symbol
  return kNoDevice;
}
int cuGetProcAddress(const char* name, void** function, int version, unsigned long long flags) {
  return cuGetProcAddress_v2(name, function, version, flags, nullptr);
}
}
