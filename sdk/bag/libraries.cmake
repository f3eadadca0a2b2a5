# Libraries that read bags, for whoever compiles the sources: defrec_bag_compression and
# defrec_bag_sqlite. lz4 and zstd of chunks, and SQLite, where their development packages are
# installed.
find_package(PkgConfig REQUIRED)
find_package(ZLIB REQUIRED)
pkg_check_modules(DEFREC_LZ4 QUIET IMPORTED_TARGET liblz4)
pkg_check_modules(DEFREC_ZSTD QUIET IMPORTED_TARGET libzstd)
pkg_check_modules(DEFREC_SQLITE QUIET IMPORTED_TARGET sqlite3)

add_library(defrec_bag_compression INTERFACE)
target_link_libraries(defrec_bag_compression INTERFACE ZLIB::ZLIB)
list(GET ZLIB_LIBRARIES 0 zlib)
defrec_component(libz VERSION "${ZLIB_VERSION_STRING}" LICENCE Zlib HOW linked FILE "${zlib}"
                 USED_BY defrec)
set(names lz4 zstd)
set(packages LZ4 ZSTD)
set(licences BSD-2-Clause BSD-3-Clause)
foreach(name package licence IN ZIP_LISTS names packages licences)
  if(NOT DEFREC_${package}_FOUND)
    message(STATUS "Bags: without chunks by ${name} (Debian: lib${name}-dev)")
    continue()
  endif()
  target_link_libraries(defrec_bag_compression INTERFACE PkgConfig::DEFREC_${package})
  target_compile_definitions(defrec_bag_compression INTERFACE DEFREC_WITH_${package})
  find_library(DEFREC_LIBRARY_${name} ${name} REQUIRED)
  defrec_component(${name} VERSION "${DEFREC_${package}_VERSION}" LICENCE ${licence} HOW linked
                   FILE "${DEFREC_LIBRARY_${name}}" USED_BY defrec)
endforeach()

add_library(defrec_bag_sqlite INTERFACE)
if(DEFREC_SQLITE_FOUND)
  target_link_libraries(defrec_bag_sqlite INTERFACE PkgConfig::DEFREC_SQLITE)
  target_compile_definitions(defrec_bag_sqlite INTERFACE DEFREC_WITH_SQLITE)
  find_library(DEFREC_LIBRARY_sqlite3 sqlite3 REQUIRED)
  defrec_component(sqlite3 VERSION "${DEFREC_SQLITE_VERSION}" LICENCE blessing HOW linked
                   FILE "${DEFREC_LIBRARY_sqlite3}" USED_BY defrec)
else()
  message(STATUS "Bags: without SQLite files (Debian: libsqlite3-dev)")
endif()
