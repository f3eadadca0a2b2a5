# The headers under the compilers of Windows, as clang knows them: they compile without a warning,
# the structs have the layout of layout.txt, and every function and every pointer to one is __cdecl,
# whatever the application's compiler takes as the default. cmake -DCLANG= -DROOT= -DWORK= -P this;
# WORK is a folder for files.
cmake_minimum_required(VERSION 3.25)
set(abi "${ROOT}/sdk/abi")
file(MAKE_DIRECTORY "${WORK}")
# The headers use this much of the C library; the rest of what they include comes with clang.
file(WRITE "${WORK}/string.h" "#include <stddef.h>\n#ifdef __cplusplus\nextern \"C\"\n#endif\n"
                              "void *__cdecl memset(void *, int, size_t);\n")

function(compile result_variable output_variable)
  execute_process(COMMAND "${CLANG}" "-I${ROOT}" ${ARGN} RESULT_VARIABLE result
                  OUTPUT_VARIABLE output ERROR_VARIABLE error)
  set(${result_variable} "${result}" PARENT_SCOPE)
  set(${output_variable} "${output}${error}" PARENT_SCOPE)
endfunction()

function(expect_success)
  compile(result output ${ARGN})
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " arguments)
    message(FATAL_ERROR "clang ${arguments}\n${output}")
  endif()
endfunction()

set(plain -ffreestanding -fsyntax-only -Wall -Wextra -pedantic-errors -Werror "-I${WORK}")
set(targets x86_64-pc-windows-msvc i686-pc-windows-msvc aarch64-pc-windows-msvc
            x86_64-pc-windows-gnu)
foreach(target IN LISTS targets)
  foreach(standard IN ITEMS c99 c11)
    expect_success("--target=${target}" -x c "-std=${standard}" ${plain} "${abi}/header.c")
  endforeach()
  foreach(standard IN ITEMS c++11 c++20)
    expect_success("--target=${target}" -x c++ "-std=${standard}" ${plain} "${abi}/header.c")
  endforeach()
endforeach()
foreach(language IN ITEMS /TC /TP)
  expect_success(--driver-mode=cl --target=x86_64-pc-windows-msvc -Xclang -ffreestanding /Zs /W4
                 /WX "${language}" "-I${WORK}" -- "${abi}/header.c")
endforeach()

# layout.txt as assertions. It is that of 64 bits.
file(STRINGS "${abi}/layout.txt" lines)
set(checks "#include \"include/defrec_plugin.h\"\n")
set(count 0)
foreach(line IN LISTS lines)
  if(line MATCHES "^([a-z0-9_]+)\\.([a-z0-9_]+): ([0-9]+) at ([0-9]+)$")
    string(
      APPEND checks
      "_Static_assert(sizeof(((${CMAKE_MATCH_1} *)0)->${CMAKE_MATCH_2}) == ${CMAKE_MATCH_3} && "
      "offsetof(${CMAKE_MATCH_1}, ${CMAKE_MATCH_2}) == ${CMAKE_MATCH_4}, \"${line}\");\n")
  elseif(line MATCHES "^([a-z0-9_]+): ([0-9]+) bytes$")
    string(APPEND checks
           "_Static_assert(sizeof(${CMAKE_MATCH_1}) == ${CMAKE_MATCH_2}, \"${line}\");\n")
  elseif(line MATCHES "^([A-Z0-9_]+) = (-?[0-9]+)$")
    string(APPEND checks "_Static_assert(${CMAKE_MATCH_1} == ${CMAKE_MATCH_2}, \"${line}\");\n")
  else()
    message(
      FATAL_ERROR "${abi}/layout.txt: \"${line}\" is neither a field nor a struct nor a value")
  endif()
  math(EXPR count "${count} + 1")
endforeach()
if(count LESS 100)
  message(FATAL_ERROR "${abi}/layout.txt has ${count} lines")
endif()
file(WRITE "${WORK}/layout_checks.c" "${checks}")
foreach(target IN ITEMS x86_64-pc-windows-msvc aarch64-pc-windows-msvc x86_64-pc-windows-gnu)
  expect_success("--target=${target}" -std=c11 -ffreestanding -fsyntax-only "-I${WORK}"
                 "${WORK}/layout_checks.c")
endforeach()
file(WRITE "${WORK}/wrong_layout.c"
     "${checks}_Static_assert(sizeof(defrec_device_info) == 1, \"\");\n")
compile(result output --target=x86_64-pc-windows-msvc -std=c11 -ffreestanding -fsyntax-only
        "-I${WORK}" "${WORK}/wrong_layout.c")
if(result EQUAL 0)
  message(FATAL_ERROR "a wrong layout was not found")
endif()

# With -mrtd what names no calling convention is __stdcall on 32-bit x86, the one Windows where it
# matters.
set(dump --target=i686-pc-windows-msvc -mrtd -ffreestanding -fsyntax-only "-I${WORK}" -Xclang
         -ast-dump "${abi}/interface.c")
compile(result output ${dump})
if(NOT result EQUAL 0 OR NOT output MATCHES "FunctionDecl [^\n]*defrec_context_create [^\n]*cdecl")
  message(FATAL_ERROR "clang ${dump}\n${output}")
endif()
string(REGEX MATCHALL "[^\n]*Decl 0x[^\n]*stdcall[^\n]*" found "${output}")
if(found)
  list(JOIN found "\n" found)
  message(FATAL_ERROR "declared without DEFREC_CALL:\n${found}")
endif()
compile(result output ${dump} -D__cdecl=)
if(NOT output MATCHES "FieldDecl 0x[^\n]* wait [^\n]*stdcall")
  message(FATAL_ERROR "functions without a calling convention were not found")
endif()
