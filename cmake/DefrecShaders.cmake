# defrec_embed_shaders(TARGET FOLDER)
# Compiles every FOLDER/*.comp to SPIR-V for Vulkan 1.2, validates it, and embeds it in TARGET:
# FOLDER's shaders.hpp declares `extern const Shader <name>;` for each. They include *.glsl and *.h
# of FOLDER, the contracts of the stages and their constants.
find_program(DEFREC_GLSLANG glslangValidator REQUIRED)
find_program(DEFREC_SPIRV_VAL spirv-val REQUIRED)

function(defrec_embed_shaders target folder)
  file(GLOB sources CONFIGURE_DEPENDS "${folder}/*.comp")
  file(GLOB includes CONFIGURE_DEPENDS "${folder}/*.glsl" "${folder}/*.h"
       "${CMAKE_SOURCE_DIR}/backends/shared/*.h" "${CMAKE_SOURCE_DIR}/backends/stages/*.hpp")
  set(generated "${CMAKE_CURRENT_BINARY_DIR}/shaders")
  file(MAKE_DIRECTORY "${generated}")
  set(declarations "")
  foreach(source IN LISTS sources)
    get_filename_component(name "${source}" NAME_WE)
    string(APPEND declarations "extern const Shader ${name};\n")
    set(binary "${generated}/${name}.spv")
    add_custom_command(
      OUTPUT "${generated}/${name}.cpp"
      DEPENDS "${source}" ${includes} "${CMAKE_SOURCE_DIR}/cmake/EmbedShader.cmake"
              "${CMAKE_SOURCE_DIR}/cmake/WordsOfFile.cmake" VERBATIM
      COMMAND "${DEFREC_GLSLANG}" --quiet --target-env vulkan1.2 "-I${folder}"
              "-I${CMAKE_SOURCE_DIR}" -o "${binary}" "${source}"
      COMMAND "${DEFREC_SPIRV_VAL}" --target-env vulkan1.2 "${binary}"
      COMMAND "${CMAKE_COMMAND}" -DNAME=${name} "-DBINARY=${binary}"
              "-DOUTPUT=${generated}/${name}.cpp" -P "${CMAKE_SOURCE_DIR}/cmake/EmbedShader.cmake"
      COMMENT "Shader ${name}")
    target_sources(${target} PRIVATE "${generated}/${name}.cpp")
  endforeach()
  file(CONFIGURE OUTPUT "${generated}/shaders.hpp" @ONLY CONTENT
       "// Generated: the shaders of the Vulkan backend.
#pragma once
#include \"backends/vulkan/shader.hpp\"
namespace defrec::vulkan::shaders {
@declarations@}
")
  target_include_directories(${target} PUBLIC "${generated}")
endfunction()
