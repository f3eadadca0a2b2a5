# Fails unless abidiff finds a library made from interface.c to be what was recorded.
# cmake -DABIDIFF= -DLIBRARY= -DEXPECTED=interface.abi -P this
cmake_minimum_required(VERSION 3.25)
# Its exit code is a mask: 1 error, 2 usage, 4 change, 8 incompatible change.
execute_process(COMMAND "${ABIDIFF}" --no-corpus-path --no-show-locs "${EXPECTED}" "${LIBRARY}"
                OUTPUT_VARIABLE printed ERROR_VARIABLE printed RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(
    FATAL_ERROR
      "The ABI is not the one recorded (abidiff: ${result}). What was added may be recorded "
      "(docs/api/abi.md); nothing else may change.\n${printed}")
endif()
