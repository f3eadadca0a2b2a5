# defrec_add_tests(TARGET SOURCES <name>_test.cpp... [LONG <name>_test.cpp...] [SLOW
# <name>_test.cpp...]
#                  [LIBRARIES ...] [LABELS ...] [DEFINITIONS ...])
# One doctest program, and in ctest one test for each source file, named after its path without
# _test. SLOW: those of the sources whose tests are slow, see below. LONG: those whose tests take
# longer than ten seconds and are not slow.
#
# In a build for another machine these run by CMAKE_CROSSCOMPILING_EMULATOR. Left out there are
# tests in which this machine's compilers and interpreters use what was built: of the bindings, of
# the packages, of the samples. DEFREC_EMULATED_ROOT is what the emulator calls this machine's root
# folder, where it has another name.
#
# Tests are built where all that they need is installed, which is more than the programs need:
# DEFREC_BUILD_TESTS is OFF elsewhere.
if(DEFREC_BUILD_TESTS AND NOT EXISTS "${CMAKE_SOURCE_DIR}/cmake/test_main.cpp")
  message(STATUS "Tests: left out, this is a tarball without them")
  set(DEFREC_BUILD_TESTS OFF)
endif()
if(DEFREC_BUILD_TESTS)
  find_package(doctest QUIET)
  find_package(Boost QUIET COMPONENTS context)
  find_package(Doxygen 1.9.4 QUIET)
  find_program(DEFREC_MCS mcs)
  find_program(DEFREC_MONO mono)
  find_program(DEFREC_NUGET nuget)
  find_file(DEFREC_NUNIT nunit.framework.dll PATHS /usr/lib/cli/nunit.framework-2.6.3
            NO_DEFAULT_PATH NO_CMAKE_FIND_ROOT_PATH)
  find_program(DEFREC_MYPY mypy PATHS /usr/bin NO_DEFAULT_PATH)
  set(missing "")
  set(all_needed doctest_FOUND Boost_FOUND DOXYGEN_FOUND DEFREC_MCS DEFREC_MONO DEFREC_NUGET
                 DEFREC_NUNIT DEFREC_MYPY)
  if(WIN32)
    set(all_needed doctest_FOUND)
  endif()
  foreach(needed IN LISTS all_needed)
    if(NOT ${needed})
      list(APPEND missing ${needed})
    endif()
  endforeach()
  if(missing)
    string(REGEX REPLACE "_FOUND|DEFREC_" "" missing "${missing}")
    list(JOIN missing ", " missing)
    string(TOLOWER "${missing}" missing)
    message(
      STATUS
        "Tests: left out, without ${missing}; scripts/install_packages.sh installs what they need")
    set(DEFREC_BUILD_TESTS OFF)
  else()
    enable_testing()
  endif()
endif()

# COST of tests: ctest starts them in descending order of it, and takes the seconds of earlier runs
# where it is not set. Long ones come first, so that no core is idle at the end. None claims several
# PROCESSORS: while single ones are left it would not start, and run last and alone. Presets release
# and release-all run three tests at a time on two cores, for some tests wait most of their time:
# for deadlines, or for a browser.
set(DEFREC_COST_FIRST 1000)
set(DEFREC_COST_LONG 20)

# Label slow: what ./test.sh leaves to ./test.sh all, so that a newcomer waits four minutes at most
# for the tests, on two cores. A test is slow
#   - that builds defrec or a package of it anew, or works with what such a test has built;
#   - that goes through all sources with a tool that compiles or parses them;
#   - that takes more than five seconds of a processor, unless no quicker one shows the same part of
#     defrec at work.
# ctest runs a slow test all the same where one that is not slow requires its fixture, so that one
# is slow as well. LABELS are set before this is called.
function(defrec_mark_slow)
  foreach(test IN LISTS ARGN)
    set_property(TEST ${test} APPEND PROPERTY LABELS slow)
  endforeach()
endfunction()

function(defrec_add_tests target)
  if(NOT DEFREC_BUILD_TESTS)
    return()
  endif()
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;LONG;SLOW;LIBRARIES;LABELS;DEFINITIONS")
  defrec_pick_system(arg_SOURCES)
  add_executable(${target} ${arg_SOURCES} "${CMAKE_SOURCE_DIR}/cmake/test_main.cpp")
  target_link_libraries(${target} PRIVATE doctest::doctest ${arg_LIBRARIES})
  target_include_directories(${target} PRIVATE "${CMAKE_SOURCE_DIR}")
  target_compile_definitions(
    ${target}
    PRIVATE ${arg_DEFINITIONS} DEFREC_SOURCE_DIR="${DEFREC_EMULATED_ROOT}${CMAKE_SOURCE_DIR}"
            DEFREC_BUILD_DIR="${DEFREC_EMULATED_ROOT}${CMAKE_BINARY_DIR}"
            DEFREC_SHARED_DATA_DIR="${DEFREC_EMULATED_ROOT}${CMAKE_SOURCE_DIR}/../shared/data")
  file(RELATIVE_PATH folder "${CMAKE_SOURCE_DIR}" "${CMAKE_CURRENT_SOURCE_DIR}")
  foreach(source IN LISTS arg_SOURCES)
    if(source MATCHES "_test\\.cpp$")
      get_filename_component(name "${source}" NAME_WE)
      get_filename_component(room "${source}" DIRECTORY)
      string(REGEX REPLACE "_test$" "" stage "${name}")
      # Tests from elsewhere (../agreement, generated ones) are named after the folder that runs
      # them.
      if(room STREQUAL "" OR room MATCHES "^(\\.\\.|/)")
        set(test "${folder}/${stage}")
      else()
        set(test "${folder}/${room}/${stage}")
      endif()
      string(REGEX REPLACE "^\\.\\./|^/.*/" "" file "${source}")
      add_test(NAME ${test} COMMAND ${target} "--source-file=*/${file}" --no-version)
      set_tests_properties(${test} PROPERTIES LABELS "${stage};${arg_LABELS}")
      if(source IN_LIST arg_LONG OR source IN_LIST arg_SLOW)
        set_tests_properties(${test} PROPERTIES COST ${DEFREC_COST_LONG})
      endif()
      if(source IN_LIST arg_SLOW)
        defrec_mark_slow(${test})
      endif()
    endif()
  endforeach()
endfunction()
