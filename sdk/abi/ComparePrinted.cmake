# Fails unless a program prints exactly what a file holds. cmake -DPROGRAM= -DEXPECTED= -P this;
# PROGRAM may begin with what runs it.
cmake_minimum_required(VERSION 3.25)
execute_process(COMMAND ${PROGRAM} OUTPUT_VARIABLE printed RESULT_VARIABLE result)
string(REPLACE "\r\n" "\n" printed "${printed}")
file(READ "${EXPECTED}" expected)
if(NOT result EQUAL 0 OR NOT printed STREQUAL expected)
  list(GET PROGRAM -1 program)
  file(WRITE "${program}.printed" "${printed}")
  execute_process(COMMAND diff -u "${EXPECTED}" "${program}.printed" OUTPUT_VARIABLE difference)
  message(
    FATAL_ERROR
      "The ABI changed. Lines may only be added (docs/api/abi.md); if that is so, add them to "
      "${EXPECTED}.\n${difference}")
endif()
