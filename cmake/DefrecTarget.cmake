# What every target of the project is built with.
# Debian's folder of libraries (lib/x86_64-linux-gnu) under any prefix, so that one build serves its
# packages and any other folder.
if(CMAKE_LIBRARY_ARCHITECTURE)
  # STRING: CMake would make an absolute path of a PATH that is given on the command line.
  set(CMAKE_INSTALL_LIBDIR "lib/${CMAKE_LIBRARY_ARCHITECTURE}"
      CACHE STRING "Folder of libraries, below the prefix")
endif()
include(GNUInstallDirs)

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_C_STANDARD 99)
set(CMAKE_C_STANDARD_REQUIRED ON)
set(CMAKE_C_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_C_VISIBILITY_PRESET hidden)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

# A plugin is found in the folder beside the library, so all binaries share one folder per kind.
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/bin")
if(WIN32)
  # There a program finds its libraries beside it.
  set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/lib")
endif()
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/lib")
set(CMAKE_ARCHIVE_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/lib")

find_program(DEFREC_CCACHE ccache)
if(DEFREC_CCACHE)
  set(CMAKE_C_COMPILER_LAUNCHER "${DEFREC_CCACHE}")
  set(CMAKE_CXX_COMPILER_LAUNCHER "${DEFREC_CCACHE}")
  set(CMAKE_CUDA_COMPILER_LAUNCHER "${DEFREC_CCACHE}")
endif()

add_compile_options(
  $<$<COMPILE_LANGUAGE:C,CXX>:-Wall$<SEMICOLON>-Wextra$<SEMICOLON>-Wpedantic$<SEMICOLON>-Wshadow$<SEMICOLON>-Werror>
)
# Contraction would make a result depend on the compiler and the instruction set; docs/numerics.md.
add_compile_options($<$<COMPILE_LANGUAGE:C,CXX>:-ffp-contract=off>)
# Eigen packs what it multiplies on the stack, 128 KiB at a time unless told otherwise, and threads
# that call the library need 64 KiB (docs/api/threading.md).
add_compile_definitions($<$<COMPILE_LANGUAGE:CXX,CUDA>:EIGEN_STACK_ALLOCATION_LIMIT=8192>)
# On ARM, g++ 12.2 adds masks, -1 where true, for a sum of comparisons, when it makes vectors of
# straight-line code (the bin of an angle in stage orb was negative). Loops it makes vectors of
# correctly.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|ARM64" AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  add_compile_options($<$<COMPILE_LANGUAGE:C,CXX>:-fno-tree-slp-vectorize>)
endif()
# What has debug information, and is meant for others, does not tell where it was built.
add_compile_options(
  "$<$<AND:$<CONFIG:RelWithDebInfo>,$<COMPILE_LANGUAGE:C,CXX>>:-ffile-prefix-map=${CMAKE_BINARY_DIR}=build;-ffile-prefix-map=${CMAKE_SOURCE_DIR}=.>"
)
if(DEFREC_SANITIZE)
  add_compile_options(-fsanitize=${DEFREC_SANITIZE} -fno-omit-frame-pointer
                      -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${DEFREC_SANITIZE})
  # Instrumented code keeps GCC from seeing that libstdc++'s <regex> sets what it reads.
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-Wno-maybe-uninitialized>)
  endif()
else()
  add_link_options(-Wl,--no-undefined -Wl,--as-needed)
endif()

find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)

# defrec_pick_system(VARIABLE): leaves out of a list of sources those for another operating system,
# *_posix.cpp or *_windows.cpp, and tests, *_posix_test.cpp or *_windows_test.cpp.
function(defrec_pick_system variable)
  set(other windows)
  if(WIN32)
    set(other posix)
  endif()
  set(sources ${${variable}})
  list(FILTER sources EXCLUDE REGEX "_${other}(_test)?\\.cpp$")
  set(${variable} ${sources} PARENT_SCOPE)
endfunction()

# defrec_install_program(TARGET): into the folder of programs; it finds libdefrec from there,
# wherever the whole lies.
function(defrec_install_program target)
  file(RELATIVE_PATH libraries "/${CMAKE_INSTALL_BINDIR}" "/${CMAKE_INSTALL_LIBDIR}")
  # The build tree's lies in ../lib. A path that is changed at installation ends with an empty entry
  # until then, which stands for the current folder.
  set(paths "$ORIGIN/${libraries}" "$ORIGIN/../lib")
  list(REMOVE_DUPLICATES paths)
  set_target_properties(${target} PROPERTIES BUILD_WITH_INSTALL_RPATH ON INSTALL_RPATH "${paths}")
  install(TARGETS ${target} RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT tools)
endfunction()
