# `cmake --install BUILD --prefix PREFIX`: the programs, and the three libraries with their headers for
# find_package(SemanticFoam) in other projects.
include(CMakePackageConfigHelpers)

# Headers are included as in this tree, "foam/train/trainer.h", below a folder of our own.
set(SEMFOAM_INSTALL_INCLUDE ${CMAKE_INSTALL_INCLUDEDIR}/SemanticFoam)

# What other projects include; the headers that these include are installed with them, and no others.
set(SEMFOAM_PUBLIC_HEADERS
    # Whole runs, as the program does them
    tools/controllers/export_frame.h
    tools/controllers/export_objects.h
    tools/controllers/export_surfaces.h
    tools/controllers/export_volumes.h
    tools/controllers/label_names.h
    tools/controllers/presets.h
    tools/controllers/scene_segmenter.h
    tools/controllers/training_folder.h
    tools/controllers/training_run.h
    tools/evaluation/evaluation.h
    # The foam: train, render, edit, read and write
    foam/device/device.h
    foam/edit/model_transform.h
    foam/edit/object_editing.h
    foam/edit/object_insertion.h
    foam/model/model.h
    foam/train/trainer.h
    foam/util/error.h
    foam/util/interruption.h
    foam/util/parallel.h
    foam/view/cell_statistics.h
    foam/view/view_renderer.h
    # COLMAP models, photos and masks
    plugin/colmap/colmap_model.h
    plugin/colmap/model_transform.h
    plugin/colmap/reference_positions.h
    plugin/colmap/untrained_model.h
    plugin/dataset/training_scene.h
    plugin/mask/point_labels.h
    plugin/photometric/effects.h
    # Objects, volumes, surfaces and other formats
    export/io/cell_points.h
    export/io/radiant_foam_ply.h
    export/io/surface_export.h
    export/io/volume_export.h
    export/scene/exportable_scene.h
    export/scene/object_surface.h
    export/transfer/label_transfer.h)

function(semfoam_install)
  if(TARGET semfoam)
    install(TARGETS semfoam RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
  endif()
  if(TARGET semfoam_benchmark)
    # In no package.
    install(TARGETS semfoam_benchmark RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT benchmark)
  endif()
  foreach(library foam plugin export controllers)
    set_target_properties(semfoam_${library} PROPERTIES EXPORT_NAME ${library})
  endforeach()
  install(
    CODE "set(SEMFOAM_SOURCE \"${PROJECT_SOURCE_DIR}\")
set(SEMFOAM_HEADERS \"${SEMFOAM_PUBLIC_HEADERS}\")
set(SEMFOAM_DESTINATION \"${SEMFOAM_INSTALL_INCLUDE}\")
include(\"${PROJECT_SOURCE_DIR}/cmake/InstallHeaders.cmake\")"
    COMPONENT development)
  install(TARGETS semfoam_foam semfoam_plugin semfoam_export semfoam_controllers semfoam_openvdb semfoam_openmesh
          EXPORT SemanticFoamTargets COMPONENT development)
  set(folder ${CMAKE_INSTALL_LIBDIR}/cmake/SemanticFoam)
  install(EXPORT SemanticFoamTargets NAMESPACE SemanticFoam:: DESTINATION ${folder} COMPONENT development)
  configure_package_config_file(
    ${PROJECT_SOURCE_DIR}/cmake/SemanticFoamConfig.cmake.in ${PROJECT_BINARY_DIR}/SemanticFoamConfig.cmake
    INSTALL_DESTINATION ${folder})
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/SemanticFoamConfigVersion.cmake COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/SemanticFoamConfig.cmake ${PROJECT_BINARY_DIR}/SemanticFoamConfigVersion.cmake
          DESTINATION ${folder} COMPONENT development)
endfunction()
