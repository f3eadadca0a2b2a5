# defrec as the repository has it in which this port lies: vcpkg install defrec
# --overlay-ports=<repository>/cmake/packaging/ports/vcpkg The library and the plugins; not the
# programs.
vcpkg_check_linkage(ONLY_DYNAMIC_LIBRARY)
get_filename_component(SOURCE_PATH "${CURRENT_PORT_DIR}/../../../../.." ABSOLUTE)
vcpkg_check_features(OUT_FEATURE_OPTIONS FEATURE_OPTIONS FEATURES cuda DEFREC_BUILD_CUDA vulkan
                     DEFREC_BUILD_VULKAN)
set(tools "")
if(DEFREC_BUILD_VULKAN)
  set(tools "-DDEFREC_GLSLANG=${CURRENT_HOST_INSTALLED_DIR}/tools/glslang/glslangValidator"
            "-DDEFREC_SPIRV_VAL=${CURRENT_HOST_INSTALLED_DIR}/tools/spirv-tools/spirv-val")
endif()
if(DEFREC_BUILD_CUDA)
  find_program(DEFREC_NVCC nvcc HINTS ENV CUDA_PATH PATHS /usr/local/cuda/bin)
  if(NOT DEFREC_NVCC) # the project would go on without
    message(FATAL_ERROR "The feature cuda needs nvcc.")
  endif()
  list(APPEND tools -DDEFREC_CUDA_ARCHITECTURES=all)
endif()
vcpkg_find_acquire_program(PKGCONFIG)

# A plugin's manifest has the hash of its file, so nothing may change the file later: it has its run
# path from the start.
set(VCPKG_FIXUP_ELF_RPATH OFF)
vcpkg_cmake_configure(
  SOURCE_PATH "${SOURCE_PATH}" OPTIONS ${FEATURE_OPTIONS} ${tools} -DDEFREC_LIBRARY_ONLY=ON
  "-DPKG_CONFIG_EXECUTABLE=${PKGCONFIG}" "-DCMAKE_INSTALL_RPATH=\$ORIGIN")
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/defrec)
vcpkg_fixup_pkgconfig()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
