# Fails unless a library exports exactly the symbols that a file lists, one a line, sorted.
# cmake -DNM= -DOBJDUMP= -DLIBRARY= -DEXPECTED= -P this; OBJDUMP is for a DLL alone.
cmake_minimum_required(VERSION 3.25)
set(symbols "")
if(LIBRARY MATCHES "\\.dll$")
  execute_process(COMMAND "${OBJDUMP}" -p "${LIBRARY}" OUTPUT_VARIABLE printed
                  RESULT_VARIABLE result)
  # Brackets would join the elements of a list.
  string(REGEX REPLACE "[];[]" "|" printed "${printed}")
  # "|Ordinal/Name Pointer| Table", then lines "<tab>|   0| name", then an empty one.
  string(REGEX REPLACE "^.*\n.Ordinal/Name Pointer. Table[^\n]*\n" "" table "${printed}")
  string(REGEX REPLACE "\n\n.*$" "\n" table "${table}")
  string(REGEX MATCHALL "[^\n]+" lines "${table}")
  foreach(line IN LISTS lines)
    string(REGEX REPLACE "^.*[| ]([^| ]+)[ \r]*$" "\\1" symbol "${line}")
    list(APPEND symbols "${symbol}")
  endforeach()
else()
  execute_process(COMMAND "${NM}" -D --defined-only -P "${LIBRARY}" OUTPUT_VARIABLE printed
                  RESULT_VARIABLE result)
  string(REGEX MATCHALL "[^\n]+" lines "${printed}")
  foreach(line IN LISTS lines)
    # "name@@version type value size"; type A is a version's own name.
    if(line MATCHES "^([^ @]+)[^ ]* ([A-Z])" AND NOT CMAKE_MATCH_2 STREQUAL "A")
      list(APPEND symbols "${CMAKE_MATCH_1}")
    endif()
  endforeach()
endif()
list(SORT symbols)
list(JOIN symbols "\n" found)
file(READ "${EXPECTED}" expected)
if(NOT result EQUAL 0 OR NOT "${found}\n" STREQUAL expected)
  message(FATAL_ERROR "${LIBRARY} exports\n${found}\nexpected (${EXPECTED})\n${expected}")
endif()
