// See check.hpp.
#include "backends/cuda/gpu/check.hpp"

namespace defrec::cuda {

bool is_sticky(cudaError_t error) {
    switch (error) {
        case cudaErrorIllegalAddress:
        case cudaErrorLaunchTimeout:
        case cudaErrorAssert:
        case cudaErrorHardwareStackError:
        case cudaErrorIllegalInstruction:
        case cudaErrorMisalignedAddress:
        case cudaErrorInvalidAddressSpace:
        case cudaErrorInvalidPc:
        case cudaErrorLaunchFailure:
        case cudaErrorTensorMemoryLeak:
        case cudaErrorECCUncorrectable:
        case cudaErrorNvlinkUncorrectable:
        case cudaErrorContained:
        case cudaErrorCudartUnloading:
        case cudaErrorContextIsDestroyed:
        case cudaErrorDevicesUnavailable:
        case cudaErrorDeviceUninitialized:
        case cudaErrorUnknown: return true;
        default: return false;
    }
}

defrec_status status_of(cudaError_t error) {
    if (error == cudaSuccess) return DEFREC_OK;
    if (error == cudaErrorMemoryAllocation) return DEFREC_ERROR_OUT_OF_MEMORY;
    if (is_sticky(error)) return DEFREC_ERROR_DEVICE_LOST;
    switch (error) {
        case cudaErrorNoDevice:
        case cudaErrorInsufficientDriver:
        case cudaErrorNoKernelImageForDevice:
        case cudaErrorUnsupportedPtxVersion:
        case cudaErrorSystemDriverMismatch:
        case cudaErrorCooperativeLaunchTooLarge:
        case cudaErrorLaunchOutOfResources:
        case cudaErrorNotSupported: return DEFREC_ERROR_UNSUPPORTED;
        default: return DEFREC_ERROR_INTERNAL;
    }
}

void check(cudaError_t error, const char* call) {
    if (error == cudaSuccess) return;
    cudaGetLastError();  // one that is not sticky must not be reported again by the next call
    std::string text = std::string(call) + ": " + cudaGetErrorString(error) + " (" + cudaGetErrorName(error) + ")";
    if (is_sticky(error)) text += "; nothing in this process can use the device any more";
    throw StageError(status_of(error), text);
}

}  // namespace defrec::cuda
