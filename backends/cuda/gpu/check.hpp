// What CUDA answers, as the statuses and error messages of the plugin ABI.
#pragma once
#include <cuda_runtime_api.h>

#include "backends/shared/stage.hpp"

namespace defrec::cuda {

// The status for an error; DEFREC_OK for cudaSuccess.
defrec_status status_of(cudaError_t error);

// Whether the process's context of the device is beyond use: every later call answers with the same
// error.
bool is_sticky(cudaError_t error);

// Throws StageError with the status and an error message that names the call, unless all is well.
void check(cudaError_t error, const char* call);

}  // namespace defrec::cuda
