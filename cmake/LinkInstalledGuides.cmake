# Guides link to headers and samples as these lie in the source tree; leads the links to where they
# are installed.
#   docs: folder of the installed guides, samples beside them; headers: folder of the headers as
#   seen from there
file(GLOB_RECURSE guides "${docs}/*.md")
foreach(guide IN LISTS guides)
  file(READ "${guide}" text)
  set(linked "${text}")
  foreach(above IN ITEMS "" "../") # of guides in docs/ and in a folder of it
    string(REPLACE "](${above}../samples/" "](${above}samples/" linked "${linked}")
    string(REPLACE "](${above}../include/" "](${above}${headers}/" linked "${linked}")
  endforeach()
  if(NOT linked STREQUAL text)
    file(WRITE "${guide}" "${linked}")
  endif()
endforeach()
