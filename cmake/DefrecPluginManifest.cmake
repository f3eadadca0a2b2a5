# defrec_add_plugin_manifest(TARGET NAME <name> [VERSION <version>])
# Makes the MODULE library TARGET a plugin's file, defrec_plugin_<name>.so (on Windows .dll), and
# writes its manifest defrec_plugin_<name>.json beside it after each link.
#
# defrec_install_plugin(TARGET [DESTINATION <folder>] [COMPONENT <component>])
# Installs such a plugin and its manifest: into DEFREC_PLUGIN_FOLDER, which is where libdefrec lies
# and looks for plugins, below the same prefix; or into another folder. Both functions are part of
# the installed package too.
set(DEFREC_WRITE_PLUGIN_MANIFEST "${CMAKE_CURRENT_LIST_DIR}/WritePluginManifest.cmake")

function(defrec_add_plugin_manifest target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "NAME;VERSION" "")
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "defrec_add_plugin_manifest: unknown arguments ${arg_UNPARSED_ARGUMENTS}")
  endif()
  if(NOT arg_NAME MATCHES "^[a-z0-9_-]+$")
    message(
      FATAL_ERROR "defrec_add_plugin_manifest: NAME is \"${arg_NAME}\", of a-z 0-9 _ - expected")
  endif()
  if(NOT arg_VERSION)
    set(arg_VERSION "${PROJECT_VERSION}")
  endif()
  # Installing must not rewrite the run path: the manifest names the file's hash.
  set_target_properties(
    ${target} PROPERTIES PREFIX "" OUTPUT_NAME "defrec_plugin_${arg_NAME}"
                         SUFFIX "${CMAKE_SHARED_MODULE_SUFFIX}" BUILD_WITH_INSTALL_RPATH ON)
  add_custom_command(
    TARGET ${target} POST_BUILD VERBATIM
    COMMAND "${CMAKE_COMMAND}" "-DNAME=${arg_NAME}" "-DVERSION=${arg_VERSION}"
            "-DLIBRARY=$<TARGET_FILE:${target}>" -P "${DEFREC_WRITE_PLUGIN_MANIFEST}")
  set_target_properties(${target} PROPERTIES DEFREC_PLUGIN_NAME "${arg_NAME}" DEFREC_PLUGIN_VERSION
                                                                              "${arg_VERSION}")
endfunction()

function(defrec_install_plugin target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "DESTINATION;COMPONENT" "")
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "defrec_install_plugin: unknown arguments ${arg_UNPARSED_ARGUMENTS}")
  endif()
  if(NOT arg_DESTINATION)
    set(arg_DESTINATION "${DEFREC_PLUGIN_FOLDER}")
  endif()
  set(component "")
  if(arg_COMPONENT)
    set(component COMPONENT "${arg_COMPONENT}")
  endif()
  get_target_property(name ${target} DEFREC_PLUGIN_NAME)
  get_target_property(version ${target} DEFREC_PLUGIN_VERSION)
  install(TARGETS ${target} LIBRARY DESTINATION "${arg_DESTINATION}" ${component})
  install(FILES "$<TARGET_FILE_DIR:${target}>/defrec_plugin_${name}.json"
          DESTINATION "${arg_DESTINATION}" ${component})
  # The manifest names the file's hash, and stripping changes the file.
  install(
    CODE "if(CMAKE_INSTALL_DO_STRIP)
    execute_process(COMMAND \"${CMAKE_COMMAND}\" -DNAME=${name} -DVERSION=${version}
      \"-DLIBRARY=\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${arg_DESTINATION}/defrec_plugin_${name}${CMAKE_SHARED_MODULE_SUFFIX}\"
      -P \"${DEFREC_WRITE_PLUGIN_MANIFEST}\" COMMAND_ERROR_IS_FATAL ANY)
  endif()"
    ${component})
endfunction()
