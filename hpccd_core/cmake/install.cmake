# SPDX-License-Identifier: Apache-2.0
# The C++ package: headers, both libraries, and what find_package(hpccd_core) reads.
include(CMakePackageConfigHelpers)
# The wheel's own build leaves the C++ package out; its tests ask for these components by name.
set(on_demand "")
if(HPCCD_PIP)
  set(on_demand EXCLUDE_FROM_ALL)
endif()
set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/hpccd_core")

install(DIRECTORY include/hpccd DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" COMPONENT development ${on_demand}
  FILES_MATCHING PATTERN "*.h")
foreach(kind static shared)
  install(TARGETS hpccd_core_${kind} EXPORT hpccd_core_${kind}
    LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT runtime NAMELINK_COMPONENT development ${on_demand}
    ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT development ${on_demand})
  install(EXPORT hpccd_core_${kind} NAMESPACE hpccd:: FILE hpccd_core-${kind}.cmake
    DESTINATION "${package_dir}" COMPONENT development ${on_demand})
endforeach()

set(built_with_cuda OFF)
if(hpccd_cuda_objects)
  set(built_with_cuda ON)
endif()
# In a folder where find_package() does not look: what is only built is no package.
set(package_files "${CMAKE_CURRENT_BINARY_DIR}/to_install")
configure_package_config_file(cmake/hpccd_coreConfig.cmake.in "${package_files}/hpccd_coreConfig.cmake"
  INSTALL_DESTINATION "${package_dir}")
set(compatible SameMajorVersion)
if(PROJECT_VERSION_MAJOR EQUAL 0)
  set(compatible SameMinorVersion)
endif()
write_basic_package_version_file("${package_files}/hpccd_coreConfigVersion.cmake"
  VERSION ${PROJECT_VERSION} COMPATIBILITY ${compatible})
install(FILES "${package_files}/hpccd_coreConfig.cmake"
  "${package_files}/hpccd_coreConfigVersion.cmake"
  DESTINATION "${package_dir}" COMPONENT development ${on_demand})
