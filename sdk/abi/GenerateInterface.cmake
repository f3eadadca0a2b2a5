# Writes a C library whose debug information holds the signature of every exported function and the type of every struct and callback of
# the public headers, and nothing of the inside: what abidiff compares.
# cmake -DINCLUDE=defrec_plugin.h -DEXPORTS=exports_libdefrec.txt -DLAYOUT=layout.txt -DOUT=interface.c -P this
cmake_minimum_required(VERSION 3.25)
file(STRINGS "${EXPORTS}" functions)
file(STRINGS "${LAYOUT}" fields REGEX "^[a-z_0-9]+\\.")
set(structs "")
foreach(field IN LISTS fields)
  string(REGEX REPLACE "\\..*" "" struct "${field}")
  list(APPEND structs "${struct}")
endforeach()
list(REMOVE_DUPLICATES structs)

set(lines "")
foreach(function IN LISTS functions)
  string(APPEND lines "__typeof__(&${function}) signature_of_${function};\n")
endforeach()
foreach(struct IN LISTS structs)
  string(APPEND lines "${struct} layout_of_${struct};\n")
endforeach()
file(WRITE "${OUT}" "/* Made by GenerateInterface.cmake. */
#include \"${INCLUDE}\"
${lines}defrec_plugin_entry_fn signature_of_defrec_plugin_entry_v1;
")
