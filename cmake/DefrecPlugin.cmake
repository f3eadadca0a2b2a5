# defrec_add_plugin(NAME SOURCES ... LIBRARIES ...)
# defrec_plugin_NAME.so, exporting nothing but the plugin's entry, and its manifest defrec_plugin_NAME.json with the file's
# SHA-256, both in the folder of libdefrec.
function(defrec_add_plugin name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;LIBRARIES")
  set(target defrec_plugin_${name})
  set(exports "${CMAKE_SOURCE_DIR}/plugins/base/exports.map")
  add_library(${target} MODULE ${arg_SOURCES})
  target_link_libraries(${target} PRIVATE ${arg_LIBRARIES})
  target_include_directories(${target} PRIVATE "${CMAKE_SOURCE_DIR}" "${CMAKE_SOURCE_DIR}/include")
  target_compile_definitions(${target} PRIVATE DEFREC_RELEASE="${PROJECT_VERSION}")
  target_link_options(${target} PRIVATE "-Wl,--version-script,${exports}")
  # Installing must not rewrite the run path: the manifest names the file's hash.
  set_target_properties(${target} PROPERTIES PREFIX "" LINK_DEPENDS "${exports}" BUILD_WITH_INSTALL_RPATH ON)
  add_custom_command(TARGET ${target} POST_BUILD VERBATIM COMMAND "${CMAKE_COMMAND}"
    -DNAME=${name} -DVERSION=${PROJECT_VERSION} "-DLIBRARY=$<TARGET_FILE:${target}>"
    -P "${CMAKE_SOURCE_DIR}/cmake/WritePluginManifest.cmake")
  install(TARGETS ${target} LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}")
  install(FILES "$<TARGET_FILE_DIR:${target}>/${target}.json" DESTINATION "${CMAKE_INSTALL_LIBDIR}")
endfunction()
