# Run by CPack before it packs what it has installed: adds lintian's overrides to the packages that
# have some.
file(STRINGS "${CPACK_DEFREC_PACKAGING}/packages.txt" lines)
foreach(line IN LISTS lines)
  string(REGEX MATCH "^([^ ]+) ([^ ]+)$" line "${line}")
  set(overrides "${CPACK_DEFREC_PACKAGING}/lintian/${CMAKE_MATCH_1}")
  if(EXISTS "${overrides}")
    # Not INSTALL, which heeds the DESTDIR that CPack has left.
    file(
      COPY "${overrides}"
      DESTINATION
        "${CPACK_TEMPORARY_DIRECTORY}/${CMAKE_MATCH_2}${CPACK_PACKAGING_INSTALL_PREFIX}/share/lintian/overrides"
      FILE_PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)
  endif()
endforeach()
