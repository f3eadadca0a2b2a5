# Fails unless a library exports exactly the symbols that a file lists, one a line, sorted.
# cmake -DNM= -DLIBRARY= -DEXPECTED= -P this
cmake_minimum_required(VERSION 3.25)
execute_process(COMMAND "${NM}" -D --defined-only -P "${LIBRARY}" OUTPUT_VARIABLE printed RESULT_VARIABLE result)
string(REGEX MATCHALL "[^\n]+" lines "${printed}")
set(symbols "")
foreach(line IN LISTS lines)
  # "name@@version type value size"; type A is a version's own name.
  if(line MATCHES "^([^ @]+)[^ ]* ([A-Z])" AND NOT CMAKE_MATCH_2 STREQUAL "A")
    list(APPEND symbols "${CMAKE_MATCH_1}")
  endif()
endforeach()
list(SORT symbols)
list(JOIN symbols "\n" found)
file(READ "${EXPECTED}" expected)
if(NOT result EQUAL 0 OR NOT "${found}\n" STREQUAL expected)
  message(FATAL_ERROR "${LIBRARY} exports\n${found}\nexpected (${EXPECTED})\n${expected}")
endif()
