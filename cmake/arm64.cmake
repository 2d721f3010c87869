# Toolchain file: builds for Debian on arm64, on another machine. SEMFOAM_ARM64_ROOT is a folder with Debian's arm64 packages,
# unpacked and not configured (tests/arm64 makes one); the compiler is that of g++-aarch64-linux-gnu, and qemu-user-static runs
# what was built: tests, and the programs that the build itself runs.
if(NOT SEMFOAM_ARM64_ROOT)
  message(FATAL_ERROR "cmake/arm64.cmake: SEMFOAM_ARM64_ROOT is not set; the folder with Debian's arm64 packages would be right.")
endif()
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_SYSROOT ${SEMFOAM_ARM64_ROOT})
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES SEMFOAM_ARM64_ROOT)

set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${SEMFOAM_ARM64_ROOT})
set(ENV{PKG_CONFIG_LIBDIR} ${SEMFOAM_ARM64_ROOT}/usr/lib/aarch64-linux-gnu/pkgconfig:${SEMFOAM_ARM64_ROOT}/usr/share/pkgconfig)

set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64-static -L ${SEMFOAM_ARM64_ROOT})
