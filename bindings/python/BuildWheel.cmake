# Builds the wheel of a source tree, quietly and without a network.
#   cmake -DPYTHON= -DTREE= -DOUT= -DPROCESSOR= -DOBJDUMP= -P this
cmake_minimum_required(VERSION 3.25)
file(GLOB libraries "${TREE}/defrec/lib/*.so*")
execute_process(
  COMMAND "${PYTHON}" -B "${CMAKE_CURRENT_LIST_DIR}/wheel_platform.py" "${PROCESSOR}" "${OBJDUMP}"
          ${libraries} OUTPUT_VARIABLE platform OUTPUT_STRIP_TRAILING_WHITESPACE
                                                COMMAND_ERROR_IS_FATAL ANY)
execute_process(
  COMMAND "${CMAKE_COMMAND}" -E env --unset=PYTHONPATH "_PYTHON_HOST_PLATFORM=${platform}"
          "${PYTHON}" -m build --wheel --no-isolation --outdir "${OUT}" .
  WORKING_DIRECTORY "${TREE}" OUTPUT_VARIABLE printed ERROR_VARIABLE printed RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "The wheel could not be built:\n${printed}")
endif()
