# defrec_add_plugin_manifest(TARGET NAME <name> [VERSION <version>])
# Makes the MODULE library TARGET a plugin's file, defrec_plugin_<name>.so, and writes its manifest
# defrec_plugin_<name>.json beside it after each link. Part of the installed package too.
set(DEFREC_WRITE_PLUGIN_MANIFEST "${CMAKE_CURRENT_LIST_DIR}/WritePluginManifest.cmake")

function(defrec_add_plugin_manifest target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "NAME;VERSION" "")
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "defrec_add_plugin_manifest: unknown arguments ${arg_UNPARSED_ARGUMENTS}")
  endif()
  if(NOT arg_NAME MATCHES "^[a-z0-9_-]+$")
    message(FATAL_ERROR "defrec_add_plugin_manifest: NAME is \"${arg_NAME}\", of a-z 0-9 _ - expected")
  endif()
  if(NOT arg_VERSION)
    set(arg_VERSION "${PROJECT_VERSION}")
  endif()
  # Installing must not rewrite the run path: the manifest names the file's hash.
  set_target_properties(${target} PROPERTIES PREFIX "" OUTPUT_NAME "defrec_plugin_${arg_NAME}" SUFFIX ".so"
    BUILD_WITH_INSTALL_RPATH ON)
  add_custom_command(TARGET ${target} POST_BUILD VERBATIM COMMAND "${CMAKE_COMMAND}"
    "-DNAME=${arg_NAME}" "-DVERSION=${arg_VERSION}" "-DLIBRARY=$<TARGET_FILE:${target}>"
    -P "${DEFREC_WRITE_PLUGIN_MANIFEST}")
endfunction()
