# Builds the wheel of a source tree, quietly and without a network. cmake -DPYTHON= -DTREE= -DOUT= -DPLATFORM= -P this
cmake_minimum_required(VERSION 3.25)
execute_process(COMMAND "${CMAKE_COMMAND}" -E env --unset=PYTHONPATH "_PYTHON_HOST_PLATFORM=${PLATFORM}" "${PYTHON}" -m build --wheel --no-isolation --outdir "${OUT}" .
  WORKING_DIRECTORY "${TREE}" OUTPUT_VARIABLE printed ERROR_VARIABLE printed RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "The wheel could not be built:\n${printed}")
endif()
