# Writes the functions of the stub libdefrec from the prototypes of defrec_c.h.
# cmake -DHEADER=defrec_c.h -DOUT=stub.cpp -P this
#
# The stub stands in for libdefrec in the tests of a binding: it computes nothing, and writes down how it was called. Functions are made from
# the prototypes, so that none is forgotten and none is called with arguments that the header does not have; a prototype that this file
# does not understand fails the build. What a call does is stub_call.cpp; what a test may ask of the stub is stub.h.
#
# Each call is one line, name and arguments in the header's order, for example
#   defrec_job_wait(job=0x1003, timeout_ns=18446744073709551615)
#   defrec_stage_create(context=0x1001, device_id="cpu", stage=1, params=4c00000040010000..., out=0x1002)
#   integer                    decimal, as the declared type
#   handle                     hexadecimal; NULL
#   const char *               in quotes, unchanged; NULL
#   const struct *             struct_size bytes in hexadecimal; NULL. Nothing behind the pointers in it.
#   const double *             [1.5, 2], as many as the call's count says: two each for names that end in uv, three for xyz; NULL
#   const defrec_*_buffer *    [size, size, ...] in bytes, NULL for one without data
#   handle *                   the handle that was made, "untouched" where the call failed; NULL
#   struct *                   {struct_size}; NULL
#   double *, uint8_t *        "written", "untouched" where the call failed; NULL
cmake_minimum_required(VERSION 3.25)
file(READ "${HEADER}" text)
# Neither semicolons nor brackets survive in CMake's lists.
string(REGEX REPLACE "/\\*([^*]|\\*+[^*/])*\\*+/" "" text "${text}")
string(REGEX REPLACE "#[^\n]*\n" "" text "${text}")
string(REGEX REPLACE "\\[[^]]*\\]" "" text "${text}")
string(REPLACE ";" "@" text "${text}")
string(REGEX REPLACE "[ \t\r\n]+" " " text "${text}")

set(handles "")
string(REGEX MATCHALL "typedef struct [a-z_0-9]+ \\*[a-z_0-9]+@" typedefs "${text}")
foreach(typedef IN LISTS typedefs)
  string(REGEX REPLACE ".*\\*([a-z_0-9]+)@" "\\1" handle "${typedef}")
  list(APPEND handles "${handle}")
endforeach()

set(structs "")
string(REGEX MATCHALL "typedef struct [a-z_0-9]+ { uint32_t struct_size@" typedefs "${text}")
foreach(typedef IN LISTS typedefs)
  string(REGEX REPLACE "typedef struct ([a-z_0-9]+) .*" "\\1" struct "${typedef}")
  list(APPEND structs "${struct}")
endforeach()

# In variable code: what the stub does with one parameter.
function(read_parameter prototype type name parameters)
  set(element 1)
  if(name MATCHES "uv$")
    set(element 2)
  elseif(name MATCHES "xyz$")
    set(element 3)
  endif()
  string(REGEX REPLACE " ?\\*$" "" pointed "${type}")
  string(REGEX REPLACE "^const " "" plain "${pointed}")
  set(kind "")
  set(more "")
  if(type MATCHES "^(u?int32_t|u?int64_t|size_t|defrec_status)$")
    set(kind integer)
  elseif(type IN_LIST handles)
    set(kind handle)
  elseif(type STREQUAL "const char *")
    set(kind text)
  elseif(type STREQUAL "const void *" OR (type MATCHES "^const [a-z_0-9]+ \\*$" AND plain IN_LIST structs))
    set(kind structure)
  elseif(type MATCHES "^const defrec_(const_)?buffer \\*$" AND parameters MATCHES "\\*${name}, size_t ${name}_count")
    set(kind buffers)
    set(more ", ${name}_count")
  elseif(type STREQUAL "const double *" AND element GREATER 1 AND parameters MATCHES "size_t count")
    set(kind doubles)
    set(more ", ${element} * count")
  elseif(type MATCHES "\\*$" AND pointed IN_LIST handles)
    set(kind made_handle)
  elseif(type MATCHES "\\*$" AND pointed IN_LIST structs)
    set(kind made_structure)
  elseif(type MATCHES "^(double|uint8_t) \\*$" AND parameters MATCHES "size_t count")
    set(kind made_array)
    set(more ", ${element} * count")
  else()
    message(FATAL_ERROR "GenerateStub.cmake does not understand the parameter ${type} ${name} of\n  ${prototype}")
  endif()
  set(code "    call.${kind}(\"${name}\", ${name}${more});\n" PARENT_SCOPE)
endfunction()

set(functions "")
string(REGEX MATCHALL "DEFREC_API [^@]*@" prototypes "${text}")
foreach(prototype IN LISTS prototypes)
  string(REPLACE "@" "" prototype "${prototype}")
  if(NOT prototype MATCHES "^DEFREC_API ([a-z_0-9 ]+[ *]) ?DEFREC_CALL (defrec_[a-z_0-9]+)\\(([^()]*)\\)$")
    message(FATAL_ERROR "GenerateStub.cmake does not understand\n  ${prototype}")
  endif()
  set(name "${CMAKE_MATCH_2}")
  set(parameters "${CMAKE_MATCH_3}")
  string(STRIP "${CMAKE_MATCH_1}" result)
  set(body "    Call call(\"${name}\");\n")
  if(NOT parameters STREQUAL "void")
    string(REPLACE ", " ";" list "${parameters}")
    foreach(parameter IN LISTS list)
      if(NOT parameter MATCHES "^(.*[ *])([a-z_0-9]+)$")
        message(FATAL_ERROR "GenerateStub.cmake does not understand the parameter ${parameter} of\n  ${prototype}")
      endif()
      set(argument "${CMAKE_MATCH_2}")
      string(STRIP "${CMAKE_MATCH_1}" type)
      read_parameter("${prototype}" "${type}" "${argument}" "${parameters}")
      string(APPEND body "${code}")
    endforeach()
  endif()
  if(result STREQUAL "defrec_status")
    string(APPEND body "    return call.status();\n")
  elseif(result STREQUAL "size_t")
    string(APPEND body "    return call.count();\n")
  elseif(result STREQUAL "const char *")
    string(APPEND body "    return call.message();\n")
  elseif(result STREQUAL "uint32_t" AND name STREQUAL "defrec_version")
    string(APPEND body "    return call.version();\n")
  elseif(NOT result STREQUAL "void")
    message(FATAL_ERROR "GenerateStub.cmake does not understand what this returns:\n  ${prototype}")
  endif()
  string(APPEND functions "\n${prototype} {\n${body}}\n")
endforeach()

file(WRITE "${OUT}" "// Made by GenerateStub.cmake.
#include \"bindings/stub/stub_call.hpp\"

using defrec::stub::Call;
${functions}")
