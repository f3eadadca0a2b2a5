# Builds for 64-bit ARM on another machine, with Debian's g++-aarch64-linux-gnu and a sysroot
# (scripts/make_sysroot.sh). Programs of the build's tests run by qemu-aarch64-static.
# docs/deployment/arm64.md says how.
#   cmake --preset arm64 -DDEFREC_SYSROOT=<folder>, or the environment's DEFREC_SYSROOT
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)

if(NOT DEFREC_SYSROOT)
  set(DEFREC_SYSROOT "$ENV{DEFREC_SYSROOT}")
endif()
if(NOT EXISTS "${DEFREC_SYSROOT}/usr/lib/aarch64-linux-gnu")
  message(FATAL_ERROR "DEFREC_SYSROOT is \"${DEFREC_SYSROOT}\", expected a folder made by "
                      "scripts/make_sysroot.sh arm64 FOLDER")
endif()
set(CMAKE_SYSROOT "${DEFREC_SYSROOT}")
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES DEFREC_SYSROOT)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_SYSROOT_DIR} "${DEFREC_SYSROOT}")
set(ENV{PKG_CONFIG_LIBDIR}
    "${DEFREC_SYSROOT}/usr/lib/aarch64-linux-gnu/pkgconfig:${DEFREC_SYSROOT}/usr/share/pkgconfig")
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64-static -L "${DEFREC_SYSROOT}")
