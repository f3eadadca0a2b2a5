# defrec_add_backend(NAME SOURCES ... LIBRARIES ... [MAPS ...] [CONTAINS ...] [GPU] [GPU_TESTS ...]
#     [COMPONENT <install component>])
# Registers a backend of the tree: makes its plugin defrec_plugin_NAME.so, exporting nothing but the
# plugin's entry, and its manifest, both in the folder of libdefrec. Whoever deals with all backends
# asks here which there are: the tests of exports and of mapped libraries, conformance's short list,
# the component list, the packages for Debian, Python and C#, and the folder that checks a GPU.
#   MAPS        libraries that it may map besides the runtimes of C and C++
#   CONTAINS    of components that several parts contain, those that it does: eigen. Its own it
#               declares with defrec_component()
#   GPU         it computes on a device that a machine may lack: its short list is skipped there,
#               and a GPU check examines it elsewhere
#   GPU_TESTS   test programs that go into that folder
#   COMPONENT   it is installed with that component; without, it has one of its own, plugin_NAME,
#               and with it a Debian package, which debian/control describes
#
# defrec_list_plugins(TARGETS FILES)
# Sets the two variables: the targets of all plugins made so, and their libraries and manifests.
# Each target has the properties DEFREC_BACKEND (NAME) and DEFREC_<argument above>.
include(DefrecPluginManifest)
set(DEFREC_PLUGIN_FOLDER "${CMAKE_INSTALL_LIBDIR}")
if(WIN32)
  set(DEFREC_PLUGIN_FOLDER "${CMAKE_INSTALL_BINDIR}") # where the DLL goes
endif()

function(defrec_add_backend name)
  set(lists MAPS CONTAINS GPU_TESTS)
  cmake_parse_arguments(PARSE_ARGV 1 arg "GPU" "COMPONENT" "SOURCES;LIBRARIES;${lists}")
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "defrec_add_backend: unknown arguments ${arg_UNPARSED_ARGUMENTS}")
  endif()
  set(component "${arg_COMPONENT}")
  if(NOT component)
    set(component plugin_${name})
  endif()
  set(target defrec_plugin_${name})
  set(exports "${CMAKE_SOURCE_DIR}/plugins/base/exports.map")
  add_library(${target} MODULE ${arg_SOURCES})
  target_link_libraries(${target} PRIVATE defrec_plugin_base ${arg_LIBRARIES})
  target_include_directories(${target} PRIVATE "${CMAKE_SOURCE_DIR}" "${CMAKE_SOURCE_DIR}/include")
  target_compile_definitions(${target} PRIVATE DEFREC_RELEASE="${PROJECT_VERSION}")
  if(NOT WIN32) # whose exports are those that the source names
    target_link_options(${target} PRIVATE "-Wl,--version-script,${exports}")
    set_target_properties(${target} PROPERTIES LINK_DEPENDS "${exports}")
  endif()
  defrec_add_plugin_manifest(${target} NAME ${name})
  defrec_install_plugin(${target} COMPONENT ${component})
  set_target_properties(${target} PROPERTIES DEFREC_BACKEND "${name}")
  foreach(property IN ITEMS GPU COMPONENT ${lists})
    set_target_properties(${target} PROPERTIES DEFREC_${property} "${arg_${property}}")
  endforeach()
  set_property(GLOBAL APPEND PROPERTY DEFREC_PLUGINS ${target})
endfunction()

function(defrec_list_plugins targets files)
  get_property(plugins GLOBAL PROPERTY DEFREC_PLUGINS)
  set(${targets} ${plugins} PARENT_SCOPE)
  set(all "")
  foreach(plugin IN LISTS plugins)
    list(APPEND all "$<TARGET_FILE:${plugin}>" "$<TARGET_FILE_DIR:${plugin}>/${plugin}.json")
  endforeach()
  set(${files} ${all} PARENT_SCOPE)
endfunction()
