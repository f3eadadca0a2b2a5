# Fails unless a program prints exactly what a file holds. cmake -DPROGRAM= -DEXPECTED= -P this
cmake_minimum_required(VERSION 3.25)
execute_process(COMMAND "${PROGRAM}" OUTPUT_VARIABLE printed RESULT_VARIABLE result)
file(READ "${EXPECTED}" expected)
if(NOT result EQUAL 0 OR NOT printed STREQUAL expected)
  file(WRITE "${PROGRAM}.printed" "${printed}")
  execute_process(COMMAND diff -u "${EXPECTED}" "${PROGRAM}.printed" OUTPUT_VARIABLE difference)
  message(FATAL_ERROR "The ABI changed. Lines may only be added (docs/abi.md); if that is so, add them to ${EXPECTED}.\n${difference}")
endif()
