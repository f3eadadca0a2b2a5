# CUDA is used where its compiler is: DEFREC_CUDA says whether. Only the driver and nothing else is
# needed where it runs.
set(DEFREC_CUDA_ARCHITECTURES native
    CACHE STRING
          "GPUs to compile for: native (this machine's), all (for packages), or a list of CMake's")
set(DEFREC_CUDA OFF)

# defrec_native_cuda_architectures(VARIABLE): this machine's GPUs; without one the first in the list
# of all, whose PTX runs on later ones.
function(defrec_native_cuda_architectures variable)
  set(${variable} 75 PARENT_SCOPE)
  execute_process(COMMAND "${DEFREC_NVCC}" --list-gpu-code OUTPUT_VARIABLE known ERROR_QUIET)
  find_program(DEFREC_NVIDIA_SMI nvidia-smi)
  if(NOT DEFREC_NVIDIA_SMI)
    return()
  endif()
  execute_process(COMMAND "${DEFREC_NVIDIA_SMI}" --query-gpu=compute_cap --format=csv,noheader
                  OUTPUT_VARIABLE capabilities RESULT_VARIABLE failed ERROR_QUIET)
  if(failed)
    return()
  endif()
  string(REPLACE "." "" capabilities "${capabilities}")
  string(REGEX MATCHALL "[0-9]+" architectures "${capabilities}")
  list(REMOVE_DUPLICATES architectures)
  foreach(architecture IN LISTS architectures)
    if(NOT known MATCHES "sm_${architecture}\n")
      return()
    endif()
  endforeach()
  list(TRANSFORM architectures APPEND -real)
  if(architectures)
    set(${variable} ${architectures} PARENT_SCOPE)
  endif()
endfunction()

if(NOT DEFREC_BUILD_CUDA)
  message(STATUS "CUDA: left out as asked, its kernels are tested on the processor")
elseif(NOT DEFREC_SANITIZE)
  find_program(DEFREC_NVCC nvcc HINTS ENV CUDA_PATH PATHS /usr/local/cuda/bin)
  if(DEFREC_NVCC)
    set(DEFREC_CUDA ON)
    set(CMAKE_CUDA_COMPILER "${DEFREC_NVCC}")
    if(DEFREC_CUDA_ARCHITECTURES STREQUAL native)
      defrec_native_cuda_architectures(CMAKE_CUDA_ARCHITECTURES)
    elseif(DEFREC_CUDA_ARCHITECTURES STREQUAL all)
      # the last one's PTX is for GPUs to come
      set(CMAKE_CUDA_ARCHITECTURES 75-real 80-real 86-real 89-real 90)
    else()
      set(CMAKE_CUDA_ARCHITECTURES "${DEFREC_CUDA_ARCHITECTURES}")
    endif()
    message(STATUS "CUDA: for ${CMAKE_CUDA_ARCHITECTURES}")
    set(CMAKE_CUDA_RUNTIME_LIBRARY Static)
    enable_language(CUDA)
    # CMake 3.25 does not know how this compiler is asked for C++20.
    if(NOT CMAKE_CUDA20_STANDARD_COMPILE_OPTION)
      set(CMAKE_CUDA20_STANDARD_COMPILE_OPTION "-std=c++20")
      set(CMAKE_CUDA20_EXTENSION_COMPILE_OPTION "-std=c++20")
    endif()
    set(CMAKE_CUDA_STANDARD 20)
    set(CMAKE_CUDA_EXTENSIONS OFF)
  else()
    message(
      STATUS
        "CUDA: no nvcc found; the CUDA backend is left out, its kernels are tested on the processor"
    )
  endif()
else()
  message(
    STATUS "CUDA: left out of builds with sanitizers, its kernels are tested on the processor")
endif()
