# Guides link to headers and samples as these lie in the source tree; leads the links to where they
# are installed.
#   docs: folder of the installed guides, samples beside them; headers: folder of the headers as
#   seen from there
file(GLOB guides "${docs}/*.md")
foreach(guide IN LISTS guides)
  file(READ "${guide}" text)
  string(REPLACE "](../samples/" "](samples/" linked "${text}")
  string(REPLACE "](../include/" "](${headers}/" linked "${linked}")
  if(NOT linked STREQUAL text)
    file(WRITE "${guide}" "${linked}")
  endif()
endforeach()
