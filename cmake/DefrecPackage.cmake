# What an installed SDK is for CMake: find_package(defrec) gives
#   defrec::defrec    the library, for applications
#   defrec::headers   the headers alone, for plugins
#   defrec_add_plugin_manifest(), defrec_install_plugin()
# Relocatable: nothing in it names where it was built or installed.
include(CMakePackageConfigHelpers)
include(DefrecBackend)
set(package "${CMAKE_INSTALL_LIBDIR}/cmake/defrec")

install(EXPORT defrec-targets NAMESPACE defrec:: DESTINATION "${package}" COMPONENT development)
configure_package_config_file(
  "${CMAKE_CURRENT_LIST_DIR}/defrec-config.cmake.in" "${CMAKE_BINARY_DIR}/defrec-config.cmake"
  INSTALL_DESTINATION "${package}" NO_SET_AND_CHECK_MACRO NO_CHECK_REQUIRED_COMPONENTS_MACRO)
# Before 1.0 a minor version may change what the package offers; the ABIs have versions of their
# own.
write_basic_package_version_file("${CMAKE_BINARY_DIR}/defrec-config-version.cmake"
                                 COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_BINARY_DIR}/defrec-config.cmake"
              "${CMAKE_BINARY_DIR}/defrec-config-version.cmake"
              "${CMAKE_CURRENT_LIST_DIR}/DefrecPluginManifest.cmake"
              "${CMAKE_CURRENT_LIST_DIR}/WritePluginManifest.cmake" DESTINATION "${package}"
        COMPONENT development)

# What the author of a plugin starts from, and the definitions it is held to.
install(DIRECTORY "${CMAKE_SOURCE_DIR}/plugins/template/"
        DESTINATION "${CMAKE_INSTALL_DATADIR}/defrec/plugin_template" COMPONENT development)
if(DEFREC_LIBRARY_ONLY)
  return()
endif()
install(
  DIRECTORY "${CMAKE_SOURCE_DIR}/docs/"
  DESTINATION "${CMAKE_INSTALL_DOCDIR}"
  COMPONENT documentation
  FILES_MATCHING
  PATTERN "*.md"
  PATTERN "*.jpg"
  PATTERN "*.svg"
  PATTERN site EXCLUDE
  PATTERN man EXCLUDE)
install(
  DIRECTORY "${CMAKE_SOURCE_DIR}/samples/" DESTINATION "${CMAKE_INSTALL_DOCDIR}/samples"
  COMPONENT documentation FILES_MATCHING
  REGEX "\\.(c|h|cs|py|ipynb|obj|csv|xml)$|/c/CMakeLists\\.txt$|/Snakefile$|/slurm_array\\.sh$"
  REGEX "/samples/(compare_points|other_scene)\\.py$" EXCLUDE
  REGEX "/samples/test_(csharp_png|slicer_module|notebook|plus)\\.py$" EXCLUDE)
file(RELATIVE_PATH headers "/${CMAKE_INSTALL_DOCDIR}" "/${CMAKE_INSTALL_INCLUDEDIR}")
install(CODE "
  set(docs \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DOCDIR}\")
  set(headers \"${headers}\")
  include(\"${CMAKE_CURRENT_LIST_DIR}/LinkInstalledGuides.cmake\")" COMPONENT documentation)
