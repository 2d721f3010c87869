# One line per library and per test elsewhere; what they have in common stands here.

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  # What ccache asks for before it trusts precompiled headers: it then looks at what they hold, not at their times. Paths
  # below the source folder are hashed relative to it, so a clone in another folder is served from the same cache.
  set(CMAKE_CXX_COMPILER_LAUNCHER
      ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
      CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1 ${CCACHE_PROGRAM})
endif()

add_library(semfoam_flags INTERFACE)
target_compile_options(semfoam_flags INTERFACE -Wall -Wextra $<$<BOOL:${SEMFOAM_WERROR}>:-Werror>)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # GCC 12 sees overlaps in std::string concatenation that are not there (GCC bug 105651) and, behind a precompiled
  # header, copies of 2^63 bytes in the same place.
  target_compile_options(semfoam_flags INTERFACE -Wno-restrict -Wno-stringop-overflow)
endif()
# Bytes that do not depend on the compiler's taste: no contraction of a * b + c behind the source's back.
set(SEMFOAM_ROUNDING_FLAGS -ffp-contract=off)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT SEMFOAM_SANITIZE)
  # From -O2 on (the sanitizers' builds are at -O1), GCC 12's vectoriser of straight-line code leaves out the roundings of
  # double -> float -> double where two numbers stand side by side (tests/foam/rounding_test).
  list(APPEND SEMFOAM_ROUNDING_FLAGS -fno-tree-slp-vectorize)
endif()
target_compile_options(semfoam_flags INTERFACE ${SEMFOAM_ROUNDING_FLAGS})
target_include_directories(semfoam_flags INTERFACE ${PROJECT_SOURCE_DIR})
if(SEMFOAM_SANITIZE)
  target_compile_options(semfoam_flags INTERFACE -fsanitize=${SEMFOAM_SANITIZE} -fno-sanitize-recover=all
                                                 -fno-omit-frame-pointer)
  # With the checks that sanitizers put in, GCC takes initialised matrices for uninitialised ones, and it warns that
  # ThreadSanitizer does not know the fences of libraries.
  target_compile_options(semfoam_flags INTERFACE "$<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized;-Wno-tsan>")
  target_link_options(semfoam_flags INTERFACE -fsanitize=${SEMFOAM_SANITIZE})
endif()

# Lets the objects of a library be linked into shared libraries: the Python module, and those of others. Functions are called
# and inlined as in a program all the same, as nobody replaces them.
function(semfoam_position_independent TARGET)
  set_target_properties(${TARGET} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  target_compile_options(${TARGET} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-fno-semantic-interposition>)
endfunction()

# Headers that nearly every file includes, compiled once for the libraries and, with other flags, once for the tests
# (2 of 3 seconds of a small test are spent in them). Each file includes what it needs all the same: the preset clang
# builds without precompiled headers.
set(SEMFOAM_COMMON_HEADERS
    <Eigen/Core>
    <Eigen/Geometry>
    <algorithm>
    <array>
    <filesystem>
    <functional>
    <map>
    <memory>
    <optional>
    <span>
    <string>
    <unordered_map>
    <vector>)
function(semfoam_precompiled_headers TARGET)
  cmake_parse_arguments(ARG "" "" "HEADERS;OPTIONS;LINK" ${ARGN})
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/${TARGET}.cc CONTENT "")
  add_library(${TARGET} OBJECT ${PROJECT_BINARY_DIR}/${TARGET}.cc)
  target_link_libraries(${TARGET} PRIVATE semfoam_flags ${ARG_LINK})
  target_compile_options(${TARGET} PRIVATE ${ARG_OPTIONS})
  target_precompile_headers(${TARGET} PRIVATE ${ARG_HEADERS})
endfunction()
find_package(Eigen3 REQUIRED)
semfoam_precompiled_headers(semfoam_library_headers HEADERS ${SEMFOAM_COMMON_HEADERS} LINK Eigen3::Eigen)
semfoam_position_independent(semfoam_library_headers)

# semfoam_library(NAME foam SRCS a.cc b.cc [LINK public...] [PRIVATE_LINK private...]) makes semfoam_foam.
function(semfoam_library)
  cmake_parse_arguments(ARG "" "NAME" "SRCS;LINK;PRIVATE_LINK" ${ARGN})
  add_library(semfoam_${ARG_NAME} STATIC ${ARG_SRCS})
  semfoam_position_independent(semfoam_${ARG_NAME})
  target_link_libraries(semfoam_${ARG_NAME} PUBLIC ${ARG_LINK} PRIVATE $<BUILD_INTERFACE:semfoam_flags> ${ARG_PRIVATE_LINK})
  target_include_directories(semfoam_${ARG_NAME} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
                                                        $<INSTALL_INTERFACE:${SEMFOAM_INSTALL_INCLUDE}>)
  target_precompile_headers(semfoam_${ARG_NAME} REUSE_FROM semfoam_library_headers)
endfunction()

# Seconds. With sanitizers all is some ten times slower.
set(SEMFOAM_TEST_TIMEOUT 1200)
if(SEMFOAM_SANITIZE)
  set(SEMFOAM_TEST_TIMEOUT 7200)
endif()

# semfoam_tests(foam/render TESTS ray_batch_test walk_test LINK semfoam_foam) links tests/foam/render/ray_batch_test.cc
# and walk_test.cc into one program, foam_render_tests, and gives ctest one test a file, foam/render/walk_test, with the
# label foam. TARGET names the program otherwise; FOLDER . is tests/ itself. The tests' own code is at -O1, which compiles a fifth sooner; what they
# test, as everywhere. RUNS_PROGRAM: not optimised at all, which compiles in two thirds of that time, for tests that run the
# program instead of calling the libraries: those would run templates that the linker takes from the tests.
set(SEMFOAM_TEST_OPTIONS $<$<CONFIG:Release>:-O1>)
set(SEMFOAM_PROGRAM_TEST_OPTIONS $<$<CONFIG:Release>:-O0>)
if(SEMFOAM_BUILD_TESTS)
  foreach(kind TEST PROGRAM_TEST)
    string(TOLOWER ${kind} name)
    semfoam_precompiled_headers(
      semfoam_${name}_headers
      HEADERS ${SEMFOAM_COMMON_HEADERS} <gmock/gmock.h> <gtest/gtest.h>
      OPTIONS ${SEMFOAM_${kind}_OPTIONS}
      LINK Eigen3::Eigen GTest::gmock)
  endforeach()
  add_library(semfoam_test_main OBJECT ${PROJECT_SOURCE_DIR}/tests/test_main.cc)
  target_link_libraries(semfoam_test_main PRIVATE semfoam_flags GTest::gmock)
  target_compile_options(semfoam_test_main PRIVATE ${SEMFOAM_TEST_OPTIONS})
  target_precompile_headers(semfoam_test_main REUSE_FROM semfoam_test_headers)
endif()
function(semfoam_tests FOLDER)
  cmake_parse_arguments(ARG "NO_PRECOMPILED_HEADERS;RUNS_PROGRAM" "TARGET" "TESTS;LINK;DEPENDS;DEFINITIONS" ${ARGN})
  if(NOT ARG_TARGET)
    string(REPLACE / _ ARG_TARGET ${FOLDER}_tests)
  endif()
  string(REGEX REPLACE "/.*" "" label ${FOLDER})
  string(REGEX REPLACE "^[.]$" "source" label ${label})
  set(kind TEST)
  if(ARG_RUNS_PROGRAM)
    set(kind PROGRAM_TEST)
  endif()
  set(sources ${ARG_TESTS})
  list(TRANSFORM sources PREPEND ${PROJECT_SOURCE_DIR}/tests/${FOLDER}/)
  list(TRANSFORM sources APPEND .cc)
  add_executable(${ARG_TARGET} ${sources} $<TARGET_OBJECTS:semfoam_test_main>)
  target_link_libraries(${ARG_TARGET} PRIVATE semfoam_flags ${ARG_LINK} GTest::gmock)
  target_compile_options(${ARG_TARGET} PRIVATE ${SEMFOAM_${kind}_OPTIONS})
  target_compile_definitions(${ARG_TARGET} PRIVATE ${ARG_DEFINITIONS})
  if(ARG_DEPENDS)
    add_dependencies(${ARG_TARGET} ${ARG_DEPENDS})
  endif()
  if(NOT ARG_NO_PRECOMPILED_HEADERS)
    string(TOLOWER ${kind} name)
    target_precompile_headers(${ARG_TARGET} REUSE_FROM semfoam_${name}_headers)
  endif()
  foreach(test ${ARG_TESTS})
    string(REGEX REPLACE "^\\./" "" name ${FOLDER}/${test})
    add_test(NAME ${name} COMMAND ${ARG_TARGET} ${test})
    set_tests_properties(${name} PROPERTIES LABELS ${label} TIMEOUT ${SEMFOAM_TEST_TIMEOUT})
  endforeach()
endfunction()
