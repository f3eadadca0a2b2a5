# Bundles the page, or takes the plain one where npm could not install the packages.
# cmake -DNODE= -DPACKAGES= -DFOLDER= -DPLAIN_PAGE= -DPAGE= -P this
if(EXISTS "${PACKAGES}/node_modules")
  execute_process(COMMAND "${NODE}" "${CMAKE_CURRENT_LIST_DIR}/build.mjs" "${PACKAGES}" "${FOLDER}"
                          "${PAGE}" COMMAND_ERROR_IS_FATAL ANY)
else()
  file(COPY_FILE "${PLAIN_PAGE}" "${PAGE}")
endif()
