# What the binaries consist of, for the component list (packaging/component_list).
#
# defrec_component(NAME VERSION <version> LICENCE <SPDX expression> HOW linked|contained|tool FILE
#     <file of it> USED_BY <our parts>)
#   linked: a shared library, mapped when the program runs; contained: code of it is in our
#   binaries, whether they link it or not; tool: took part in building only
#
# defrec_version_from(HEADER REGEX VARIABLE)
# A version that a header states: what the first group of the regular expression matches.
function(defrec_component name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "VERSION;LICENCE;HOW;FILE" "USED_BY")
  foreach(field IN ITEMS VERSION LICENCE HOW FILE USED_BY)
    if(NOT arg_${field})
      message(FATAL_ERROR "component ${name}: ${field} is unknown")
    endif()
  endforeach()
  list(JOIN arg_USED_BY "\", \"" users)
  string(
    CONCAT
      entry
      "{\"name\": \"${name}\", \"version\": \"${arg_VERSION}\", \"licence\": \"${arg_LICENCE}\", "
      "\"how\": \"${arg_HOW}\", \"file\": \"${arg_FILE}\", \"used_by\": [\"${users}\"]}")
  set_property(GLOBAL APPEND PROPERTY DEFREC_COMPONENTS "${entry}")
endfunction()

function(defrec_version_from header regex variable)
  file(STRINGS "${header}" line REGEX "${regex}" LIMIT_COUNT 1)
  string(REGEX MATCH "${regex}" matched "${line}")
  set(${variable} "${CMAKE_MATCH_1}" PARENT_SCOPE)
endfunction()
