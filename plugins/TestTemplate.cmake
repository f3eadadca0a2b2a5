# The guide of docs/plugins.md from its beginning: installs the SDK, moves it to show that it can be moved, and builds, examines
# and installs the template against it, from a folder of its own. cmake -DBUILD= -DWORK= -P this
cmake_minimum_required(VERSION 3.25)

function(step what)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY "${WORK}" RESULT_VARIABLE result OUTPUT_VARIABLE printed ERROR_VARIABLE printed)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${what} ended with ${result}:\n${printed}")
  endif()
endfunction()

file(REMOVE_RECURSE "${WORK}")
file(MAKE_DIRECTORY "${WORK}")
set(sdk "${WORK}/sdk")
set(plugin "${WORK}/my_plugin")

step("installing the SDK" "${CMAKE_COMMAND}" --install "${BUILD}" --prefix "${WORK}/installed")
file(RENAME "${WORK}/installed" "${sdk}")
file(COPY "${sdk}/share/defrec/plugin_template/" DESTINATION "${plugin}")
foreach(change IN ITEMS "CMakeLists.txt|NAME example|NAME mine" "plugin.cpp|table.name = \"example\"|table.name = \"mine\""
    "plugin.cpp|info.id = \"example\"|info.id = \"mine\"")
  string(REPLACE "|" ";" change "${change}")
  list(GET change 0 file)
  list(GET change 1 before)
  list(GET change 2 after)
  step("renaming in ${file}" sed -i "s/${before}/${after}/" "${plugin}/${file}")
endforeach()
step("configuring the template" "${CMAKE_COMMAND}" -S "${plugin}" -B "${plugin}/build" "-DCMAKE_PREFIX_PATH=${sdk}")
step("building the template" "${CMAKE_COMMAND}" --build "${plugin}/build")

set(examine "${sdk}/bin/defrec-conformance" --plugin "${plugin}/build/defrec_plugin_mine.json" --out "${plugin}/report")
step("the abi tier" ${examine} --tier abi)
step("installing the plugin" "${CMAKE_COMMAND}" --install "${plugin}/build" --prefix "${sdk}")
step("the installed plugin" "${sdk}/bin/defrec-conformance" --backend mine --tier abi --smoke --out "${plugin}/report")
