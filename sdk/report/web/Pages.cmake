# Pages that are compiled in. Their scripts are bundled with packages of npm at build time; without
# node, npm or their registry a page is a plain one, which lacks what those packages draw.
find_program(DEFREC_NODE NAMES node nodejs)
find_program(DEFREC_NPM NAMES npm)

set(web "${CMAKE_CURRENT_LIST_DIR}")
set(packages "${CMAKE_CURRENT_BINARY_DIR}/web")
file(MAKE_DIRECTORY "${packages}")
define_property(GLOBAL PROPERTY DEFREC_PAGE_PACKAGES BRIEF_DOCS "the folder of node_modules")
set_property(GLOBAL PROPERTY DEFREC_PAGE_PACKAGES "${packages}")
# defrec_add_npm_packages(FOLDER PACKAGES STAMP)
# FOLDER: with package.json and package-lock.json. Makes a rule that installs them in the folder
# PACKAGES, and sets STAMP, the file that the rule touches.
function(defrec_add_npm_packages folder packages stamp)
  set(touched "${packages}/packages.stamp")
  if(EXISTS "${touched}" AND NOT EXISTS "${packages}/node_modules")
    file(REMOVE "${touched}") # npm failed; it is tried again after each configuration
  endif()
  set(install "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/InstallPackages.cmake")
  add_custom_command(
    OUTPUT "${touched}" VERBATIM DEPENDS "${folder}/package.json" "${folder}/package-lock.json"
                                         "${install}"
    COMMAND "${CMAKE_COMMAND}" "-DNPM=${DEFREC_NPM}" "-DWEB=${folder}" "-DPACKAGES=${packages}"
            "-DSTAMP=${touched}" -P "${install}" COMMENT "Installing packages of npm")
  set(${stamp} "${touched}" PARENT_SCOPE)
endfunction()

if(DEFREC_NODE AND DEFREC_NPM)
  defrec_add_npm_packages("${web}" "${packages}" stamp)
  add_custom_target(defrec_page_packages DEPENDS "${stamp}")
else()
  message(STATUS "Pages: without node and npm they have no 3D view and no plots")
endif()

# defrec_add_page(NAME FOLDER HEADER FUNCTION...)
# FOLDER: with index.html, main.js, main_plain.js and NAME.css, which comes after report.css. Sets
# NAME_page_source, the C++ source of functions that return the page's pieces, and
# NAME_plain_page_source, that of the page without packages of npm.
function(defrec_add_page name folder header)
  set(web "${CMAKE_CURRENT_FUNCTION_LIST_DIR}")
  get_property(packages GLOBAL PROPERTY DEFREC_PAGE_PACKAGES)
  set(styles "${web}/report.css" "${folder}/${name}.css")
  list(REMOVE_DUPLICATES styles)
  set(page "${CMAKE_CURRENT_BINARY_DIR}/page.html")
  set(plain_page "${CMAKE_CURRENT_BINARY_DIR}/plain_page.html")
  file(GLOB sources CONFIGURE_DEPENDS "${web}/*" "${folder}/*")
  add_custom_command(
    OUTPUT "${plain_page}" VERBATIM DEPENDS ${sources}
    COMMAND "${DEFREC_SYSTEM_PYTHON}" "${web}/plain_page.py" "${folder}" "${plain_page}" ${styles})
  if(TARGET defrec_page_packages)
    add_custom_command(
      OUTPUT "${page}" VERBATIM DEPENDS defrec_page_packages "${plain_page}" ${sources}
      COMMAND "${CMAKE_COMMAND}" "-DNODE=${DEFREC_NODE}" "-DPACKAGES=${packages}"
              "-DFOLDER=${folder}" "-DPLAIN_PAGE=${plain_page}" "-DPAGE=${page}" -P
              "${web}/BundlePage.cmake" COMMENT "Bundling the ${name} page")
  else()
    set(page "${plain_page}")
  endif()
  foreach(kind page plain_page)
    set(source "${CMAKE_CURRENT_BINARY_DIR}/${kind}.cpp")
    add_custom_command(
      OUTPUT "${source}" VERBATIM DEPENDS "${${kind}}" "${web}/embed_page.py"
      COMMAND "${DEFREC_SYSTEM_PYTHON}" "${web}/embed_page.py" "${${kind}}" "${header}" "${source}"
              ${ARGN})
    set(${name}_${kind}_source "${source}" PARENT_SCOPE)
  endforeach()
endfunction()
