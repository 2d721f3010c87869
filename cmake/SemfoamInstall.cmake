# `cmake --install BUILD --prefix PREFIX`: the programs, and the three libraries with their headers for
# find_package(SemanticFoam) in other projects.
include(CMakePackageConfigHelpers)

# Headers are included as in this tree, "foam/train/trainer.h", below a folder of our own.
set(SEMFOAM_INSTALL_INCLUDE ${CMAKE_INSTALL_INCLUDEDIR}/SemanticFoam)

function(semfoam_install)
  foreach(program semfoam semfoam_benchmark)
    if(TARGET ${program})
      install(TARGETS ${program} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
    endif()
  endforeach()
  foreach(library foam plugin export controllers)
    set_target_properties(semfoam_${library} PROPERTIES EXPORT_NAME ${library})
  endforeach()
  foreach(folder foam plugin export tools/support tools/controllers)
    get_filename_component(parent ${folder} DIRECTORY)
    install(
      DIRECTORY ${PROJECT_SOURCE_DIR}/${folder}
      DESTINATION ${SEMFOAM_INSTALL_INCLUDE}/${parent}
      FILES_MATCHING
      PATTERN "*.h"
      PATTERN "*-inl.h" EXCLUDE)
  endforeach()
  install(TARGETS semfoam_foam semfoam_plugin semfoam_export semfoam_controllers semfoam_openvdb semfoam_openmesh
          EXPORT SemanticFoamTargets)
  set(folder ${CMAKE_INSTALL_LIBDIR}/cmake/SemanticFoam)
  install(EXPORT SemanticFoamTargets NAMESPACE SemanticFoam:: DESTINATION ${folder})
  configure_package_config_file(
    ${PROJECT_SOURCE_DIR}/cmake/SemanticFoamConfig.cmake.in ${PROJECT_BINARY_DIR}/SemanticFoamConfig.cmake
    INSTALL_DESTINATION ${folder})
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/SemanticFoamConfigVersion.cmake COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/SemanticFoamConfig.cmake ${PROJECT_BINARY_DIR}/SemanticFoamConfigVersion.cmake
          DESTINATION ${folder})
endfunction()
