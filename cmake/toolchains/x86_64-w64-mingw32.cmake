# Builds for 64-bit Windows on another machine, with Debian's g++-mingw-w64-x86-64-posix and a
# prefix of libraries
# (scripts/make_windows_prefix.sh). Programs of the build's tests run by Wine.
# docs/deployment/windows.md says how.
#   cmake --preset windows -DDEFREC_WINDOWS_PREFIX=<folder>, or the environment's
#   DEFREC_WINDOWS_PREFIX
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)

if(NOT DEFREC_WINDOWS_PREFIX)
  set(DEFREC_WINDOWS_PREFIX "$ENV{DEFREC_WINDOWS_PREFIX}")
endif()
if(NOT IS_DIRECTORY "${DEFREC_WINDOWS_PREFIX}/usr")
  message(
    FATAL_ERROR "DEFREC_WINDOWS_PREFIX is \"${DEFREC_WINDOWS_PREFIX}\", expected a folder made by "
                "scripts/make_windows_prefix.sh FOLDER")
endif()
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES DEFREC_WINDOWS_PREFIX)
set(CMAKE_FIND_ROOT_PATH "${DEFREC_WINDOWS_PREFIX}/usr/x86_64-w64-mingw32"
                         "${DEFREC_WINDOWS_PREFIX}/usr")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_SYSROOT_DIR} "")
set(ENV{PKG_CONFIG_LIBDIR} "${DEFREC_WINDOWS_PREFIX}/usr/x86_64-w64-mingw32/lib/pkgconfig")

# The stack is aligned to 16 bytes there, and g++ takes it for aligned to a vector (GCC bug 54412):
# the assembler turns aligned moves of AVX vectors into unaligned ones, which are as fast where the
# address is aligned.
set(CMAKE_C_FLAGS_INIT "-Wa,-muse-unaligned-vector-move")
set(CMAKE_CXX_FLAGS_INIT "-Wa,-muse-unaligned-vector-move")
# The compiler's runtimes inside: each binary stands alone.
foreach(kind IN ITEMS EXE SHARED MODULE)
  set(CMAKE_${kind}_LINKER_FLAGS_INIT "-static")
endforeach()
find_program(DEFREC_WINE NAMES wine64 wine)
if(DEFREC_WINE)
  set(CMAKE_CROSSCOMPILING_EMULATOR env WINEDEBUG=-all "${DEFREC_WINE}")
  set(DEFREC_EMULATED_ROOT "Z:")
endif()
