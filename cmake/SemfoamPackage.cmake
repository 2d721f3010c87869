# Debian packages by CPack: `cpack -G DEB` in the build folder, or tools/package, which builds for /usr first. One package for
# each component of the installation.
set(SEMFOAM_MAINTAINER "The Semantic Foam for COLMAP authors <semfoam@semfoam.invalid>" CACHE STRING
    "Who the packages name as their maintainer")

# semfoam_package(COMPONENT program NAME semfoam SECTION graphics SUMMARY ... DESCRIPTION ... [DEPENDS ...] [SHLIBDEPS])
# makes the package of a component, with what every package holds: its licence and its changelog.
function(semfoam_package)
  cmake_parse_arguments(ARG SHLIBDEPS "COMPONENT;NAME;SECTION;SUMMARY;DESCRIPTION" "DEPENDS" ${ARGN})
  set(folder ${PROJECT_BINARY_DIR}/package/${ARG_NAME})
  # The licence of the report's page, as the format of the file wants it.
  file(READ ${PROJECT_SOURCE_DIR}/tools/report_page/LICENSE licence)
  string(STRIP "${licence}" licence)
  string(REPLACE "\n\n" "\n.\n" licence "${licence}")
  string(REPLACE "\n" "\n " SEMFOAM_REPORT_LICENSE " ${licence}")
  file(READ ${PROJECT_SOURCE_DIR}/cmake/debian_copyright copyright)
  file(CONFIGURE OUTPUT ${folder}/copyright CONTENT "${copyright}" @ONLY)
  execute_process(COMMAND date --utc --rfc-email --date ${SEMFOAM_DATE} OUTPUT_VARIABLE date COMMAND_ERROR_IS_FATAL ANY
                  OUTPUT_STRIP_TRAILING_WHITESPACE)
  file(CONFIGURE OUTPUT ${folder}/changelog CONTENT
       "semfoam (@PROJECT_VERSION@) unstable; urgency=medium

  * What changed stands in CHANGELOG.md of the source.

 -- @SEMFOAM_MAINTAINER@  ${date}
" @ONLY)
  execute_process(COMMAND gzip -9nkf ${folder}/changelog COMMAND_ERROR_IS_FATAL ANY)
  install(FILES ${folder}/copyright ${folder}/changelog.gz DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${ARG_NAME}
          COMPONENT ${ARG_COMPONENT})

  string(TOUPPER ${ARG_COMPONENT} component)
  string(REPLACE ";" ", " depends "${ARG_DEPENDS}")
  set(prefix CPACK_DEBIAN_${component})
  set(${prefix}_PACKAGE_NAME ${ARG_NAME} PARENT_SCOPE)
  set(${prefix}_PACKAGE_SECTION ${ARG_SECTION} PARENT_SCOPE)
  set(${prefix}_PACKAGE_DEPENDS "${depends}" PARENT_SCOPE)
  set(${prefix}_PACKAGE_SHLIBDEPS ${ARG_SHLIBDEPS} PARENT_SCOPE)
  set(${prefix}_DESCRIPTION "${ARG_SUMMARY}\n${ARG_DESCRIPTION}" PARENT_SCOPE)
  set(CPACK_COMPONENTS_ALL ${CPACK_COMPONENTS_ALL} ${ARG_COMPONENT} PARENT_SCOPE)
endfunction()

set(CPACK_COMPONENTS_ALL "")
if(SEMFOAM_BUILD_TOOLS)
  semfoam_package(
    COMPONENT program
    NAME semfoam
    SECTION graphics
    SHLIBDEPS
    SUMMARY "labelled volumes and meshes of COLMAP models, photos and masks"
    DESCRIPTION
      "semfoam trains a foam, a Voronoi partition of space whose cells carry\ndensity, colour and identity, from a COLMAP model, its photos and instance\nmasks, and writes every object as a labelled OpenVDB volume and a closed\nOpenMesh surface, as glTF and as USD.")
  semfoam_package(
    COMPONENT development
    NAME libsemfoam-dev
    SECTION libdevel
    SUMMARY "Semantic Foam for COLMAP: headers, static libraries, CMake package"
    DESCRIPTION
      "find_package(SemanticFoam) finds the libraries that the program semfoam is\nmade of: the foam, COLMAP models with photos and masks, exports, whole runs."
    DEPENDS
      libceres-dev
      libeigen3-dev
      libgmp-dev
      libgoogle-glog-dev
      libhwy-dev
      libimath-dev
      libmpfr-dev
      libopenimageio-dev
      libopenmesh-dev
      libopenvdb-dev
      libpng-dev
      libtbb-dev
      nlohmann-json3-dev
      zlib1g-dev)
endif()
if(SEMFOAM_BUILD_PYTHON)
  math(EXPR python_after "${Python_VERSION_MINOR} + 1")
  set(python_after ${Python_VERSION_MAJOR}.${python_after})
  semfoam_package(
    COMPONENT python
    NAME python3-semfoam
    SECTION python
    SHLIBDEPS
    SUMMARY "Semantic Foam for COLMAP: Python module"
    DESCRIPTION
      "import semfoam trains, renders, evaluates, edits and exports foams from\nPython, with cells, renders and meshes as numpy arrays."
    # The module is of one version of Python.
    DEPENDS "python3 (>= ${Python_VERSION_MAJOR}.${Python_VERSION_MINOR})" "python3 (<< ${python_after})" python3-numpy)
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME semfoam)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "${SEMFOAM_MAINTAINER}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_STRIP_FILES ON)
include(CPack)
