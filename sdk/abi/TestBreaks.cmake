# Breaks a copy of the headers, and a copy of the library, on purpose, and fails unless the test
# that is there for it fails and says where. cmake -DHEADERS_FOLDER= -DABI_FOLDER= -DWORK= -DCC=
# -DCXX= -DNM= -DABIDIFF= (or empty) "-DLINK=what the library is linked from" -P this
cmake_minimum_required(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE result OUTPUT_VARIABLE printed
                  ERROR_VARIABLE printed)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${ARGV}\n${printed}")
  endif()
endfunction()

# expect(NAME PATTERN COMMAND...): the command fails, and its output matches; with "" for the
# pattern it succeeds.
function(expect name pattern)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE printed
                  ERROR_VARIABLE printed)
  if(pattern STREQUAL "" AND NOT result EQUAL 0)
    message(FATAL_ERROR "${name}: fails without a break\n${printed}")
  elseif(NOT pattern STREQUAL "" AND (result EQUAL 0 OR NOT printed MATCHES "${pattern}"))
    message(
      FATAL_ERROR
        "${name}: the break was not found (result ${result}, expected to match ${pattern})\n"
        "${printed}")
  endif()
  message(STATUS "${name}: as expected")
endfunction()

# copy_headers(FOLDER [FROM TO]): into FOLDER/include, with one text in defrec_c.h replaced.
function(copy_headers folder)
  file(REMOVE_RECURSE "${folder}")
  file(COPY "${HEADERS_FOLDER}/" DESTINATION "${folder}/include")
  if(ARGC GREATER 1)
    file(READ "${folder}/include/defrec_c.h" whole)
    string(REGEX REPLACE "${ARGV1}" "${ARGV2}" broken "${whole}")
    if(whole STREQUAL broken)
      message(FATAL_ERROR "nothing in defrec_c.h matches ${ARGV1}")
    endif()
    file(WRITE "${folder}/include/defrec_c.h" "${broken}")
  endif()
endfunction()

# check_layout(NAME PATTERN FOLDER), check_interface(NAME PATTERN FOLDER): what sdk/abi/layout and
# sdk/abi/interface do, with those headers.
function(check_layout name pattern folder)
  run("${CC}" "-I${folder}" "${ABI_FOLDER}/layout.c" -o "${folder}/layout")
  expect("${name}" "${pattern}" "${CMAKE_COMMAND}" "-DPROGRAM=${folder}/layout"
         "-DEXPECTED=${ABI_FOLDER}/layout.txt" -P "${ABI_FOLDER}/ComparePrinted.cmake")
endfunction()
function(check_interface name pattern folder)
  if(NOT ABIDIFF)
    return()
  endif()
  run("${CC}" -g -shared -fPIC "-I${folder}" "${ABI_FOLDER}/interface.c" -o
      "${folder}/libinterface.so")
  expect("${name}" "${pattern}" "${CMAKE_COMMAND}" "-DABIDIFF=${ABIDIFF}"
         "-DLIBRARY=${folder}/libinterface.so" "-DEXPECTED=${ABI_FOLDER}/interface.abi" -P
         "${ABI_FOLDER}/CompareInterface.cmake")
endfunction()
# check_released(NAME PATTERN RELEASED): what sdk/abi/layout_<release> does with that layout.
function(check_released name pattern released)
  expect("${name}" "${pattern}" "${CMAKE_COMMAND}" "-DRELEASED=${released}"
         "-DPRESENT=${ABI_FOLDER}/layout.txt" -P "${ABI_FOLDER}/CompareReleased.cmake")
endfunction()
# check_exports(NAME PATTERN HIDDEN ADDED): the library without the function HIDDEN, with the
# function ADDED
function(check_exports name pattern hidden added)
  file(WRITE "${WORK}/exports.map" "DEFREC_1 { global: defrec_*; local: ${hidden} *; };\n")
  file(WRITE "${WORK}/added.c" "${added}")
  run("${CC}" -c -fPIC "${WORK}/added.c" -o "${WORK}/added.o")
  run("${CXX}" -shared "-Wl,--version-script,${WORK}/exports.map" "${WORK}/added.o" ${LINK} -o
      "${WORK}/libdefrec.so")
  expect("${name}" "${pattern}" "${CMAKE_COMMAND}" "-DNM=${NM}" "-DLIBRARY=${WORK}/libdefrec.so"
         "-DEXPECTED=${ABI_FOLDER}/exports_libdefrec.txt" -P "${ABI_FOLDER}/CompareExports.cmake")
endfunction()

string(REPLACE "," ";" LINK "${LINK}")

copy_headers("${WORK}/whole")
check_layout("layout, unbroken" "" "${WORK}/whole")
check_interface("abidiff, unbroken" "" "${WORK}/whole")
check_exports("exports, unbroken" "" "" "")

file(STRINGS "${ABI_FOLDER}/layout.txt" lines)
list(REMOVE_AT lines 7 -1)
list(JOIN lines "\n" released)
file(WRITE "${WORK}/released.txt" "${released}\n")
check_released("a release with less in it" "" "${WORK}/released.txt")
file(APPEND "${WORK}/released.txt" "DEFREC_ERROR_BUSY = -19\n")
check_released("a release, an enumerator renumbered since" "DEFREC_ERROR_BUSY = -19"
               "${WORK}/released.txt")

copy_headers("${WORK}/field" "typedef struct defrec_image {"
             "typedef struct defrec_image { uint64_t inserted;")
check_layout("layout, a field inserted" "defrec_image.struct_size: 4 at 8" "${WORK}/field")
check_interface("abidiff, a field inserted" "defrec_image" "${WORK}/field")

copy_headers("${WORK}/value" "DEFREC_ERROR_BUSY( *)= -9" "DEFREC_ERROR_BUSY\\1= -19")
check_layout("layout, an enumerator renumbered" "DEFREC_ERROR_BUSY = -19" "${WORK}/value")

copy_headers("${WORK}/parameter" "defrec_job_wait\\(defrec_job job, uint64_t timeout_ns\\)"
             "defrec_job_wait(defrec_job job, uint32_t timeout_ns)")
check_interface("abidiff, a parameter narrowed" "signature_of_defrec_job_wait" "${WORK}/parameter")

# The other type has the same size, so that the layout does not tell.
copy_headers("${WORK}/type" "int64_t( +)timestamp_ns; ( */\\*+<? +strictly)"
             "uint64_t\\1timestamp_ns; \\2")
check_layout("layout, a sign lost" "" "${WORK}/type")
check_interface("abidiff, a sign lost" "timestamp_ns" "${WORK}/type")

check_exports("exports, a function gone" "defrec_job_wait" "defrec_job_wait;" "")
check_exports("exports, a function too many" "defrec_job_peek" ""
              "int defrec_job_peek(void) { return 0; }")
