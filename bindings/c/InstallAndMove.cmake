# Installs a build folder to one folder and moves that to another. cmake -DBUILD= -DFIRST= -DMOVED=
# -P this
cmake_minimum_required(VERSION 3.25)
get_filename_component(work "${FIRST}" DIRECTORY)
file(REMOVE_RECURSE "${work}")
execute_process(COMMAND "${CMAKE_COMMAND}" --install "${BUILD}" --prefix "${FIRST}"
                OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
file(RENAME "${FIRST}" "${MOVED}")
