# defrec_add_assembly(TARGET FILE SOURCES ... [REFERENCES target...] [LIBRARIES name...] [OPTIONS
#     ...])
# FILE, a .dll or an .exe in the current build folder, compiled by Mono's mcs as part of `all`; its
# path is TARGET's property ASSEMBLY. REFERENCES are targets of this function, copied beside FILE,
# where the runtime looks for them; LIBRARIES names or paths of assemblies that are there already.
function(defrec_add_assembly target file)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "" "SOURCES;REFERENCES;LIBRARIES;OPTIONS")
  set(assembly "${CMAKE_CURRENT_BINARY_DIR}/${file}")
  set(kind exe)
  if(file MATCHES "\\.dll$")
    set(kind library)
  endif()
  get_filename_component(folder "${assembly}" DIRECTORY)
  set(references "")
  set(copies "")
  foreach(reference IN LISTS arg_REFERENCES)
    get_target_property(path ${reference} ASSEMBLY)
    list(APPEND references "${path}")
    get_filename_component(referenced_folder "${path}" DIRECTORY)
    if(NOT referenced_folder STREQUAL folder)
      file(RELATIVE_PATH place "${CMAKE_BINARY_DIR}" "${folder}")
      string(MAKE_C_IDENTIFIER "${reference}_in_${place}" copy)
      list(APPEND copies ${copy})
      if(NOT TARGET ${copy})
        get_filename_component(name "${path}" NAME)
        add_custom_command(
          OUTPUT "${folder}/${name}" VERBATIM DEPENDS "${path}"
          COMMAND "${CMAKE_COMMAND}" -E copy "${path}" "${folder}/${name}"
          COMMENT "Copying ${name} to ${place}")
        add_custom_target(${copy} DEPENDS "${folder}/${name}")
        add_dependencies(${copy} ${reference})
      endif()
    endif()
  endforeach()
  list(TRANSFORM references PREPEND "-reference:" OUTPUT_VARIABLE options)
  list(TRANSFORM arg_LIBRARIES PREPEND "-reference:")
  add_custom_command(
    OUTPUT "${assembly}" VERBATIM DEPENDS ${arg_SOURCES} ${references}
    COMMAND "${DEFREC_MCS}" -nologo -target:${kind} -langversion:7 -warn:4 -warnaserror
            ${arg_OPTIONS} ${options} ${arg_LIBRARIES} "-out:${assembly}" ${arg_SOURCES}
    COMMENT "Compiling ${file}")
  add_custom_target(${target} ALL DEPENDS "${assembly}")
  if(arg_REFERENCES)
    add_dependencies(${target} ${arg_REFERENCES} ${copies})
  endif()
  set_target_properties(${target} PROPERTIES ASSEMBLY "${assembly}")
endfunction()
