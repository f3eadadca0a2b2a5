# Writes the manifest of a plugin beside it. cmake -DNAME= -DVERSION= -DLIBRARY= [-DABI_MAJOR=]
# [-DABI_MINOR=] -P this
if(NOT DEFINED ABI_MAJOR)
  set(ABI_MAJOR 1)
endif()
if(NOT DEFINED ABI_MINOR)
  set(ABI_MINOR 0) # DEFREC_PLUGIN_ABI_MINOR
endif()
file(SHA256 "${LIBRARY}" hash)
get_filename_component(file "${LIBRARY}" NAME)
string(REGEX REPLACE "\\.(so|dll)$" ".json" manifest "${LIBRARY}")
file(
  WRITE "${manifest}"
  "{
  \"name\": \"${NAME}\",
  \"version\": \"${VERSION}\",
  \"library\": \"${file}\",
  \"abi_major\": ${ABI_MAJOR},
  \"abi_minor\": ${ABI_MINOR},
  \"sha256\": \"${hash}\"
}
")
