# Installs the npm packages of the folder WEB in the folder PACKAGES, and leaves no node_modules
# there if that fails. cmake -DNPM= -DWEB= -DPACKAGES= -DSTAMP= -P this
file(COPY "${WEB}/package.json" "${WEB}/package-lock.json" DESTINATION "${PACKAGES}")
execute_process(
  COMMAND "${NPM}" ci --ignore-scripts --no-audit --no-fund --loglevel=error --fetch-retries=1
  WORKING_DIRECTORY "${PACKAGES}" RESULT_VARIABLE failed OUTPUT_QUIET ERROR_VARIABLE printed)
if(failed)
  file(REMOVE_RECURSE "${PACKAGES}/node_modules")
  message(
    WARNING
      "npm could not install the packages of ${WEB}: pages have no 3D view and no plots, tests "
      "that need them are skipped. The build after the next configuration tries again.\n${printed}")
endif()
file(TOUCH "${STAMP}")
